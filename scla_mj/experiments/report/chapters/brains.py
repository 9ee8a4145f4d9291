"""All brains in the paper's arena: how fast, how far, what the automata learned, and whether differences are chance."""

from __future__ import annotations

from typing import Any

import numpy as np

from scla_mj.experiments import exact, statistics
from scla_mj.experiments.report import charts
from scla_mj.experiments.report.chapters import shared
from scla_mj.experiments.report.chapters.differences import difference_table
from scla_mj.experiments.report.evidence import Array, Evidence, Study, generator
from scla_mj.experiments.report.tables import Figure, Row, Table
from scla_mj.grid import PROTOCOLS, Action


def brains(study: Study) -> dict[str, Any]:
    """Return the curves and the table of every brain, by protocol, and the tests of difference."""
    compared = study.group("paper", "comparison")
    kinds = list(dict.fromkeys(map(_kind, compared)))
    protocols = []
    for protocol in PROTOCOLS:
        items = [item for item in compared if item.experiment.config.protocol == protocol]
        if items:
            series = [kinds.index(_kind(item)) for item in items]
            figures = _curves(items, series, protocol), _early(items, series, protocol)
            protocols.append((*figures, _table(items, protocol)))
    return {"protocols": protocols, "tests": difference_table("brains", compared, study)}


def _kind(item: Evidence) -> tuple[str, str]:
    """What makes a brain the same brain under either protocol, so that it keeps its colour."""
    config = item.experiment.config
    return config.brain, str(config.brain_settings)


def _curves(items: list[Evidence], series: list[int], protocol: str) -> Figure:
    lines = [shared.hits_line(item, index) for item, index in zip(items, series, strict=True)]
    levels = _levels(items[0], shared.epoch_numbers(*items))
    return shared.curves_figure(f"curves-{protocol}", lines, levels, "hits per 1000", *items)


def _early(items: list[Evidence], series: list[int], protocol: str) -> Figure:
    lines = [
        charts.Line(item.experiment.title, index, item.early_decisions,
                    statistics.learning_curve(item.early, rng=generator()))
        for item, index in zip(items, series, strict=True)
    ]  # fmt: skip
    levels = _levels(items[0], np.array([0.0, max(line.x[-1] for line in lines)]))
    return shared.curves_figure(
        f"early-{protocol}", lines, levels, "hits per 1000", *items, x_label="decision", from_zero=True
    )


def _levels(item: Evidence, x: Array) -> list[charts.Level]:
    walk = exact.random_walk(item.experiment.config.protocol, item.checked.grid())
    references = (("ceiling", float(item.ceilings[0])), ("random walk", walk))
    return [charts.Level(f"{name} {value:.2f}", np.full(len(x), value), x) for name, value in references]


def _table(items: list[Evidence], protocol: str) -> Table:
    columns = {
        "brain": None, "epoch 1": 1, "settled": 2, shared.INTERVAL: 2, "% of ceiling": 1, "moves per hit": 2,
        "decisions to 90 %": 0, "reached by": None, "epochs": None, "seeds": 0,
    }  # fmt: skip
    return Table(f"brains-{protocol}", columns, [_row(item) for item in items], shared.setting(*items))


def _row(item: Evidence) -> Row:
    span = statistics.settled_span(item.epochs)
    hits, percent = (statistics.span_means(values, *span) for values in (item.hits, item.percent))
    return (
        item.experiment.title, float(item.hits[:, 0].mean()), *shared.measured(hits), float(percent.mean()),
        float(statistics.moves_per_hit(hits).mean()), *shared.mastery_cells(item), shared.span_text(*span),
        len(item.runs),
    )  # fmt: skip


def policies(study: Study) -> Figure | None:
    """Return the maps of every experiment with automata, ablations left out; None if there is none."""
    items = [item for item in study.group("paper", "comparison", "world") if item.probabilities is not None]
    if not items:
        return None
    columns: dict[str, int | None] = {"experiment": None, "x": 0, "y": 0}
    columns |= {**{action.label: 4 for action in Action}, "nearer": 4}
    rows = [row for item in items for row in _policy_rows(item)]
    return Figure("policies", columns, rows, shared.setting(*items), chart=charts.policies(items))


def _policy_rows(item: Evidence) -> list[Row]:
    """Return every cell's action probabilities, and that of an action that brings the target one move nearer."""
    assert item.probabilities is not None
    grid, rows = item.last_grid, list[Row]()
    for cell in (cell for cell in grid.open_cells() if cell != grid.target):
        chances = item.probabilities[cell.x - 1, cell.y - 1]
        good = [action for action, beyond in grid.neighbours(cell) if grid.distances[beyond] < grid.distances[cell]]
        rows.append((item.experiment.title, cell.x, cell.y, *chances.tolist(), float(chances[good].sum())))
    return rows
