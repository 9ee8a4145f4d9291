"""The three figures of a run: hits and mean weights over its decisions, action probabilities."""

from __future__ import annotations

import itertools
import re
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from scla_mj.anatomy import PROJECTION_NAMES, Projection
from scla_mj.grid import Grid, said
from scla_mj.paths import LEARNING_PNG, POLICY_PNG, WEIGHTS_PNG
from scla_mj.runs.atomic import replacing
from scla_mj.runs.drawing import (
    BLOCKS,
    INK,
    LETTER_MM,
    MM_PER_INCH,
    POLICY_KEY,
    SOFT,
    block_edges,
    block_hits,
    block_middles,
    canvas,
    draw_line,
    draw_policy,
    draw_weights,
    of_one_run,
    over_decisions,
    save,
)
from scla_mj.runs.summary import Summary
from scla_mj.signals import WeightCurve

HITS: Final = "#0072b2"
CEILING: Final = INK
CHANCE: Final = SOFT


def plot_learning(folder: Path, summary: Summary, hits: NDArray[np.bool_]) -> None:
    """Write `learning.png`: hits per 1000 decisions over blocks of decisions, the ceiling, and chance until a jump.

    `hits` (decisions,) says for every decision whether it reached the target.

    Raises:
        SclaError: the folder cannot be written to.
    """
    with canvas(width_mm=130, height_mm=75) as (figure, grid):
        axes: Axes = grid[0, 0]
        edges = block_edges(len(hits))
        draw_line(axes, block_middles(edges), of_one_run(block_hits(hits, edges)), HITS, marked=True)
        draw_bounds(axes, summary)
        _write(figure, folder / LEARNING_PNG, "Hits per 1000 decisions", summary)


def draw_bounds(axes: Axes, *summaries: Summary) -> None:
    """Draw the ceiling of every epoch of runs and, until it changes, chance; name them at the right, and the axes."""
    named, highest = dict[str, tuple[float, str]](), list[float]()
    for summary in summaries:
        ends = epoch_ends(summary)
        ceilings = [epoch.ceiling_hits_per_1000 for epoch in summary.epochs] or [summary.ceiling_hits_per_1000]
        steps = [1, *ends] if ends else [1, 10]
        axes.plot(steps, [ceilings[0], *ceilings], ls="--", color=CEILING, drawstyle="steps-pre", lw=0.9, zorder=2)
        before = next((end for end, one, other in zip(ends, ceilings, ceilings[1:], strict=False) if one != other),
                      steps[-1])  # fmt: skip
        chance = summary.chance_hits_per_1000
        axes.plot([1, before], [chance, chance], ls=":", color=CHANCE, lw=0.9, zorder=2)
        named[f"ceiling {ceilings[-1]:.4g}"] = ceilings[-1], CEILING
        if before == steps[-1]:
            named[f"chance {chance:.4g}"] = chance, CHANCE
        highest += ceilings
    for text, (value, colour) in named.items():
        axes.annotate(text, (1.0, value), (4, 0), xycoords=("axes fraction", "data"), textcoords="offset points",
                      va="center", ha="left", fontsize=6.5, color=colour, annotation_clip=False)  # fmt: skip
    over_decisions(axes, max(map(epoch_ends, summaries), key=lambda ends: sum(ends[-1:])), first=4)
    axes.set_ylim(0, 1.08 * max([*highest, *axes.dataLim.intervaly]))
    axes.set_ylabel(f"hits per 1000 decisions\n{BLOCKS}")
    axes.grid(axis="y")


def epoch_ends(summary: Summary) -> list[int]:
    """Return the number of every epoch's last decision."""
    return list(itertools.accumulate(epoch.decisions for epoch in summary.epochs))


def plot_weights(folder: Path, curve: WeightCurve, projections: Sequence[Projection], summary: Summary) -> None:
    """Write `weights.png`: each projection's mean weight over the decisions (the paper's Figure 3).

    `summary` names the run.

    Raises:
        SclaError: the folder cannot be written to.
    """
    with canvas(width_mm=130, height_mm=75) as (figure, grid):
        axes: Axes = grid[0, 0]
        draw_weights(axes, curve.decision.astype(float), of_one_run(curve.mean_weights), projections)
        over_decisions(axes, epoch_ends(summary))
        _write(figure, folder / WEIGHTS_PNG, f"Mean weights of the projections{dashes(projections)}", summary)


def dashes(projections: Sequence[Projection]) -> str:
    """Return what a title adds of the paper's projections."""
    papers = tuple(projection.name for projection in projections) == PROJECTION_NAMES
    return " (dashed: opposite directions)" if papers else ""


def plot_policy(folder: Path, grid: Grid, probabilities: NDArray[np.float64], summary: Summary) -> None:
    """Write `policy.png`: every cell quartered, one quarter per action, darker where it is more probable.

    `probabilities` is (W, H, 4), indexed from 0 by x - 1, y - 1 and action; `summary` names the run.

    Raises:
        SclaError: the folder cannot be written to.
    """
    width_mm, height_mm = policy_size(*grid.cells)
    with canvas(width_mm=width_mm, height_mm=height_mm) as (figure, panels):
        axes: Axes = panels[0, 0]
        shades = draw_policy(axes, grid, probabilities)
        axes.set_xlabel("x")
        axes.set_ylabel("y")
        figure.colorbar(shades, ax=axes, label="probability", shrink=0.85)
        _write(figure, folder / POLICY_PNG, "Action probabilities of the cells", summary, POLICY_KEY)


def _write(figure: Figure, path: Path, title: str, summary: Summary, key: str = "") -> None:
    """Write the PNG under a title, and below it the setting of the run."""
    entitle(figure, title, setting(summary), key)
    with replacing(path) as scratch:
        save(figure, scratch)


def entitle(figure: Figure, title: str, *below: str) -> None:
    """Put a title above all, and below it the lines of what it is of."""
    letters = int(figure.get_figwidth() * MM_PER_INCH / LETTER_MM)
    whole = (re.sub(r"\((\d+), ", "(\\1,\N{NO-BREAK SPACE}", line) for line in below if line)  # a cell is one word
    lines = "\n".join(textwrap.fill(line, letters) for line in whole)
    figure.suptitle(title, fontsize=8, weight="bold")
    figure.axes[0].set_title(lines, fontsize=6.5, weight="normal", loc="center", color=SOFT)


def setting(summary: Summary, seeds: str = "") -> str:
    """Return a run's brain, protocol, arena and seed in words; `seeds` in place of its own."""
    return ", ".join((*parts(summary), seeds or f"seed {summary.seed}")) + crossed(summary)


def parts(summary: Summary) -> tuple[str, ...]:
    """Return a run's brain, protocol, grid and targets in words."""
    (width, height), where = summary.cells, said((summary.target, *summary.others))
    jumps = any(epoch.ceiling_hits_per_1000 != summary.ceiling_hits_per_1000 for epoch in summary.epochs)
    where += ", which jumps" if jumps else ""
    return summary.brain, summary.protocol, f"{width}×{height} cells", where


def crossed(summary: Summary) -> str:
    """Return what a label adds where the wheels were crossed."""
    return f", wheels crossed from epoch {summary.crossed_epoch}" if summary.crossed_epoch else ""


def policy_size(width: int, height: int) -> tuple[float, float]:
    """Return millimetres that give a cell the same look on grids of any shape, within a page."""
    mm_per_cell = min(17.0, 150.0 / max(width, height))
    return max(62.0, mm_per_cell * width + 32.0), max(50.0, mm_per_cell * height + 22.0)
