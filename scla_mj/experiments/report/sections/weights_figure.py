"""The eight connections over the epochs, as in the paper's Figure 3."""

from __future__ import annotations

import numpy as np

from scla_mj.anatomy import PROJECTIONS
from scla_mj.experiments import statistics
from scla_mj.experiments.report import charts
from scla_mj.experiments.report.document import Figure
from scla_mj.experiments.report.evidence import Array, Evidence, generator
from scla_mj.experiments.report.sections import parts
from scla_mj.palette import PROJECTION_COLOURS


def weights_figure(item: Evidence, opening: str) -> Figure:
    """Return the figure of an experiment with synapses; `opening` begins its caption."""
    weights = item.weights
    assert weights is not None
    curve = statistics.learning_curve(weights, rng=generator())
    lines: list[charts.Line] = []
    for index, projection in enumerate(PROJECTIONS):
        colour = PROJECTION_COLOURS[projection.name]
        own = statistics.Curve(*(values[:, index] for values in curve))
        dash = charts.DASHES[index // 2]
        lines.append(charts.Line(projection.name.replace("to", " → "), colour, dash, parts.epoch_numbers(item), own))
    config = item.experiment.config
    chart = charts.weights(
        [line for line, projection in zip(lines, PROJECTIONS, strict=True) if projection.agrees],
        [line for line, projection in zip(lines, PROJECTIONS, strict=True) if not projection.agrees],
        weight_max=config.network.weight_max,
    )
    low, high = config.network.weight_low, config.network.weight_high
    caption = (
        f"{opening}the eight connections at the end of each epoch, mean of all synapses, with the "
        f"{parts.INTERVAL} over seeds as a band. Dotted: the clip at {config.network.weight_max:g} mV. Before the "
        f"first epoch all are uniform in {low:g} to {high:g}. {parts.setting(item)}"
    )
    key, columns = f"weights-{item.experiment.name}", parts.line_columns("mean weight (mV)")
    return Figure(key, caption, chart, columns, parts.line_rows(lines))


def final_weights(item: Evidence) -> tuple[Array, Array]:
    """Return every seed's mean agreeing and mean opposite weight at the end (seeds,), in mV."""
    assert item.weights is not None
    agrees = np.array([projection.agrees for projection in PROJECTIONS])
    last = item.weights[:, -1]
    return last[:, agrees].mean(axis=1), last[:, ~agrees].mean(axis=1)
