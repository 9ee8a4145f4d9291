"""The report's figures, each with the rows that it shows: learning curves, ablations, weights, maps of policies."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from matplotlib import figure as mpl
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from scla_mj.experiments import exact, statistics
from scla_mj.experiments.report.evidence import Array, Evidence
from scla_mj.experiments.report.study import Study
from scla_mj.experiments.report.tables import INTERVAL, Figure, Interval, Row
from scla_mj.experiments.report.wording import labels, setting
from scla_mj.grid import Action
from scla_mj.runs.drawing import INK, RULE, SOFT, canvas, draw_line, draw_policy, draw_weights

SERIES: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6d31", "#7a68b3")
"""Okabe and Ito 2008, distinguishable with any colour vision; without their black and yellow, with two dark hues."""
DASHES: Final = ("-", (0, (5, 1.5)), (0, (2, 1.2)), (0, (6, 1.5, 1.5, 1.5)), "-", (0, (5, 1.5)), (0, (2, 1.2)), "-")
_DOTTED: Final = (0, (1, 1.6))
_ACROSS: Final = 3
_TITLE_LETTERS: Final = 34
_LEGEND_LETTERS: Final = 52
"""Of a label that leaves room for a second column, or for the chart next to it."""


class Line(NamedTuple):
    """One curve: `series` chooses its colour and dashes; `x` (n,), its mean and band (n,)."""

    label: str
    series: int
    x: Array
    curve: statistics.Curve


class Level(NamedTuple):
    """A reference (n,) across the axes, stepwise over `x` (n,) where it changes; `text` stands at its right end."""

    text: str
    x: Array
    values: Array


def brain_curves(protocol: str, items: Sequence[Evidence], study: Study) -> tuple[Figure, Figure]:
    """Return the learning curves of brains under one protocol, and their beginnings in blocks of decisions.

    A brain has the same colour under either protocol.
    """
    brains = list(dict.fromkeys(item.brain for item in study.group("paper", "comparison")))
    series = [brains.index(item.brain) for item in items]
    early = [Line(label, index, item.early_decisions, statistics.learning_curve(item.early))
             for label, item, index in zip(labels(items), items, series, strict=True)]  # fmt: skip
    blocks = np.array([0.0, max(line.x[-1] for line in early)])
    return (
        _curves(f"curves-{protocol}", _epoch_lines(items, series), _bounds(items, _epochs(items)), items),
        _curves(f"early-{protocol}", early, _bounds(items, blocks), items, x_label="decision"),
    )


def _bounds(items: Sequence[Evidence], x: Array) -> list[Level]:
    """Return the first experiment's ceiling, its chance, and what a random walk earns where that is something else."""
    item = items[0]
    walk = exact.random_walk(item.experiment.config.protocol, item.checked.grid())
    bounds = {"ceiling": float(item.ceilings[0]), "random walk": walk}
    if not math.isclose(walk, item.chances[0]):
        bounds["chance"] = float(item.chances[0])
    return [Level(f"{name} {value:.2f}", x, np.full(len(x), value)) for name, value in bounds.items()]


def jump_curves(key: str, items: Sequence[Evidence]) -> Figure:
    """Return the learning curves of several brains whose target jumps, under the ceiling of each epoch."""
    item = max(items, key=lambda each: each.epochs)
    level = Level(f"ceiling {item.ceilings[-1]:.2f}", _epochs([item]), item.ceilings)
    marks = [(item.jump_epoch - 0.5, "the target jumps")]
    return _curves(key, _epoch_lines(items, range(len(items))), [level], items, marks=marks)


def world_curves(key: str, items: Sequence[Evidence]) -> Figure:
    """Return the learning curves of worlds, each in percent of its own ceiling."""
    x = _epochs(items)
    lines = _epoch_lines(items, range(len(items)), percent=True)
    crossed = {item.crossed_epoch for item in items if item.crossed_epoch > 1}
    marks = [(epoch - 0.5, "the wheels are crossed") for epoch in sorted(crossed)]
    level = Level("ceiling", x, np.full(len(x), 100.0))
    return _curves(key, lines, [level], items, quantity="percent of ceiling", marks=marks)


def _epochs(items: Sequence[Evidence]) -> Array:
    """Return 1, 2, ... for every epoch of the longest."""
    return np.arange(1.0, max(item.epochs for item in items) + 1.0)


def _epoch_lines(items: Sequence[Evidence], series: Sequence[int], *, percent: bool = False) -> list[Line]:
    curves = [statistics.learning_curve(item.percent if percent else item.hits) for item in items]
    return [Line(label, index, _epochs([item]), curve)
            for label, item, index, curve in zip(labels(items), items, series, curves, strict=True)]  # fmt: skip


def _curves(
    key: str,
    lines: Sequence[Line],
    levels: Sequence[Level],
    items: Sequence[Evidence],
    *,
    quantity: str = "hits per 1000",
    x_label: str = "epoch",
    marks: Sequence[tuple[float, str]] = (),
) -> Figure:
    rows = [row for line in lines for row in curve_rows(line.label, line.x, line.curve)]
    y_label = quantity if quantity.startswith("percent") else f"{quantity} decisions"
    chart = draw_curves(lines, levels, y_label=y_label, x_label=x_label, marks=marks)
    return Figure(key, {"series": None, x_label: 0, quantity: 2, INTERVAL: 2}, rows, setting(*items), chart=chart)


def curve_rows(label: str, x: Array, curve: statistics.Curve) -> list[Row]:
    """Return the rows behind a curve: its label, x, mean and interval."""
    points = zip(x, *curve, strict=True)
    return [(label, int(at), float(mean), Interval(float(low), float(high))) for at, mean, low, high in points]


def draw_curves(
    lines: Sequence[Line],
    levels: Sequence[Level],
    *,
    y_label: str,
    x_label: str = "epoch",
    marks: Sequence[tuple[float, str]] = (),
) -> mpl.Figure:
    """Draw curves with their bands over epochs, references dotted, and `marks`: upright lines (x, text).

    Over anything but epochs the x axis begins at 0.
    """
    with canvas(height_mm=80 + 2.6 * len(lines)) as (figure, grid):
        axes: Axes = grid[0, 0]
        axes.grid(axis="y")
        axes.margins(x=0.02)
        axes.xaxis.set_major_locator(MaxNLocator(nbins=12, integer=True))
        axes.set(xlabel=x_label, ylabel=y_label)
        for level in levels:
            axes.plot(level.x, level.values, color=SOFT, lw=1.0, ls=_DOTTED, drawstyle="steps-mid")
            axes.annotate(level.text, (1.0, level.values[-1]), (5, 0), xycoords=("axes fraction", "data"),
                          textcoords="offset points", va="center", fontsize=6.5, color=SOFT)  # fmt: skip
        for line in lines:
            colour, dash = SERIES[line.series % len(SERIES)], DASHES[line.series % len(DASHES)]
            draw_line(axes, line.x, line.curve, colour, dash, line.label)
        for x, text in marks:
            axes.axvline(x, color=SOFT, lw=1.0)
            axes.annotate(text, (x, 0.02), (4, 0), xycoords=("data", "axes fraction"), textcoords="offset points",
                          fontsize=6.5, color=SOFT)  # fmt: skip
        axes.set_ylim(bottom=0)
        if x_label != "epoch":
            axes.set_xlim(0.0, 1.02 * max(line.x[-1] for line in lines))
        if len(lines) > 1:
            columns = 2 if max(len(line.label) for line in lines) <= _LEGEND_LETTERS else 1
            figure.legend(loc="outside lower left", ncols=columns, handlelength=2.6)
        return figure


def ablations(key: str, items: Sequence[Evidence], study: Study) -> Figure:
    """Return every ablation's percent of ceiling when settled, and its baseline's over the same epochs."""
    rows: list[tuple[str, str, str, float, Interval, float, float]] = []
    for item in items:
        baseline = study.named(item.experiment.baseline)
        span = item.settled_within(min(item.epochs, baseline.epochs) if baseline else item.epochs)
        own, protocol = item.over(*span), item.experiment.config.protocol
        mean, low, high = statistics.estimate(own.percent)
        as_built = float(baseline.over(*span).percent.mean()) if baseline else math.nan
        chance = 100.0 * float(item.chances[-1] / item.ceilings[-1])
        rows.append((item.experiment.title, protocol, own.epochs, mean, Interval(low, high), as_built, chance))
    columns = {
        "ablation": None, "protocol": None, "epochs": None, "percent of ceiling": 2, INTERVAL: 2,
        "as built, percent of ceiling": 2, "chance, percent of ceiling": 2,
    }  # fmt: skip
    titles, protocols, _, means, ends, baselines, chances = zip(*rows, strict=True)
    named = [f"{title}, {protocol}" for title, protocol in zip(titles, protocols, strict=True)]
    shown = "with this setting: mean and 95 % interval"
    arrays = map(np.array, (means, ends, chances, baselines))
    chart = draw_dots(named, *arrays, quantity="percent of ceiling, settled", mean=shown)
    return Figure(key, columns, rows, setting(*items), chart=chart)


def draw_dots(
    labels: Sequence[str],
    values: Array,
    ends: Array,
    chances: Array,
    baselines: Array | None = None,
    *,
    quantity: str,
    mean: str,
    runs: Sequence[Array] = (),
) -> mpl.Figure:
    """Draw one row per label: percent of ceiling, its interval `ends` (n, 2), and upright lines: chance, baseline.

    `quantity` names the axis and `mean` the values; `runs` are those behind each. The axis begins at the ten percent
    below the least of all.
    """
    names = [textwrap.fill(label, _LEGEND_LETTERS, break_on_hyphens=False) for label in labels]
    lines = sum(1 + name.count("\n") for name in names)
    with canvas(height_mm=21 + 5.4 * lines) as (figure, grid):
        axes: Axes = grid[0, 0]
        rows = np.arange(len(names))
        seen = np.column_stack([values, ends, chances, *([] if baselines is None else [baselines])])
        single = np.concatenate([*runs, seen.ravel()])
        least = max(0.0, 10.0 * math.floor(float(np.nanmin(single)) / 10.0 - 0.1))
        axes.hlines(rows, least, 100, color=RULE, lw=0.7, zorder=0)
        axes.hlines(rows, *ends.T, color=SERIES[0], lw=1.7, zorder=2)
        for row, own in zip(rows, runs, strict=False):
            axes.plot(own, np.full(len(own), row), "o", color=SERIES[0], mfc="none", mew=0.6, ms=3.2, zorder=4,
                      label="" if row else "each run")  # fmt: skip
        axes.plot(values, rows, "o", color=SERIES[0], ms=4.5, zorder=3, label=mean)
        if baselines is not None:
            label = "as built, over the same epochs"
            axes.plot(baselines, rows, "|", color=SERIES[1], ms=10, mew=1.6, zorder=2, label=label)
        axes.plot(chances, rows, "|", color=SOFT, ms=10, mew=1.2, zorder=1, label="chance")
        axes.set_yticks(rows, names)
        axes.tick_params(axis="y", length=0, labelcolor=INK)
        axes.spines["left"].set_visible(False)
        axes.set_ylim(len(names) - 0.4, -0.6)
        axes.set_xlim(least, max(101.0, float(np.nanmax(single)) + 1.0))
        axes.set_xlabel(quantity)
        figure.legend(loc="outside lower left", ncols=3)
        return figure


def weights(key: str, items: Sequence[Evidence]) -> Figure:
    """Return the mean weights of experiments with synapses, next to one another, below the largest possible."""
    rows: list[Row] = []
    with canvas(height_mm=80, columns=len(items)) as (chart, grid):
        for axes, item in zip(grid.flat, items, strict=True):
            assert item.weights is not None
            curve, x = statistics.learning_curve(item.weights), _epochs([item])
            for index, projection in enumerate(item.projections):
                own = statistics.Curve(*(values[:, index] for values in curve))
                named = curve_rows(projection.name.replace("to", " → "), x, own)
                rows += [(item.experiment.title, *row) for row in named]
            draw_weights(axes, x, curve, item.projections)
            axes.axhline(item.experiment.config.network.weight_max, color=SOFT, lw=1.0, ls=_DOTTED)
            axes.xaxis.set_major_locator(MaxNLocator(nbins=12 // len(items), integer=True))
            axes.set_xlabel("epoch")
            axes.set_title(textwrap.fill(item.experiment.title, _TITLE_LETTERS), fontsize=7)
        top = max(axes.get_ylim()[1] for axes in grid.flat)
        for axes in grid.flat:
            axes.set_ylim(0.0, top)
        for axes in list(grid.flat)[:-1]:
            axes.get_legend().remove()
    columns = {"experiment": None, "series": None, "epoch": 0, "mean weight (mV)": 2, INTERVAL: 2}
    return Figure(key, columns, rows, setting(*items), chart=chart)


def policies(items: Sequence[Evidence]) -> Figure:
    """Return the maps of experiments with automata at the end of their runs, probabilities the mean over seeds."""
    height = math.ceil(len(items) / _ACROSS)
    rows: list[Row] = []
    with canvas(height_mm=14 + 63 * height, rows=height, columns=_ACROSS) as (chart, grid):
        for axes in grid.flat[len(items) :]:
            axes.set_visible(False)
        for axes, item in zip(grid.flat, items, strict=False):
            assert item.probabilities is not None
            shades = draw_policy(axes, item.last_grid, item.probabilities)
            axes.tick_params(labelsize=6)
            axes.set_title(textwrap.fill(item.experiment.title, _TITLE_LETTERS), fontsize=7)
            rows += _policy_rows(item, item.probabilities)
        chart.colorbar(shades, ax=grid[0], label="probability of an action", location="top", shrink=0.45, aspect=32)
    columns: dict[str, int | None] = {"experiment": None, "x": 0, "y": 0}
    columns |= dict.fromkeys([*(action.label for action in Action), "nearer"], 4)
    return Figure("policies", columns, rows, setting(*items), chart=chart)


def _policy_rows(item: Evidence, probabilities: Array) -> list[Row]:
    """Return every cell's action probabilities, and that of an action that brings the target one move nearer."""
    grid, rows = item.last_grid, list[Row]()
    for cell in (cell for cell in grid.open_cells() if cell not in grid.targets):
        chances = probabilities[cell.x - 1, cell.y - 1]
        good = [action for action, beyond in grid.neighbours(cell) if grid.distances[beyond] < grid.distances[cell]]
        rows.append((item.experiment.title, cell.x, cell.y, *chances.tolist(), float(chances[good].sum())))
    return rows
