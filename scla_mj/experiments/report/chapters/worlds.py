"""Worlds that are harder than the paper's, each next to its own ceiling."""

from __future__ import annotations

from typing import Any

import numpy as np

from scla_mj.experiments import statistics
from scla_mj.experiments.report import charts
from scla_mj.experiments.report.chapters import shared
from scla_mj.experiments.report.evidence import Evidence, Study
from scla_mj.experiments.report.tables import Figure, Row, Table


def worlds(study: Study) -> dict[str, Any]:
    """Return the table of all worlds, the figure and table of each jumping target, and the other worlds' curves."""
    items = study.group("world")
    still = [item for item in items if not _jump(item)]
    kinds = {
        "obstacles": [item for item in still if _has_obstacles(item)],
        "arenas": [item for item in still if not _has_obstacles(item)],
    }
    return {
        "table": Table("worlds", _COLUMNS, [_row(item) for item in items], shared.setting(*items)) if items else None,
        "jumps": [(_jump_figure(item), _jump_table(item)) for item in items if _jump(item)],
        "curves": [_curves(kind, own) for kind, own in kinds.items() if own],
    }


_COLUMNS = {
    "world": None, "ceiling": 2, "epoch 1, %": 1, "settled, %": 2, shared.INTERVAL: 2, "worst seed, %": 1,
    "moves per hit": 2, "decisions to 90 %": 0, "reached by": None, "epochs": None, "seeds": 0,
}  # fmt: skip


def _jump(item: Evidence) -> int:
    """The epoch of the jump, 0 if the target stays or the run ends before."""
    epoch = item.experiment.config.task.jump_epoch
    return epoch if 0 < epoch <= item.epochs else 0


def _has_obstacles(item: Evidence) -> bool:
    """Whether actions go astray or cells are closed; the other worlds differ by their size and target alone."""
    config = item.experiment.config
    return bool(config.task.action_noise or config.grid.closed_cells)


def _row(item: Evidence) -> Row:
    first, last = max(statistics.settled_span(item.epochs), (_jump(item) + 1, item.epochs))
    first = min(first, last)
    percent, hits = (statistics.span_means(values, first, last) for values in (item.percent, item.hits))
    return (
        item.experiment.title, float(item.ceilings[-1]), float(item.percent[:, 0].mean()), *shared.measured(percent),
        float(percent.min()), float(statistics.moves_per_hit(hits).mean()), *shared.mastery_cells(item),
        shared.span_text(first, last), len(item.runs),
    )  # fmt: skip


def _jump_figure(item: Evidence) -> Figure:
    level = charts.Level(f"ceiling {item.ceilings[-1]:.2f}", item.ceilings, shared.epoch_numbers(item))
    marks = [(_jump(item) - 0.5, "the target jumps")]
    key = f"jump-{item.experiment.name}"
    return shared.curves_figure(key, [shared.hits_line(item, 0)], [level], "hits per 1000", item, marks=marks)


def _jump_table(item: Evidence) -> Table:
    columns = {"epoch": 0, "ceiling": 2, "hits per 1000": 2, shared.INTERVAL: 2, "% of ceiling": 1}
    rows: list[Row] = []
    for epoch in range(max(1, _jump(item) - 1), item.epochs + 1):
        hits, percent = (statistics.span_means(values, epoch, epoch) for values in (item.hits, item.percent))
        rows.append((epoch, float(item.ceilings[epoch - 1]), *shared.measured(hits), float(percent.mean())))
    return Table(f"jump-{item.experiment.name}", columns, rows, shared.setting(item))


def _curves(kind: str, items: list[Evidence]) -> Figure:
    lines = [shared.hits_line(item, index, percent=True) for index, item in enumerate(items)]
    x = shared.epoch_numbers(*items)
    level = charts.Level("ceiling", np.full(len(x), 100.0), x)
    return shared.curves_figure(f"curves-{kind}", lines, [level], "percent of ceiling", *items)
