"""Harder floors than the paper's, each beside its own ceiling."""

from __future__ import annotations

import numpy as np

from scla_mj.experiments import statistics
from scla_mj.experiments.report import charts
from scla_mj.experiments.report.document import Block, Cell, Column, Figure, Paragraph, Section, Table
from scla_mj.experiments.report.evidence import Evidence, Study
from scla_mj.experiments.report.sections import parts


def worlds(study: Study) -> Section:
    """Return every world's figures, the jumping target's curve, and the other worlds' curves."""
    items = study.group("world")
    if not items:
        return Section("worlds", "Other worlds", (Paragraph("No run of another world is here."),))
    blocks: list[Block] = [_table(items)]
    jumping = [item for item in items if _jump(item)]
    blocks += [block for item in jumping for block in (_jump_curve(item), _jump_table(item))]
    still = [item for item in items if not _jump(item)]
    uneasy = [item for item in still if _is_uneasy(item)]
    others = [item for item in still if not _is_uneasy(item)]
    blocks += [_curves(*part) for part in (("uneasy", uneasy), ("floors", others)) if part[1]]
    return Section("worlds", "Other worlds", tuple(blocks))


def _jump(item: Evidence) -> int:
    """The epoch of the jump, 0 if the target stays or the run ends before."""
    epoch = item.experiment.config.task.jump_epoch
    return epoch if 0 < epoch <= item.epochs else 0


def _table(items: list[Evidence]) -> Table:
    columns = (
        Column("world"),
        Column("ceiling", 2),
        Column("epoch 1, %", 1),
        Column("settled, %", 2),
        Column(parts.INTERVAL, 2),
        Column("worst seed, %", 1),
        Column("moves a hit", 2),
        Column("decisions to 90 %", 0),
        Column("reached by"),
        Column("epochs"),
        Column("seeds", 0),
    )
    caption = (
        "SCLA, its settings unchanged, in percent of each world's own ceiling (where the target jumps: the last one): "
        "by search, and for a non-deterministic floor by value iteration on the same MDP. "
        f"{parts.setting(*items)}"
    )
    return Table("worlds", caption, columns, tuple(_row(item) for item in items))


def _row(item: Evidence) -> tuple[Cell, ...]:
    first, last = max(statistics.settled_span(item.epochs), (_jump(item) + 1, item.epochs))
    first = min(first, last)
    percent, hits = (statistics.span_means(values, first, last) for values in (item.percent, item.hits))
    moves = float(statistics.moves_a_hit(hits).mean())
    return (
        item.experiment.title, float(item.ceilings[-1]), float(item.percent[:, 0].mean()), *parts.measured(percent),
        float(percent.min()), moves, *parts.mastery_cells(item), parts.span_text(first, last), len(item.runs),
    )  # fmt: skip


def _jump_curve(item: Evidence) -> Figure:
    line = parts.hits_line(item, item.experiment.title, 0)
    x = parts.epoch_numbers(item)
    level = charts.Level(f"ceiling {item.ceilings[-1]:.2f}", item.ceilings, x)
    mark = (_jump(item) - 0.5, "the target jumps")
    chart = charts.curves([line], [level], y_label="hits per 1000 decisions", marks=[mark])
    caption = (
        f"Hits where the target jumps; the brain is not told. Dotted: the ceiling of each epoch's target. Band: "
        f"{parts.INTERVAL}. {parts.setting(item)}"
    )
    key = f"jump-{item.experiment.name}"
    return Figure(key, caption, chart, parts.line_columns("hits per 1000"), parts.line_rows([line]))


def _jump_table(item: Evidence) -> Table:
    columns = (
        Column("epoch", 0),
        Column("ceiling", 2),
        Column("hits per 1000", 2),
        Column(parts.INTERVAL, 2),
        Column("% of ceiling", 1),
    )
    rows: list[tuple[Cell, ...]] = []
    for epoch in range(max(1, _jump(item) - 1), item.epochs + 1):
        hits, percent = (statistics.span_means(values, epoch, epoch) for values in (item.hits, item.percent))
        rows.append((epoch, float(item.ceilings[epoch - 1]), *parts.measured(hits), float(percent.mean())))
    caption = f"The epochs around the jump. {parts.setting(item)}"
    return Table(f"jump-{item.experiment.name}", caption, columns, tuple(rows))


def _is_uneasy(item: Evidence) -> bool:
    """Whether moves go astray or cells are closed; the other worlds differ by their size and target alone."""
    config = item.experiment.config
    return bool(config.task.action_noise or config.grid.closed_cells)


def _curves(key: str, items: list[Evidence]) -> Figure:
    lines = [parts.hits_line(item, item.experiment.title, index, percent=True) for index, item in enumerate(items)]
    x = np.arange(1.0, 1.0 + max(item.epochs for item in items))
    level = charts.Level("ceiling", np.full(len(x), 100.0), x)
    chart = charts.curves(lines, [level], y_label="percent of ceiling", height_in=4.4 + 0.1 * len(items))
    caption = (
        f"Learning curves of the other worlds in percent of each one's ceiling; band: {parts.INTERVAL}. "
        f"{parts.setting(*items)}"
    )
    return Figure(f"curves-{key}", caption, chart, parts.line_columns("percent of ceiling"), parts.line_rows(lines))
