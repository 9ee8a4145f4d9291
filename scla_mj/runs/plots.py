"""The three figures of a run: hits per epoch, mean weights over time, action probabilities."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from scla_mj.anatomy import PROJECTION_NAMES, Projection
from scla_mj.grid import Grid
from scla_mj.paths import EPOCHS_PNG, POLICY_PNG, WEIGHTS_PNG
from scla_mj.runs.atomic import replacing
from scla_mj.runs.drawing import INK, canvas, draw_policy, draw_weights, save
from scla_mj.runs.summary import Summary
from scla_mj.signals import WeightCurve

BAR: Final = "#4477aa"
CEILING: Final = "#111111"
CHANCE: Final = "#999999"


def plot_epochs(folder: Path, summary: Summary) -> None:
    """Write `epochs.png`: hits per 1000 decisions of every epoch, each epoch's ceiling, and chance until a jump.

    Raises:
        SclaError: the folder cannot be written to.
    """
    with canvas(7.0, 4.0) as (figure, grid):
        axes: Axes = grid[0, 0]
        numbers = [epoch.epoch for epoch in summary.epochs]
        hits = [epoch.hits_per_1000 for epoch in summary.epochs]
        axes.bar(numbers, hits, width=0.72, color=BAR, zorder=2)
        ceilings = [epoch.ceiling_hits_per_1000 for epoch in summary.epochs] or [summary.ceiling_hits_per_1000]
        before_jump = next((n for n, ceiling in enumerate(ceilings) if ceiling != ceilings[0]), len(ceilings))
        _draw_levels(axes, ceilings, "ceiling", CEILING, "--")
        chance = [summary.chance_hits_per_1000] * before_jump + [math.nan] * (len(ceilings) - before_jump)
        _draw_levels(axes, chance, "chance", CHANCE, ":")
        top = 1.12 * max([*ceilings, *hits])
        if len(numbers) <= 12:
            for number, value in zip(numbers, hits, strict=True):
                base, colour = (0.0, "white") if value > 0.1 * top else (value, INK)
                axes.annotate(f"{value:.0f}", (number, base), (0, 4), textcoords="offset points", ha="center",
                              va="bottom", fontsize=8, color=colour, weight="bold", zorder=4)  # fmt: skip
        axes.set_ylim(0, top)
        axes.set_xlim(min(numbers, default=1) - 0.6, max(numbers, default=1) + 0.6)
        axes.xaxis.set_major_locator(MaxNLocator(nbins=15, integer=True, min_n_ticks=1))
        axes.set_xlabel("epoch")
        axes.set_ylabel("hits per 1000 decisions")
        axes.grid(axis="y")
        _write(figure, folder / EPOCHS_PNG, "Hits per epoch", summary)


def plot_weights(folder: Path, curve: WeightCurve, projections: Sequence[Projection], summary: Summary) -> None:
    """Write `weights.png`: each projection's mean weight over simulated time (the paper's Figure 3).

    `summary` names the run.

    Raises:
        SclaError: the folder cannot be written to.
    """
    with canvas(7.0, 4.2) as (figure, grid):
        axes: Axes = grid[0, 0]
        unit, seconds = _time_unit(float(curve.time_s[-1]) if len(curve.time_s) else 0.0)
        draw_weights(axes, curve.time_s / seconds, curve.mean_weights, projections=projections)
        axes.set_xlabel(f"simulated time ({unit})")
        papers = tuple(projection.name for projection in projections) == PROJECTION_NAMES
        agree = ": solid where sensor and motor agree, dashed where they are opposite" if papers else ""
        _write(figure, folder / WEIGHTS_PNG, f"Mean weights{agree}", summary)


def plot_policy(folder: Path, grid: Grid, probabilities: NDArray[np.float64], summary: Summary) -> None:
    """Write `policy.png`: every cell quartered, one quarter per action, darker where it is more probable.

    `probabilities` is (W, H, 4), indexed from 0 by x - 1, y - 1 and action; `summary` names the run.

    Raises:
        SclaError: the folder cannot be written to.
    """
    with canvas(*_policy_size(*grid.cells)) as (figure, panels):
        axes: Axes = panels[0, 0]
        shades = draw_policy(axes, grid, probabilities)
        axes.set_xlabel("x")
        axes.set_ylabel("y")
        figure.colorbar(shades, ax=axes, label="probability", shrink=0.85)
        _write(figure, folder / POLICY_PNG, "Action probabilities of the cells", summary)


def _write(figure: Figure, path: Path, title: str, summary: Summary) -> None:
    """Write the PNG under a title, and below it the setting of the run."""
    figure.suptitle(title, fontsize=11)
    figure.axes[0].set_title(_setting(summary), fontsize=8, weight="normal", loc="center")
    with replacing(path) as scratch:
        save(figure, scratch)


def _draw_levels(axes: Axes, values: list[float], name: str, colour: str, line: str) -> None:
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
    crossed = f", wheels crossed from epoch {summary.crossed_epoch}" if summary.crossed_epoch else ""
    return f"{summary.brain}, {summary.protocol}, {width}×{height} cells, {where}, seed {summary.seed}{crossed}"


def _time_unit(end_s: float) -> tuple[str, float]:
    """Return the unit in which a run's length is easy to read, and its seconds."""
    if end_s >= 2 * 3600:
        return "h", 3600.0
    return ("min", 60.0) if end_s >= 2 * 60 else ("s", 1.0)


def _policy_size(width: int, height: int) -> tuple[float, float]:
    """Return inches that give a cell the same look on grids of any shape, within a page."""
    inch_per_cell = min(0.9, 8.0 / max(width, height))
    return max(3.2, inch_per_cell * width + 1.7), max(2.6, inch_per_cell * height + 1.0)
