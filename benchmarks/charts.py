"""Growth as pictures: cost against neurons and against the arena's size."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from matplotlib.figure import Figure

from benchmarks.growth import Point

_INCHES: Final = (5.2, 3.6)
_DPI: Final = 120
_LINE: Final = "#0072b2"


def draw_neurons(points: Sequence[Point], file: Path) -> None:
    """Both axes logarithmic, with a line of proportional growth."""
    figure = Figure(figsize=_INCHES, dpi=_DPI, layout="constrained")
    axes = figure.subplots()
    sizes, costs = [point.size for point in points], [point.cost for point in points]
    axes.loglog(sizes, costs, "o-", color=_LINE, label="measured")
    axes.loglog(sizes, [costs[0] * size / sizes[0] for size in sizes], "--", color="grey", label="proportional")
    axes.set(xlabel="neurons", ylabel="CPU time per simulated ms, µs", title="80 plastic synapses per neuron")
    axes.legend(frameon=False)
    figure.savefig(file)


def draw_arenas(points: Sequence[Point], file: Path) -> None:
    """Cost per decision from zero, so that a small difference looks small."""
    figure = Figure(figsize=_INCHES, dpi=_DPI, layout="constrained")
    axes = figure.subplots()
    axes.plot([point.size for point in points], [point.cost for point in points], "o-", color=_LINE)
    axes.set(xlabel="cells along an edge", ylabel="CPU time per decision, ms", title="telemetry light")
    axes.set_ylim(0.0, 1.15 * max(point.cost for point in points))
    figure.savefig(file)
