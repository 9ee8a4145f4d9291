"""The report's charts: curves with bands, dots with whiskers, weights, maps of policies. Figure objects, no display."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from scla_mj.experiments.report.evidence import Array, Evidence
from scla_mj.experiments.statistics import Curve
from scla_mj.runs.drawing import INK, RULE, SOFT, canvas, draw_policy, draw_weights

WIDTH_IN: Final = 8.6
SERIES: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6d31", "#7a68b3")
"""Okabe and Ito 2008, told apart by every kind of colour vision; without their black and yellow, with two dark hues."""
DASHES: Final = ("-", (0, (5, 1.5)), (0, (2, 1.2)), (0, (6, 1.5, 1.5, 1.5)), "-", (0, (5, 1.5)), (0, (2, 1.2)), "-")
_DOTTED: Final = (0, (1, 1.6))
_ACROSS: Final = 3
_TITLE_LETTERS: Final = 34


class Line(NamedTuple):
    """One curve: `series` chooses its colour and dashes; `x` (n,), its mean and band (n,)."""

    label: str
    series: int
    x: Array
    curve: Curve


class Level(NamedTuple):
    """A reference across the axes, or stepwise over `x` where it changes; `text` stands at its right end."""

    text: str
    values: Array
    x: Array


def curves(
    lines: Sequence[Line],
    levels: Sequence[Level],
    *,
    y_label: str,
    x_label: str = "epoch",
    marks: Sequence[tuple[float, str]] = (),
    from_zero: bool = False,
) -> Figure:
    """Draw curves with their bands over epochs, references dotted, and `marks`: upright lines (x, text).

    `from_zero` begins the x axis at 0, for counts.
    """
    with canvas(WIDTH_IN, 3.9 + 0.12 * len(lines)) as (figure, grid):
        axes: Axes = grid[0, 0]
        axes.grid(axis="y")
        axes.margins(x=0.02)
        axes.xaxis.set_major_locator(MaxNLocator(nbins=12, integer=True))
        axes.set(xlabel=x_label, ylabel=y_label)
        for level in levels:
            axes.plot(level.x, level.values, color=SOFT, lw=1.0, ls=_DOTTED, drawstyle="steps-mid")
            axes.annotate(level.text, (1.0, level.values[-1]), (5, 0), xycoords=("axes fraction", "data"),
                          textcoords="offset points", va="center", fontsize=8.5, color=SOFT)  # fmt: skip
        for line in lines:
            _draw_line(axes, line)
        for x, text in marks:
            axes.axvline(x, color=SOFT, lw=1.0)
            axes.annotate(text, (x, 0.02), (4, 0), xycoords=("data", "axes fraction"), textcoords="offset points",
                          fontsize=8.5, color=SOFT)  # fmt: skip
        axes.set_ylim(bottom=0)
        if from_zero:
            axes.set_xlim(0.0, 1.02 * max(line.x[-1] for line in lines))
        if len(lines) > 1:
            figure.legend(loc="outside lower left", ncols=2, handlelength=2.6)
        return figure


def _draw_line(axes: Axes, line: Line) -> None:
    colour, dash = SERIES[line.series % len(SERIES)], DASHES[line.series % len(DASHES)]
    marker = "o" if len(line.x) < 8 else None
    axes.plot(line.x, line.curve.mean, color=colour, ls=dash, lw=1.8, marker=marker, ms=4, label=line.label)
    if not np.isnan(line.curve.low).all():
        axes.fill_between(line.x, line.curve.low, line.curve.high, color=colour, alpha=0.2, lw=0)


def dots(labels: Sequence[str], values: Array, ends: Array, baselines: Array) -> Figure:
    """Draw one row per label: its percent of ceiling with its interval `ends` (n, 2), and an upright line as baseline.

    The axis begins at the ten percent below the least of them.
    """
    with canvas(WIDTH_IN, 1.0 + 0.27 * len(labels)) as (figure, grid):
        axes: Axes = grid[0, 0]
        rows, seen = np.arange(len(labels)), np.column_stack([values, ends, baselines])
        least = max(0.0, 10.0 * math.floor(float(np.nanmin(seen)) / 10.0 - 0.1))
        axes.hlines(rows, least, 100, color=RULE, lw=0.7, zorder=0)
        axes.hlines(rows, *ends.T, color=SERIES[0], lw=2.2, zorder=2)
        axes.plot(values, rows, "o", color=SERIES[0], ms=6, zorder=3, label="with this setting")
        axes.plot(
            baselines, rows, "|", color=SERIES[1], ms=13, mew=2.0, zorder=2, label="as built, over the same epochs"
        )
        axes.set_yticks(rows, labels)
        axes.tick_params(axis="y", length=0, labelcolor=INK)
        axes.spines["left"].set_visible(False)
        axes.set_ylim(len(labels) - 0.4, -0.6)
        axes.set_xlim(least, max(101.0, float(np.nanmax(seen)) + 1.0))
        axes.set_xlabel("percent of ceiling, settled")
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
        return figure


def weights(x: NDArray[np.float64], curve: Curve, *, weight_max: float) -> Figure:
    """Draw the eight mean weights (epochs, 8) with their bands, and the largest weight possible."""
    with canvas(WIDTH_IN, 3.9) as (figure, grid):
        axes: Axes = grid[0, 0]
        draw_weights(axes, x, curve.mean, (curve.low, curve.high))
        axes.axhline(weight_max, color=SOFT, lw=1.0, ls=_DOTTED)
        axes.xaxis.set_major_locator(MaxNLocator(nbins=12, integer=True))
        axes.set_xlabel("epoch")
        return figure


def policies(items: Sequence[Evidence]) -> Figure:
    """Draw the final policy of every experiment, its probabilities the mean over seeds."""
    rows = math.ceil(len(items) / _ACROSS)
    with canvas(WIDTH_IN, 0.6 + 3.05 * rows, rows, _ACROSS) as (figure, grid):
        for axes in grid.flat[len(items) :]:
            axes.set_visible(False)
        for axes, item in zip(grid.flat, items, strict=False):
            assert item.probabilities is not None
            shades = draw_policy(axes, item.last_grid, item.probabilities)
            axes.tick_params(labelsize=7.5)
            axes.set_title(textwrap.fill(item.experiment.title, _TITLE_LETTERS), fontsize=9)
        figure.colorbar(shades, ax=grid[0], label="probability of an action", location="top", shrink=0.45, aspect=32)
        return figure
