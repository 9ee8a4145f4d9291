"""The three figures of a run: hits per epoch, mean weights over time, action probabilities. No display, no pyplot."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from scla_mj.anatomy import PROJECTIONS
from scla_mj.grid import Action, Grid
from scla_mj.palette import PROJECTION_COLOURS, TARGET_COLOUR, TARGET_MARKER
from scla_mj.paths import EPOCHS_PNG, POLICY_PNG, WEIGHTS_PNG
from scla_mj.runs.atomic import replacing
from scla_mj.runs.history import WeightCurve
from scla_mj.runs.summary import Summary

DPI: Final = 150
INK: Final = "#333333"
BAR: Final = "#4477aa"
CEILING: Final = "#222222"
FLOOR: Final = "#999999"
CLOSED: Final = "#555555"
ARROW: Final = "#f28e2b"
POLICY_COLOURS: Final = "Blues"

UNDECIDED: Final = 0.05
"""A mean step shorter than this, in cells, is drawn as no arrow: it would be a speck."""


def plot_epochs(folder: Path, summary: Summary, *, floor_hits_per_1000: float | None = None) -> None:
    """Write `epochs.png`: hits per 1000 decisions of every epoch, each epoch's ceiling, and a random walk if given.

    `floor_hits_per_1000` is what a random walk earns on the first epoch's floor: drawn until the target jumps.

    Raises:
        SclaError: the folder cannot be written to.
    """
    figure, axes = _canvas(7.0, 4.0)
    numbers = [epoch.epoch for epoch in summary.epochs]
    hits = [epoch.hits_per_1000 for epoch in summary.epochs]
    axes.bar(numbers, hits, width=0.72, color=BAR, zorder=2)
    ceilings = [epoch.ceiling_hits_per_1000 for epoch in summary.epochs] or [summary.ceiling_hits_per_1000]
    before_jump = next((n for n, ceiling in enumerate(ceilings) if ceiling != ceilings[0]), len(ceilings))
    _levels(axes, ceilings, "ceiling", CEILING, "--")
    if floor_hits_per_1000 is not None:
        floors = [floor_hits_per_1000] * before_jump + [math.nan] * (len(ceilings) - before_jump)
        _levels(axes, floors, "random walk", FLOOR, ":")
    top = 1.12 * max([*ceilings, *hits])
    if len(numbers) <= 12:
        for number, value in zip(numbers, hits, strict=True):
            base, colour = (0.0, "white") if value > 0.1 * top else (value, INK)
            axes.annotate(f"{value:.0f}", (number, base), (0, 4), textcoords="offset points", ha="center", va="bottom",
                          fontsize=8, color=colour, weight="bold", zorder=4)  # fmt: skip
    axes.set_ylim(0, top)
    axes.set_xlim(min(numbers, default=1) - 0.6, max(numbers, default=1) + 0.6)
    axes.xaxis.set_major_locator(MaxNLocator(nbins=15, integer=True, min_n_ticks=1))
    axes.set_xlabel("epoch")
    axes.set_ylabel("hits per 1000 decisions")
    _entitle(figure, axes, "Hits per epoch", summary)
    _save(figure, folder / EPOCHS_PNG)


def plot_weights(folder: Path, curve: WeightCurve, summary: Summary) -> None:
    """Write `weights.png`: the 8 mean weights over simulated time (the paper's Figure 3); `summary` says of which run.

    Raises:
        SclaError: the folder cannot be written to.
    """
    figure, axes = _canvas(7.0, 4.2)
    unit, seconds = _time_unit(float(curve.time_s[-1]) if len(curve.time_s) else 0.0)
    for index, projection in enumerate(PROJECTIONS):
        colour, line = PROJECTION_COLOURS[projection.name], "-" if projection.agrees else "--"
        label = projection.name.replace("to", " → ")
        axes.plot(curve.time_s / seconds, curve.mean_weights[:, index], line, color=colour, lw=1.6, label=label)
    axes.set_ylim(bottom=0)
    axes.margins(x=0.01)
    axes.set_xlabel(f"simulated time ({unit})")
    axes.set_ylabel("mean weight (mV)")
    _entitle(figure, axes, "Mean weights: agreeing projections warm, opposite ones cool", summary)
    handles, labels = axes.get_legend_handles_labels()
    order = sorted(range(len(labels)), key=lambda index: not PROJECTIONS[index].agrees)
    axes.legend([handles[i] for i in order], [labels[i] for i in order], ncols=1, frameon=False, fontsize=8,
                loc="center left", bbox_to_anchor=(1.0, 0.5), handlelength=2.4)  # fmt: skip
    _save(figure, folder / WEIGHTS_PNG)


def plot_policy(folder: Path, grid: Grid, probabilities: NDArray[np.float64], summary: Summary) -> None:
    """Write `policy.png`: every cell quartered, a quarter an action, darker where it is likelier; the target marked.

    `probabilities` is (W, H, 4), indexed from 0 by x - 1, y - 1 and action; `summary` says of which run.

    Raises:
        SclaError: the folder cannot be written to.
    """
    width, height = grid.cells
    figure, axes = _canvas(*_policy_size(width, height))
    cells = [cell for cell in grid.open_cells() if cell != grid.target]
    values = [probabilities[cell.x - 1, cell.y - 1, action] for cell, action in itertools.product(cells, Action)]
    quarters = [_quarter(cell.x, cell.y, action) for cell, action in itertools.product(cells, Action)]
    shades = PolyCollection(quarters, array=np.asarray(values), cmap=POLICY_COLOURS, edgecolors="white", linewidths=0.4)
    shades.set_clim(0.0, 1.0)
    axes.add_collection(shades)
    _arrows(axes, grid, probabilities)
    _mark_cells(axes, grid)
    axes.set_xlim(0.5, width + 0.5)
    axes.set_ylim(0.5, height + 0.5)
    axes.set_aspect("equal")
    axes.xaxis.set_major_locator(MaxNLocator(nbins=12, integer=True, steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_locator(MaxNLocator(nbins=12, integer=True, steps=[1, 2, 5, 10]))
    axes.grid(False)
    axes.set_xlabel("x")
    axes.set_ylabel("y")
    _entitle(figure, axes, "Action probabilities of the cells", summary)
    figure.colorbar(shades, ax=axes, label="probability", shrink=0.85)
    _save(figure, folder / POLICY_PNG)


def _canvas(width_in: float, height_in: float) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(width_in, height_in), dpi=DPI, layout="constrained")
    axes = figure.add_subplot()
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="y", color="#e5e5e5", lw=0.8)
    axes.set_axisbelow(True)
    axes.tick_params(colors=INK, labelsize=9)
    return figure, axes


def _entitle(figure: Figure, axes: Axes, title: str, summary: Summary) -> None:
    """Say what is shown, and under it of which run."""
    figure.suptitle(title, fontsize=11)
    axes.set_title(_setting(summary), fontsize=8, color=INK)


def _save(figure: Figure, path: Path) -> None:
    """Write the PNG without a date or a version in it, so that the same figure gives the same bytes."""
    with replacing(path) as scratch:
        figure.savefig(scratch, format="png", metadata={"Software": None})


def _levels(axes: Axes, values: list[float], name: str, colour: str, line: str) -> None:
    """Draw a level for every epoch, from 1, stepwise where it changes, and name each: the last at the right, outside.

    NaN ends the line.
    """
    axes.plot([0.4, *(n + 0.5 for n in range(1, len(values))), len(values) + 0.6], [*values, values[-1]], ls=line,
              color=colour, drawstyle="steps-post", lw=1.2, zorder=3)  # fmt: skip
    for first, value in enumerate(values, 1):
        if math.isnan(value) or (first > 1 and value == values[first - 2]):
            continue
        text = f"{name} {value:.4g}"
        if value == values[-1]:
            axes.annotate(text, (1.0, value), (4, 0), xycoords=("axes fraction", "data"), textcoords="offset points",
                          va="center", ha="left", fontsize=8, color=colour, annotation_clip=False)  # fmt: skip
        else:
            axes.annotate(text, (first - 0.5, value), (6, 5), textcoords="offset points", fontsize=8, color=colour,
                          zorder=4, bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.5})  # fmt: skip


def _setting(summary: Summary) -> str:
    (width, height), (x, y) = summary.cells, summary.target
    jumps = any(epoch.ceiling_hits_per_1000 != summary.ceiling_hits_per_1000 for epoch in summary.epochs)
    where = f"target ({x}, {y}), which jumps" if jumps else f"target ({x}, {y})"
    return f"{summary.protocol}, {width}×{height} cells, {where}, seed {summary.seed}"


def _time_unit(end_s: float) -> tuple[str, float]:
    """Return the unit in which a run's length is easy to read, and its seconds."""
    if end_s >= 2 * 3600:
        return "h", 3600.0
    return ("min", 60.0) if end_s >= 2 * 60 else ("s", 1.0)


def _policy_size(width: int, height: int) -> tuple[float, float]:
    """Return inches that give a cell the same look on grids of any shape, within a page."""
    inch_per_cell = min(0.9, 8.0 / max(width, height))
    return max(3.2, inch_per_cell * width + 1.7), max(2.6, inch_per_cell * height + 1.0)


def _quarter(x: int, y: int, action: Action) -> list[tuple[float, float]]:
    """Return the triangle between a cell's centre and the edge that the action crosses."""
    dx, dy = action.step
    edge_x, edge_y, half = x + dx / 2, y + dy / 2, 0.5
    side_x, side_y = abs(dy) * half, abs(dx) * half
    return [(x, y), (edge_x - side_x, edge_y - side_y), (edge_x + side_x, edge_y + side_y)]


def _arrows(axes: Axes, grid: Grid, probabilities: NDArray[np.float64]) -> None:
    """Draw every cell's mean step, as long as the cell's mind is made up."""
    cells = np.array([cell for cell in grid.open_cells() if cell != grid.target])
    steps = probabilities[cells[:, 0] - 1, cells[:, 1] - 1] @ np.array([action.step for action in Action])
    drawn = np.linalg.norm(steps, axis=1) > UNDECIDED
    axes.quiver(*cells[drawn].T, *steps[drawn].T, pivot="mid", angles="xy", scale_units="xy", scale=1.5, color=ARROW,
                width=0.07, units="xy", headwidth=3.4, headlength=3.4, headaxislength=3.0, minlength=0.0, zorder=3,
                edgecolor="white", linewidth=0.6)  # fmt: skip


def _mark_cells(axes: Axes, grid: Grid) -> None:
    """Outline the cells, mark the target, fill closed cells."""
    for cell in grid.all_cells():
        colour = CLOSED if cell in grid.closed else "none"
        corners = [(cell.x + dx, cell.y + dy) for dx, dy in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))]
        axes.add_collection(PolyCollection([corners], facecolors=colour, edgecolors="white", linewidths=2.0, zorder=2))
    axes.plot(*grid.target, marker=TARGET_MARKER, color=TARGET_COLOUR, ms=90 / max(*grid.cells, 5), zorder=4)
