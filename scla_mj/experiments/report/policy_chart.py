"""What the automata of all cells have learned: a map an experiment."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Final, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from scla_mj.experiments.report import charts
from scla_mj.grid import Action, Cell, Grid
from scla_mj.palette import TARGET_COLOUR, TARGET_MARKER

ACROSS: Final = 3
_SHADES: Final = "Blues"
_ARROW: Final = "#d55e00"
_CLOSED: Final = "#6b7075"
_TITLE_LETTERS: Final = 34
_SHORTEST_ARROW: Final = 0.05
"""A mean step shorter than this, in cells, is drawn as no arrow: it would be a speck."""


class Policy(NamedTuple):
    """A floor and its cells' action probabilities (W, H, 4)."""

    title: str
    grid: Grid
    probabilities: NDArray[np.float64]


def nearer(grid: Grid, probabilities: NDArray[np.float64], cell: Cell) -> float:
    """Return a cell's probability of an action that brings the target one move nearer."""
    good = [action for action, beyond in grid.neighbours(cell) if grid.distances[beyond] < grid.distances[cell]]
    return float(probabilities[cell.x - 1, cell.y - 1, good].sum())


def policy_chart(policies: Sequence[Policy]) -> Figure:
    """Draw the maps side by side: shaded by the probability of a step nearer, an arrow along the mean step."""
    rows = charts.panel_rows(len(policies), ACROSS)
    with charts.canvas(rows, ACROSS, height_in=0.9 + 3.1 * rows) as (figure, grid):
        for axes, policy in zip(grid.flat, policies, strict=False):
            _map(axes, policy)
        for axes in grid.flat[len(policies) :]:
            axes.set_visible(False)
        shades = mpl.cm.ScalarMappable(mpl.colors.Normalize(0.0, 1.0), _SHADES)
        figure.colorbar(shades, ax=grid, label="probability of a step nearer", location="top", shrink=0.45, aspect=32)
        return figure


def _map(axes: Axes, policy: Policy) -> None:
    width, height = policy.grid.cells
    colours = mpl.colormaps[_SHADES]
    for cell in policy.grid.all_cells():
        if cell in policy.grid.closed:
            colour = _CLOSED
        elif cell == policy.grid.target:
            colour = "none"
        else:
            colour = mpl.colors.to_hex(colours(nearer(policy.grid, policy.probabilities, cell)))
        axes.add_patch(Rectangle((cell.x - 0.47, cell.y - 0.47), 0.94, 0.94, facecolor=colour, edgecolor="none"))
    _arrows(axes, policy)
    axes.plot(*policy.grid.target, marker=TARGET_MARKER, color=TARGET_COLOUR, ms=13 * 5 / max(width, height, 5))
    axes.set(xlim=(0.5, width + 0.5), ylim=(0.5, height + 0.5), aspect="equal")
    axes.set_xticks(range(1, width + 1))
    axes.set_yticks(range(1, height + 1))
    axes.tick_params(length=0, labelsize=7.5)
    axes.spines[["left", "bottom"]].set_visible(False)
    axes.set_title(textwrap.fill(policy.title, _TITLE_LETTERS), fontsize=9)


def _arrows(axes: Axes, policy: Policy) -> None:
    cells = np.array([cell for cell in policy.grid.open_cells() if cell != policy.grid.target])
    steps = policy.probabilities[cells[:, 0] - 1, cells[:, 1] - 1] @ np.array([action.step for action in Action])
    drawn = np.linalg.norm(steps, axis=1) > _SHORTEST_ARROW
    axes.quiver(*cells[drawn].T, *steps[drawn].T, pivot="mid", angles="xy", scale_units="xy", scale=1.4, units="xy",
                width=0.08, headwidth=3.2, headlength=3.2, headaxislength=2.8, minlength=0.0, color=_ARROW,
                edgecolor="white", linewidth=0.5)  # fmt: skip
