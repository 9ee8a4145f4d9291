"""All brains on the paper's floor: how fast, how far, and whether the difference is more than chance."""

from __future__ import annotations

import numpy as np

from scla_mj.experiments import statistics
from scla_mj.experiments.report import charts
from scla_mj.experiments.report.document import Block, Cell, Column, Figure, Paragraph, Section, Table
from scla_mj.experiments.report.evidence import BLOCK_DECISIONS, Array, Evidence, Study, generator
from scla_mj.experiments.report.sections import parts
from scla_mj.experiments.report.sections.tests_of_difference import difference_table
from scla_mj.grid import PROTOCOLS


def brains(study: Study) -> Section:
    """Return the learning curves and figures of every brain, a protocol at a time, and the tests of difference."""
    compared = study.group("paper", "comparison")
    kinds = list(dict.fromkeys(_kind(item) for item in compared))
    blocks: list[Block] = []
    for protocol in PROTOCOLS:
        items = [item for item in compared if item.experiment.config.protocol == protocol]
        if items:
            series = [kinds.index(_kind(item)) for item in items]
            blocks += [_curves(items, series, protocol), _early(items, series, protocol), _table(items, protocol)]
    blocks += difference_table("brains", "each brain", compared, study)
    return Section("brains", "Brains compared", tuple(blocks) or (Paragraph("No brain's runs are here."),))


def _kind(item: Evidence) -> tuple[str, str]:
    """What makes a brain the same brain under either protocol, so that it keeps its colour."""
    config = item.experiment.config
    return config.brain, str(config.brain_settings)


def _curves(items: list[Evidence], series: list[int], protocol: str) -> Figure:
    lines = [parts.hits_line(item, item.experiment.title, index) for item, index in zip(items, series, strict=True)]
    x = parts.epoch_numbers(max(items, key=lambda item: item.epochs))
    chart = charts.curves(lines, _levels(items[0], x), y_label="hits per 1000 decisions", height_in=_height_in(items))
    caption = (
        f"Learning curves: mean over seeds of each epoch's hits, band: {parts.INTERVAL}. Dotted: the ceiling, and what "
        f"a random walk earns. {parts.setting(*items)}"
    )
    return Figure(f"curves-{protocol}", caption, chart, parts.line_columns("hits per 1000"), parts.line_rows(lines))


def _early(items: list[Evidence], series: list[int], protocol: str) -> Figure:
    lines = [_early_line(item, index) for item, index in zip(items, series, strict=True)]
    levels = _levels(items[0], np.array([0.0, max(line.x[-1] for line in lines)]))
    chart = charts.curves(
        lines,
        levels,
        x_label="decision",
        y_label="hits per 1000 decisions",
        from_zero=True,
        height_in=_height_in(items),
    )
    caption = (
        f"The beginning, in blocks of {BLOCK_DECISIONS} decisions, each drawn at its end; band: {parts.INTERVAL}. "
        f"{parts.setting(*items)}"
    )
    columns = (Column("series"), Column("decision", 0), Column("hits per 1000", 2), Column(parts.INTERVAL, 2))
    return Figure(f"early-{protocol}", caption, chart, columns, parts.line_rows(lines))


def _early_line(item: Evidence, series: int) -> charts.Line:
    colour, dash = charts.style(series)
    curve = statistics.learning_curve(item.early, rng=generator())
    return charts.Line(item.experiment.title, colour, dash, item.early_decisions, curve)


def _levels(item: Evidence, x: Array) -> list[charts.Level]:
    yardsticks = (("ceiling", item.ceilings[0]), ("random walk", parts.random_walk_hits(item.experiment.config)))
    return [charts.Level(f"{name} {value:.2f}", np.full(len(x), value), x) for name, value in yardsticks]


def _height_in(items: list[Evidence]) -> float:
    """Room for a legend of two columns."""
    return 3.8 + 0.12 * len(items)


def _table(items: list[Evidence], protocol: str) -> Table:
    columns = (
        Column("brain"),
        Column("epoch 1", 1),
        Column("settled", 2),
        Column(parts.INTERVAL, 2),
        Column("% of ceiling", 1),
        Column("moves a hit", 2),
        Column("decisions to 90 %", 0),
        Column("reached by"),
        Column("epochs"),
        Column("seeds", 0),
    )
    window = statistics.WINDOW_DECISIONS
    caption = (
        "Hits per 1000 decisions in the first epoch and when settled (the last two thirds of the epochs, as stated), "
        f"the settled percent of ceiling and moves a hit, and the median decision at which the last {window} decisions "
        f"earned {100 * statistics.MASTERY:.0f} % of the ceiling (the least possible is {window}). "
        f"{parts.setting(*items)}"
    )
    return Table(f"brains-{protocol}", caption, columns, tuple(_row(item) for item in items))


def _row(item: Evidence) -> tuple[Cell, ...]:
    first, last = statistics.settled_span(item.epochs)
    hits = statistics.span_means(item.hits, first, last)
    percent = float(statistics.span_means(item.percent, first, last).mean())
    moves = float(statistics.moves_a_hit(hits).mean())
    span = parts.span_text(first, last)
    start = float(item.hits[:, 0].mean())
    title = item.experiment.title
    return title, start, *parts.measured(hits), percent, moves, *parts.mastery_cells(item), span, len(item.runs)
