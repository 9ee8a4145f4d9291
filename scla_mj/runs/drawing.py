"""What all saved figures share: one style, and the two drawings that a run and a report both show. No pyplot."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, Final, Literal

import matplotlib as mpl
import numpy as np
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Rectangle
from matplotlib.ticker import MaxNLocator, NullFormatter
from matplotlib.transforms import Affine2D
from numpy.typing import NDArray

from scla_mj.anatomy import Projection
from scla_mj.grid import Action, Grid
from scla_mj.palette import TARGET_COLOUR, projection_styles

Array = NDArray[np.float64]
Curve = tuple[Array, Array, Array]
"""A mean (n, ...) and the ends of its interval, NaN where a single run allows none."""

WIDE_MM: Final = 180.0
"""Of a figure over both columns of a page; one column is 85 mm."""
MM_PER_INCH: Final = 25.4
DPI: Final = 220
"""Of a PNG: a wide figure has some 1560 pixels across."""
Kind = Literal["png", "pdf", "svg"]
INK: Final = "#22262b"
SOFT: Final = "#626a73"
RULE: Final = "#dcdcd6"
POLICY_SHADES: Final = "Blues"
_ARROW: Final = "#e8730c"
_CLOSED: Final = "#6b7075"
_SHORTEST_BLOCK: Final = 25
_LONGEST_BLOCK: Final = 1000
_BLOCK_GROWTH: Final = 0.26
"""Of the decisions so far: ten blocks over a factor of ten."""
BLOCKS: Final = f"in blocks of {_SHORTEST_BLOCK} to {_LONGEST_BLOCK} decisions"
_APART: Final = 0.1
"""Of the logarithms of two points whose marks do not run into one another."""
_LEAST_PROBABLE: Final = 0.3
"""Of an action with an arrow: more than one of four that are equally probable has."""
POLICY_KEY: Final = f"star: target; arrows: actions above {_LEAST_PROBABLE}"
LETTER_MM: Final = 1.5
"""Of small text, at most."""

_NAMED_EPOCHS: Final = (1, 3, 10, 30, 100, 300, 1000)
_DATED: Final[dict[Kind, tuple[str, ...]]] = {
    "png": ("Software",),
    "pdf": ("Creator", "Producer", "CreationDate"),
    "svg": ("Date", "Creator", "Format", "Type"),
}
"""What a file would say of the hour and the version that made it."""
_STYLE: Final[dict[Any, Any]] = {
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
    "font.size": 7.0,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4,
    "xtick.major.size": 3.0,
    "ytick.major.size": 3.0,
    "xtick.minor.size": 1.8,
    "axes.edgecolor": SOFT,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "axes.titlesize": 7.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlecolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "grid.color": RULE,
    "grid.linewidth": 0.5,
    "legend.frameon": False,
}


def of_one_run(values: Array) -> Curve:
    """Return a single run's values as a curve without a band."""
    none = np.full(values.shape, np.nan)
    return values, none, none


def block_edges(decisions: int) -> NDArray[np.int64]:
    """Return the ends (n + 1,) of blocks whose lengths grow as a log axis does: of 25 to 1000 decisions, from 0.

    Blocks share no decision, so that each of a curve's points says something that its neighbours do not.
    """
    edges = [0]
    while edges[-1] < decisions:
        length = min(max(_SHORTEST_BLOCK, round(edges[-1] * _BLOCK_GROWTH)), _LONGEST_BLOCK)
        left = decisions - edges[-1] - length
        edges.append(decisions if left < _SHORTEST_BLOCK else edges[-1] + length)
    return np.array(edges)


def block_hits(hits: NDArray[np.bool_], edges: NDArray[np.int64]) -> Array:
    """Return the hits per 1000 decisions of every block of a run's `hits` (decisions,)."""
    counts = np.diff(np.concatenate([[0], np.cumsum(hits)])[edges])
    return np.asarray(1000.0 * counts / np.diff(edges))


def block_middles(edges: NDArray[np.int64]) -> Array:
    """Return where a block's point stands on a log axis: between its first decision, from 1, and its last."""
    return np.asarray(np.sqrt((edges[:-1] + 1.0) * edges[1:]))


@contextmanager
def canvas(
    *, width_mm: float = WIDE_MM, height_mm: float, rows: int = 1, columns: int = 1
) -> Iterator[tuple[Figure, Any]]:
    """Yield a figure and its axes (rows, columns), in the shared style."""
    with style.context(["default", _STYLE]):  # whatever a matplotlibrc or a user's code has set
        size = width_mm / MM_PER_INCH, height_mm / MM_PER_INCH
        figure = Figure(figsize=size, layout="constrained", facecolor="white")
        yield figure, figure.subplots(rows, columns, squeeze=False)


def save(figure: Figure, file: IO[Any] | Path, *, kind: Kind = "png", salt: str = "") -> None:
    """Write a figure without date or version, so that equal figures give equal bytes; an SVG has no background.

    `salt` makes the names inside an SVG differ from those of other figures on the same page.
    """
    with style.context(["default", {**_STYLE, "svg.hashsalt": salt}]):
        figure.savefig(file, format=kind, dpi=DPI, transparent=kind == "svg", metadata=dict.fromkeys(_DATED[kind]))
    figure.set_layout_engine("none")  # laid out once: the next file need not do it again


def over_decisions(axes: Axes, epoch_ends: Sequence[int], first: float = 1.0) -> None:
    """Make the x axis one of decisions, from 1 or `first`, on a log scale; the epochs' ends are ticks at the top."""
    last = max([*epoch_ends, 10])
    axes.set_xscale("log")
    axes.set_xlim(first, last)
    axes.set_xlabel("decision (log scale)")
    top = axes.secondary_xaxis("top")
    count = len(epoch_ends)
    named = [number for number in _NAMED_EPOCHS if number <= count and epoch_ends[number - 1] >= first]
    mm_per_decade = axes.bbox.width / axes.figure.dpi * MM_PER_INCH / math.log10(last / first)
    if named and mm_per_decade * math.log10(last / epoch_ends[named[-1] - 1]) > LETTER_MM * (len(str(count)) + 1):
        named.append(count)  # there is room for it
    top.set_xticks(
        [epoch_ends[number - 1] for number in named],
        [str(number) if n else f"epoch {number}" for n, number in enumerate(named)],
    )
    for label in top.get_xticklabels()[:1]:
        label.set_horizontalalignment("right")  # it is the longest, and the next is close to it
    top.set_xticks([end for end in epoch_ends if end >= first], minor=True)
    top.tick_params(labelsize=6, pad=1, which="both")
    top.xaxis.set_minor_formatter(NullFormatter())


def draw_line(
    axes: Axes, x: Array, curve: Curve, colour: str, dash: Any = "-", label: str = "", *, marked: bool = False
) -> None:
    """Draw a curve (n,) over `x` (n,) with its band; few points are marked, `marked` all that a log axis parts."""
    few = len(x) < 8
    apart = np.flatnonzero(np.diff(np.log(x), prepend=-np.inf) > _APART).tolist() if marked and not few else None
    mean, low, high = curve
    axes.plot(x, mean, color=colour, ls=dash, lw=1.3, marker="o" if few or marked else None, ms=3 if few else 2.2,
              markevery=apart, label=label, zorder=3)  # fmt: skip
    if not np.isnan(low).all():
        axes.fill_between(x, low, high, color=colour, alpha=0.2, lw=0)


def draw_weights(axes: Axes, x: Array, curve: Curve, projections: Sequence[Projection]) -> None:
    """Draw the mean weight of each projection (n, projections) in mV over `x` (n,).

    Of the paper's the agreeing ones are solid, opposite ones dashed, in the colour of their sensor's direction.
    """
    styles = projection_styles(projections)
    for index, projection in enumerate(projections):
        colour, dash = styles[projection.name]
        ends = projection.source, projection.target
        label = " → ".join(ends) if projection.name == "to".join(ends) else projection.name
        mean, low, high = (values[:, index] for values in curve)
        draw_line(axes, x, (mean, low, high), colour, dash, label)
    if not (curve[0] < 0.0).any():
        axes.set_ylim(bottom=0)
    axes.margins(x=0.01)
    axes.set_ylabel("mean weight (mV)")
    axes.grid(axis="y")
    handles, labels = axes.get_legend_handles_labels()
    order = sorted(range(len(labels)), key=lambda index: projections[index].dashed)
    axes.legend([handles[i] for i in order], [labels[i] for i in order], loc="center left", bbox_to_anchor=(1.0, 0.5),
                handlelength=2.4)  # fmt: skip


def draw_policy(axes: Axes, grid: Grid, probabilities: Array) -> PolyCollection:
    """Draw a map of action probabilities (W, H, 4), indexed by x - 1, y - 1 and action; return what a colour bar needs.

    Every cell is quartered, one quarter per action, darker where it is more probable; those above `_LEAST_PROBABLE`
    have an arrow. Targets are stars, closed cells are grey.
    """
    width, height = grid.cells
    cells = [cell for cell in grid.open_cells() if cell not in grid.targets]
    values = [probabilities[cell.x - 1, cell.y - 1, action] for cell, action in itertools.product(cells, Action)]
    quarters = [_quarter(cell.x, cell.y, action) for cell, action in itertools.product(cells, Action)]
    shades = PolyCollection(
        quarters, array=np.asarray(values), cmap=POLICY_SHADES, edgecolors="white", linewidths=0.4, clim=(0.0, 1.0)
    )
    axes.add_collection(shades)
    _draw_arrows(axes, grid, probabilities)
    seam = min(2.0, 12.0 / max(width, height))  # points
    for cell in grid.all_cells():
        colour = _CLOSED if cell in grid.closed else "none"
        axes.add_patch(Rectangle((cell.x - 0.5, cell.y - 0.5), 1, 1, facecolor=colour, edgecolor="white", lw=seam))
    for target in grid.targets:
        star = mpl.path.Path.unit_regular_star(5, 0.382).transformed(Affine2D().scale(0.24).translate(*target))
        axes.add_patch(PathPatch(star, facecolor=TARGET_COLOUR, edgecolor="none", zorder=4))
    axes.set(xlim=(0.5, width + 0.5), ylim=(0.5, height + 0.5), aspect="equal")
    axes.xaxis.set_major_locator(MaxNLocator(nbins=12, integer=True, steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_locator(MaxNLocator(nbins=12, integer=True, steps=[1, 2, 5, 10]))
    axes.tick_params(length=0)
    axes.spines[["left", "bottom"]].set_visible(False)
    return shades


def _quarter(x: int, y: int, action: Action) -> list[tuple[float, float]]:
    """Return the triangle between a cell's centre and the edge that the action crosses."""
    dx, dy = action.step
    edge_x, edge_y, half = x + dx / 2, y + dy / 2, 0.5
    side_x, side_y = abs(dy) * half, abs(dx) * half
    return [(x, y), (edge_x - side_x, edge_y - side_y), (edge_x + side_x, edge_y + side_y)]


def _draw_arrows(axes: Axes, grid: Grid, probabilities: Array) -> None:
    """Draw an arrow for every probable action: the longer, the more probable."""
    cells = np.array([cell for cell in grid.open_cells() if cell not in grid.targets])
    chosen, actions = np.nonzero(probabilities[cells[:, 0] - 1, cells[:, 1] - 1] > _LEAST_PROBABLE)
    cells, steps = cells[chosen], np.array([action.step for action in Action])[actions]
    lengths = steps * probabilities[cells[:, 0] - 1, cells[:, 1] - 1, actions][:, None]
    axes.quiver(*(cells + 0.26 * steps).T, *lengths.T, pivot="mid", angles="xy", scale_units="xy", scale=2.5,
                units="xy", width=0.07, headwidth=3.2, headlength=3.2, headaxislength=2.8, minlength=0.0, zorder=3,
                color=_ARROW, edgecolor="white", linewidth=0.5)  # fmt: skip
