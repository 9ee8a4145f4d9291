"""What several chapters need: settings, spans and scales in words, measured cells, curves and their rows."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from scla_mj.anatomy import PROJECTIONS
from scla_mj.experiments import statistics
from scla_mj.experiments.catalogue.experiment import Experiment
from scla_mj.experiments.report import charts
from scla_mj.experiments.report.evidence import Array, Evidence, estimate, generator
from scla_mj.experiments.report.tables import Cell, Figure, Interval, Row, number

INTERVAL: Final = f"{100 * statistics.CONFIDENCE:.0f} % interval"


def span_text(first: int, last: int) -> str:
    """Return epochs as a table prints them."""
    return str(first) if first == last else f"{first}–{last}"


def seeds_text(seeds: Sequence[int]) -> str:
    """Return how many seeds and which."""
    ordered = sorted(seeds)
    gapless = len(ordered) > 1 and ordered == list(range(ordered[0], ordered[-1] + 1))
    listed = f"{ordered[0]} to {ordered[-1]}" if gapless else ", ".join(map(str, ordered))
    return f"{len(ordered)} seed{'s' if len(ordered) != 1 else ''} ({listed})"


def setting(*items: Evidence) -> str:
    """Return the sentence that ends a caption: protocol, ceiling, seeds, epochs; a range where they differ."""
    epochs = _several([item.epochs for item in items])
    decisions = _several([item.experiment.config.decisions for item in items])
    seeds = list(dict.fromkeys(seeds_text(item.seeds) for item in items))
    return (
        f"Protocol {_protocols(items)}, in hits per 1000 decisions; {' or '.join(seeds)}; "
        f"{epochs} epoch{'s' if epochs != '1' else ''} of {decisions} decisions."
    )


def _protocols(items: Sequence[Evidence]) -> str:
    """Return the protocols, each with its own ceilings."""
    ceilings: dict[str, list[float]] = {}
    for item in items:
        ceilings.setdefault(item.experiment.config.protocol, []).extend(item.ceilings.tolist())
    return " and ".join(f"{name} (ceiling {_several(own, '{:.2f}')})" for name, own in ceilings.items())


def scale_text(experiments: Sequence[Experiment]) -> str:
    """Return the scale of some experiments in words: seeds, epochs and decisions, a range where they differ."""
    measures: tuple[Callable[[Experiment], int], ...] = (
        lambda experiment: len(experiment.seeds),
        lambda experiment: experiment.config.epochs,
        lambda experiment: experiment.config.decisions,
    )
    seeds, epochs, decisions = (
        _several([measure(each) for each in experiments]).replace(" and ", " or ") for measure in measures
    )
    seed, epoch = ("" if count == "1" else "s" for count in (seeds, epochs))
    return f"{seeds} seed{seed} and {epochs} epoch{epoch} of {decisions} decisions"


def _several(values: Sequence[float], form: str = "{}") -> str:
    distinct = list(dict.fromkeys(form.format(value) for value in sorted(values)))
    return " and ".join(distinct) if len(distinct) < 3 else f"{distinct[0]} to {distinct[-1]}"


def measured(values: Array) -> tuple[Cell, Cell]:
    """Return a mean over seeds and its interval as two cells."""
    mean = estimate(values)
    return mean.mean, None if math.isnan(mean.low) else Interval(mean.low, mean.high)


def mean_with_interval(values: Array, decimals: int) -> str:
    """Return a mean over seeds and its interval in words."""
    mean = estimate(values)
    middle, low, high = (number(value, decimals) for value in mean[:3])
    return middle if math.isnan(mean.low) else f"{middle} ({INTERVAL} {low} to {high})"


def mastery_cells(item: Evidence) -> tuple[Cell, Cell]:
    """Return the median decision at which the seeds reached mastery (None if half never did), and how many did.

    Both are None for runs that are shorter than the window over which mastery is measured.
    """
    if item.experiment.config.epochs * item.experiment.config.decisions < statistics.WINDOW_DECISIONS:
        return None, None
    reached = sorted(math.inf if run.mastery is None else float(run.mastery) for run in item.runs)
    count, half = sum(map(math.isfinite, reached)), len(reached) // 2
    known = math.isfinite(reached[half])  # the upper of the middle two, where their mean is the median
    return float(np.median(reached)) if known else None, f"{count} of {len(reached)}"


def epoch_numbers(*items: Evidence) -> Array:
    """Return 1, 2, ... for every epoch of the longest."""
    return np.arange(1.0, max(item.epochs for item in items) + 1.0)


def hits_line(item: Evidence, series: int, *, percent: bool = False) -> charts.Line:
    """Return an experiment's learning curve, in hits per 1000 or in percent of ceiling."""
    curve = statistics.learning_curve(item.percent if percent else item.hits, rng=generator())
    return charts.Line(item.experiment.title, series, epoch_numbers(item), curve)


def curves_figure(
    key: str, lines: Sequence[charts.Line], levels: Sequence[charts.Level], quantity: str, *items: Evidence, **axes: Any
) -> Figure:
    """Return a chart of curves with their rows: series, epoch (or `x_label`), mean, interval."""
    rows = [row for line in lines for row in line_rows(line.label, line.x, line.curve)]
    columns = {"series": None, axes.get("x_label", "epoch"): 0, quantity: 2, INTERVAL: 2}
    y_label = quantity if quantity.startswith("percent") else f"{quantity} decisions"
    return Figure(key, columns, rows, setting(*items), chart=charts.curves(lines, levels, y_label=y_label, **axes))


def line_rows(label: str, x: Array, curve: statistics.Curve) -> list[Row]:
    """Return a curve as rows."""
    points = zip(x, *curve, strict=True)
    return [(label, int(at), float(mean), Interval(float(low), float(high))) for at, mean, low, high in points]


def weights_figure(item: Evidence) -> Figure:
    """Return the mean weights of an experiment with synapses, over its epochs."""
    assert item.weights is not None
    curve, x = statistics.learning_curve(item.weights, rng=generator()), epoch_numbers(item)
    rows: list[Row] = []
    for index, projection in enumerate(PROJECTIONS):
        own = statistics.Curve(*(values[:, index] for values in curve))
        rows += line_rows(projection.name.replace("to", " → "), x, own)
    chart = charts.weights(x, curve, weight_max=item.experiment.config.network.weight_max)
    columns = {"series": None, "epoch": 0, "mean weight (mV)": 2, INTERVAL: 2}
    return Figure(f"weights-{item.experiment.name}", columns, rows, setting(item), chart=chart)
