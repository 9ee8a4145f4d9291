"""What each part is worth: one setting changed at a time."""

from __future__ import annotations

import numpy as np

from scla_mj.experiments import statistics
from scla_mj.experiments.report import charts
from scla_mj.experiments.report.document import Block, Cell, Column, Figure, Interval, Paragraph, Section, Table
from scla_mj.experiments.report.evidence import Evidence, Study, estimate
from scla_mj.experiments.report.sections import parts
from scla_mj.experiments.report.sections.tests_of_difference import difference_table
from scla_mj.experiments.report.sections.weights_figure import final_weights, weights_figure
from scla_mj.grid import PROTOCOLS


def ablations(study: Study) -> Section:
    """Return the ablations' figures, a protocol at a time, and their tests of difference."""
    items = study.group("ablation")
    if not items:
        return Section("ablations", "Ablations", (Paragraph("No ablation's runs are here."),))
    blocks: list[Block] = []
    for protocol in PROTOCOLS:
        own = [item for item in items if item.experiment.config.protocol == protocol]
        if own:
            blocks += [_table(own, protocol), _dots(own, protocol, study)]
    scalar = [item for item in items if item.experiment.config.plasticity.modulation == "scalar"]
    blocks += [block for item in scalar if item.weights is not None for block in _scalar(item, study)]
    return Section("ablations", "Ablations", (*blocks, *difference_table("ablations", "each ablation", items, study)))


def _scalar(item: Evidence, study: Study) -> tuple[Block, ...]:
    """Show what one signal for all connections does to them, beside the signed one."""
    baseline = study.named(item.experiment.baseline)
    shown = [each for each in (item, baseline) if each is not None and each.weights is not None]
    figure = weights_figure(item, f"{parts.opening(item.experiment.title)}: ")
    return Paragraph(" ".join(map(_weights_sentence, shown))), figure


def _weights_sentence(item: Evidence) -> str:
    agreeing, opposite = (parts.mean_with_interval(weights, 2) for weights in final_weights(item))
    title = parts.opening(item.experiment.title)
    return f"{title}: agreeing weights end at {agreeing} mV, opposite ones at {opposite} mV."


def _table(items: list[Evidence], protocol: str) -> Table:
    columns = (
        Column("ablation"),
        Column("what it asks"),
        Column("epoch 1, %", 1),
        Column("settled, %", 2),
        Column(parts.INTERVAL, 2),
        Column("worst seed, %", 1),
        Column("decisions to 90 %", 0),
        Column("reached by"),
        Column("epochs"),
        Column("seeds", 0),
    )
    caption = (
        "Each row changes one setting of SCLA; in percent of ceiling. Epochs and seeds may differ from the paper's and "
        f"stand beside each row. {parts.setting(*items)}"
    )
    return Table(f"ablations-{protocol}", caption, columns, tuple(_row(item) for item in items))


def _row(item: Evidence) -> tuple[Cell, ...]:
    first, last = statistics.settled_span(item.epochs)
    percent = statistics.span_means(item.percent, first, last)
    return (
        item.experiment.title,
        item.experiment.question,
        float(item.percent[:, 0].mean()),
        *parts.measured(percent),
        float(percent.min()),
        *parts.mastery_cells(item),
        parts.span_text(first, last),
        len(item.runs),
    )


def _dots(items: list[Evidence], protocol: str, study: Study) -> Figure:
    rows: list[tuple[Cell, ...]] = []
    for item in items:
        baseline = study.named(item.experiment.baseline)
        span = statistics.settled_span(min(item.epochs, baseline.epochs) if baseline else item.epochs)
        mean = estimate(statistics.span_means(item.percent, *span))
        as_built = float(statistics.span_means(baseline.percent, *span).mean()) if baseline else float("nan")
        rows.append((item.experiment.title, parts.span_text(*span), mean.mean, Interval(mean.low, mean.high), as_built))
    means = np.array([row[2] for row in rows], dtype=np.float64)
    ends = np.array([row[3] for row in rows], dtype=np.float64)
    baselines = np.array([row[4] for row in rows], dtype=np.float64)
    labels = [item.experiment.title for item in items]
    chart = charts.dots(labels, means, ends[:, 0], ends[:, 1], baselines, x_label="percent of ceiling, settled")
    caption = (
        f"Ablations when settled, with their {parts.INTERVAL}, beside SCLA as built over the same epochs. "
        f"{parts.setting(*items)}"
    )
    columns = (
        Column("ablation"),
        Column("epochs"),
        Column("percent of ceiling", 2),
        Column(parts.INTERVAL, 2),
        Column("as built, percent of ceiling", 2),
    )
    return Figure(f"ablations-{protocol}", caption, chart, columns, tuple(rows))
