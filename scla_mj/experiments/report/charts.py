"""The report's charts: curves with bands, dots with whiskers, maps of a policy. Figure objects, no display."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import IO, Any, Final, Literal, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from scla_mj.experiments.statistics import Curve

Array = NDArray[np.float64]

DPI: Final = 150
WIDTH_IN: Final = 8.6
INK: Final = "#22262b"
SOFT: Final = "#626a73"
RULE: Final = "#dcdcd6"

SERIES: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6d31", "#7a68b3")
"""Okabe and Ito 2008, told apart by every kind of colour vision; without their black and yellow, with two dark hues."""
DASHES: Final = ("-", (0, (5, 1.5)), (0, (2, 1.2)), (0, (6, 1.5, 1.5, 1.5)), "-", (0, (5, 1.5)), (0, (2, 1.2)), "-")

_STYLE: Final[dict[Any, Any]] = {
    "svg.fonttype": "none",
    "font.size": 9.5,
    "axes.edgecolor": SOFT,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlecolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
}


class Line(NamedTuple):
    """One curve: `x` (n,) and its mean and band (n,)."""

    label: str
    colour: str
    dash: Any
    x: Array
    curve: Curve


class Level(NamedTuple):
    """A yardstick across the axes, or stepwise over `x` where it changes; `text` stands at its right end."""

    text: str
    values: Array
    x: Array


def style(index: int) -> tuple[str, Any]:
    """Return the colour and dashes of a chart's n-th series."""
    return SERIES[index % len(SERIES)], DASHES[index % len(DASHES)]


def save(chart: Figure, file: IO[Any] | str, *, kind: Literal["svg", "png"], salt: str) -> None:
    """Write a chart such that the same chart gives the same bytes; an SVG is transparent, a PNG on white."""
    none = dict.fromkeys(("Date", "Creator", "Format", "Type")) if kind == "svg" else {"Software": None}
    with mpl.rc_context({**_STYLE, "svg.hashsalt": salt}):
        chart.savefig(file, format=kind, dpi=DPI, transparent=kind == "svg", metadata=none)
    chart.set_layout_engine("none")  # laid out once: the next file need not do it again


@contextmanager
def canvas(rows: int = 1, columns: int = 1, *, height_in: float, **options: Any) -> Iterator[tuple[Figure, Any]]:
    """Yield a figure of the report's width and its axes (rows, columns), in the report's style."""
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(WIDTH_IN, height_in), layout="constrained", facecolor="white")
        yield figure, figure.subplots(rows, columns, squeeze=False, **options)


def curves(
    lines: Sequence[Line],
    levels: Sequence[Level],
    *,
    y_label: str,
    x_label: str = "epoch",
    marks: Sequence[tuple[float, str]] = (),
    from_zero: bool = False,
    height_in: float = 4.0,
) -> Figure:
    """Draw curves with their bands over epochs, yardsticks dotted, and `marks`: upright lines (x, text).

    `from_zero` begins the x axis at 0, for counts.
    """
    with canvas(height_in=height_in) as (figure, grid):
        axes = grid[0, 0]
        _prepare(axes, x_label, y_label)
        for level in levels:
            axes.plot(level.x, level.values, color=SOFT, lw=1.0, ls=(0, (1, 1.6)), drawstyle="steps-mid")
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


def dots(labels: Sequence[str], values: Array, lows: Array, highs: Array, baselines: Array, *, x_label: str) -> Figure:
    """Draw a row a label: its value with its interval, and a short upright line at what it is compared with."""
    with canvas(height_in=1.0 + 0.27 * len(labels)) as (figure, grid):
        axes = grid[0, 0]
        rows = np.arange(len(labels))
        axes.hlines(rows, 0, 100, color=RULE, lw=0.7, zorder=0)
        known = ~np.isnan(lows)
        axes.hlines(rows[known], lows[known], highs[known], color=SERIES[0], lw=2.2, zorder=2)
        axes.plot(values, rows, "o", color=SERIES[0], ms=6, zorder=3, label="with this setting")
        axes.plot(
            baselines, rows, "|", color=SERIES[1], ms=13, mew=2.0, zorder=2, label="as built, over the same epochs"
        )
        axes.set_yticks(rows, labels)
        axes.tick_params(axis="y", length=0, labelcolor=INK)
        axes.spines["left"].set_visible(False)
        axes.set_ylim(len(labels) - 0.4, -0.6)
        axes.set_xlim(0, max(101.0, float(np.nanmax(np.concatenate([values, highs, baselines]))) + 1.0))
        axes.set_xlabel(x_label)
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
        return figure


def weights(agreeing: Sequence[Line], opposite: Sequence[Line], *, weight_max: float) -> Figure:
    """Draw the eight mean weights in two panels, agreeing projections and opposite ones, on one scale."""
    with canvas(1, 2, height_in=3.7, sharey=True) as (figure, grid):
        for axes, lines, title in zip(grid[0], (agreeing, opposite), ("agreeing", "opposite"), strict=True):
            _prepare(axes, "epoch", "mean weight (mV)" if title == "agreeing" else "")
            for line in lines:
                _draw_line(axes, line)
            axes.axhline(weight_max, color=SOFT, lw=1.0, ls=(0, (1, 1.6)))
            axes.set_title(f"{title} projections")
            axes.set_ylim(0, 1.05 * weight_max)
            axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.17), ncols=2, handlelength=2.6)
        return figure


def _prepare(axes: Axes, x_label: str, y_label: str) -> None:
    axes.grid(axis="y", color=RULE, lw=0.7)
    axes.set_axisbelow(True)
    axes.margins(x=0.02)
    axes.xaxis.set_major_locator(MaxNLocator(nbins=12, integer=True))
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)


def _draw_line(axes: Axes, line: Line) -> None:
    marker = "o" if len(line.x) < 8 else None
    axes.plot(line.x, line.curve.mean, color=line.colour, ls=line.dash, lw=1.8, marker=marker, ms=4, label=line.label)
    if not np.isnan(line.curve.low).all():
        axes.fill_between(line.x, line.curve.low, line.curve.high, color=line.colour, alpha=0.2, lw=0)


def panel_rows(count: int, across: int) -> int:
    """Return how many rows of panels hold `count` of them."""
    return math.ceil(count / across)
