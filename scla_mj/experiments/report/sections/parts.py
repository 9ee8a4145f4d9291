"""What several chapters say in the same way: captions, spans, columns, curves."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from scla_mj.checked import check
from scla_mj.config import RunConfig
from scla_mj.experiments import statistics
from scla_mj.experiments.catalogue.experiment import Experiment
from scla_mj.experiments.report import charts
from scla_mj.experiments.report.cells import number
from scla_mj.experiments.report.document import Cell, Column, Interval
from scla_mj.experiments.report.evidence import Array, Evidence, estimate, generator
from scla_mj.markov import hits_per_1000, uniform_policy

INTERVAL: str = f"{100 * statistics.CONFIDENCE:.0f} % interval"


def span_text(first: int, last: int) -> str:
    """Return epochs in words of a table."""
    return str(first) if first == last else f"{first}–{last}"


def opening(title: str) -> str:
    """Return a title as a sentence begins."""
    return title[:1].upper() + title[1:]


def seeds_text(seeds: Sequence[int]) -> str:
    """Return how many seeds and which."""
    ordered = sorted(seeds)
    gapless = len(ordered) > 1 and ordered == list(range(ordered[0], ordered[-1] + 1))
    listed = f"{ordered[0]} to {ordered[-1]}" if gapless else ", ".join(map(str, ordered))
    return f"{len(ordered)} seed{'s' if len(ordered) != 1 else ''} ({listed})"


def setting(*items: Evidence) -> str:
    """Return the sentence that every caption ends with: protocol, ceiling, seeds, epochs; a range where they differ."""
    epochs = _several([item.epochs for item in items], "{}")
    decisions = _several([item.experiment.config.decisions for item in items], "{}")
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
    seeds, epochs, decisions = (
        _several([values[index] for values in map(_counts, experiments)], "{}").replace(" and ", " or ")
        for index in range(3)
    )
    seed, epoch = ("" if count == "1" else "s" for count in (seeds, epochs))
    return f"{seeds} seed{seed} and {epochs} epoch{epoch} of {decisions} decisions"


def _counts(experiment: Experiment) -> tuple[int, int, int]:
    return len(experiment.seeds), experiment.config.epochs, experiment.config.decisions


def _several(values: Sequence[float], form: str) -> str:
    distinct = list(dict.fromkeys(form.format(value) for value in sorted(values)))
    return " and ".join(distinct) if len(distinct) < 3 else f"{distinct[0]} to {distinct[-1]}"


def measured(values: Array) -> tuple[Cell, Cell]:
    """Return a mean over seeds and its interval as two cells."""
    mean = estimate(values)
    return mean.mean, None if math.isnan(mean.low) else Interval(mean.low, mean.high)


def mean_with_interval(values: Array, decimals: int) -> str:
    """Return a mean over seeds and its interval in words."""
    mean = estimate(values)
    if math.isnan(mean.low):
        return number(mean.mean, decimals)
    ends = f"{number(mean.low, decimals)} to {number(mean.high, decimals)}"
    return f"{number(mean.mean, decimals)} ({INTERVAL} {ends})"


def epoch_numbers(item: Evidence) -> Array:
    """Return 1, 2, ... for every epoch."""
    return np.arange(1.0, item.epochs + 1.0)


def hits_line(item: Evidence, label: str, series: int, *, percent: bool = False) -> charts.Line:
    """Return an experiment's learning curve, in hits per 1000 or in percent of ceiling."""
    colour, dash = charts.style(series)
    curve = statistics.learning_curve(item.percent if percent else item.hits, rng=generator())
    return charts.Line(label, colour, dash, epoch_numbers(item), curve)


def line_rows(lines: Sequence[charts.Line]) -> tuple[tuple[Cell, ...], ...]:
    """Return a chart's curves as rows: series, epoch, mean, interval."""
    return tuple(
        (line.label, int(x), float(mean), Interval(float(low), float(high)))
        for line in lines
        for x, mean, low, high in zip(line.x, *line.curve, strict=True)
    )


def line_columns(quantity: str) -> tuple[Column, ...]:
    """Return the columns of `line_rows`."""
    return Column("series"), Column("epoch", 0), Column(quantity, 2), Column(INTERVAL, 2)


def random_walk_hits(config: RunConfig) -> float:
    """Return what a random walk earns on a configuration's first floor, exactly."""
    grid = check(config).grid()
    return hits_per_1000(grid, config.protocol, uniform_policy(grid))


def mastery_cells(item: Evidence) -> tuple[Cell, Cell]:
    """Return the median decision at which the seeds reached mastery (None if half never did), and how many did.

    Both are None for runs that are shorter than the window over which mastery is measured.
    """
    if item.experiment.config.epochs * item.experiment.config.decisions < statistics.WINDOW_DECISIONS:
        return None, None
    reached = [math.inf if run.mastery is None else float(run.mastery) for run in item.runs]
    middle = float(np.median(np.array(reached))) if not all(math.isinf(value) for value in reached) else math.inf
    count = sum(math.isfinite(value) for value in reached)
    return None if math.isinf(middle) else middle, f"{count} of {len(reached)}"
