"""What each part is worth: one setting changed at a time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scla_mj.anatomy import PROJECTIONS
from scla_mj.experiments import statistics
from scla_mj.experiments.report import charts
from scla_mj.experiments.report.chapters import shared
from scla_mj.experiments.report.chapters.differences import difference_table
from scla_mj.experiments.report.evidence import Evidence, Study, estimate
from scla_mj.experiments.report.tables import Figure, Interval, Row, Table
from scla_mj.grid import PROTOCOLS


def ablations(study: Study) -> dict[str, Any]:
    """Return a table and a figure per protocol, the weights under scalar dopamine, and the tests of difference."""
    items = study.group("ablation")
    parts = [[item for item in items if item.experiment.config.protocol == protocol] for protocol in PROTOCOLS]
    scalar = [item for item in items if item.experiment.config.plasticity.modulation == "scalar"]
    return {
        "protocols": [(_table(own), _dots(own, study)) for own in parts if own],
        "scalar": [_scalar(item, study) for item in scalar if item.weights is not None],
        "tests": difference_table("ablations", items, study),
    }


def _scalar(item: Evidence, study: Study) -> dict[str, Any]:
    """Return what one signal for all connections does to them, next to the signed one."""
    compared = [each for each in (item, study.named(item.experiment.baseline)) if each and each.weights is not None]
    return {
        "title": item.experiment.title,
        "ends": [(each.experiment.title, *_final_weights(each)) for each in compared],
        "figure": shared.weights_figure(item),
        "network": item.experiment.config.network,
    }


def _final_weights(item: Evidence) -> tuple[str, str]:
    """Return the mean agreeing and the mean opposite weight at the end, in mV, in words."""
    assert item.weights is not None
    agrees = np.array([projection.agrees for projection in PROJECTIONS])
    agreeing, opposite = (item.weights[:, -1, own].mean(axis=1) for own in (agrees, ~agrees))
    return shared.mean_with_interval(agreeing, 2), shared.mean_with_interval(opposite, 2)


def _table(items: list[Evidence]) -> Table:
    columns = {
        "ablation": None, "what it asks": None, "epoch 1, %": 1, "settled, %": 2, shared.INTERVAL: 2,
        "worst seed, %": 1, "decisions to 90 %": 0, "reached by": None, "epochs": None, "seeds": 0,
    }  # fmt: skip
    key = f"ablations-{items[0].experiment.config.protocol}"
    return Table(key, columns, [_row(item) for item in items], shared.setting(*items))


def _row(item: Evidence) -> Row:
    span = statistics.settled_span(item.epochs)
    percent = statistics.span_means(item.percent, *span)
    return (
        item.experiment.title, item.experiment.question, float(item.percent[:, 0].mean()), *shared.measured(percent),
        float(percent.min()), *shared.mastery_cells(item), shared.span_text(*span), len(item.runs),
    )  # fmt: skip


def _dots(items: list[Evidence], study: Study) -> Figure:
    rows: list[tuple[str, str, float, Interval, float]] = []
    for item in items:
        baseline = study.named(item.experiment.baseline)
        span = statistics.settled_span(min(item.epochs, baseline.epochs) if baseline else item.epochs)
        mean, low, high, _ = estimate(statistics.span_means(item.percent, *span))
        as_built = float(statistics.span_means(baseline.percent, *span).mean()) if baseline else math.nan
        rows.append((item.experiment.title, shared.span_text(*span), mean, Interval(low, high), as_built))
    columns = {
        "ablation": None, "epochs": None, "percent of ceiling": 2, shared.INTERVAL: 2, "as built, percent of ceiling": 2
    }  # fmt: skip
    labels, _, means, ends, baselines = zip(*rows, strict=True)
    chart = charts.dots(labels, np.array(means), np.array(ends), np.array(baselines))
    key = f"ablations-{items[0].experiment.config.protocol}"
    return Figure(key, columns, rows, shared.setting(*items), chart=chart)
