"""What an experiment's finished runs show: hits, skill and weights of every seed and epoch."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import PROJECTION_NAMES, Projection
from scla_mj.checked import CheckedConfig, check
from scla_mj.disturbances import DisturbanceConfig
from scla_mj.experiments import statistics
from scla_mj.experiments.experiment import Experiment
from scla_mj.experiments.report.coverage import is_reduced
from scla_mj.experiments.report.tables import span_text
from scla_mj.grid import Grid
from scla_mj.runs.summary import Summary

Array = NDArray[np.float64]
BLOCK_DECISIONS: Final = 100
"""Decisions in a block of a run's beginning: fine enough to see a first epoch learn."""


class SeedRun(NamedTuple):
    """What the report wants of one finished run."""

    summary: Summary
    probabilities: Array | None
    mastery: int | None
    early: Array
    """Hits per 1000 in each block of the run's first decisions."""
    advised: int
    """Decisions in which an automaton's draw drove its motor population."""
    relayed: int
    """Those of them in which the network decided as the automaton had drawn."""
    projections: tuple[Projection, ...]
    """Of its brain's anatomy."""


class Stretch(NamedTuple):
    """Some epochs of an experiment: every seed's means over them (seeds,)."""

    epochs: str
    """As a table prints them."""
    hits: Array
    percent: Array
    above_chance: Array
    """Percent of the way from chance to the ceiling."""
    nearer: Array
    """Percent of the moves that came nearer to the target."""
    regret: Array
    """Moves beyond the shortest path per episode; infinite where nothing was hit."""

    @property
    def moves_per_hit(self) -> float:
        """Mean over seeds; infinite if one never hit."""
        return float(statistics.moves_per_hit(self.hits).mean())


class Weights(NamedTuple):
    """The worst of some epochs in mV, for every seed (seeds,)."""

    gap: Array
    """Least difference between the means of agreeing and of opposite projections."""
    least: Array
    """Least mean of a projection."""
    most: Array
    """Greatest mean of a projection."""


@dataclass(frozen=True)
class Evidence:
    """An experiment with its finished runs; arrays are (seeds, epochs) unless said otherwise."""

    experiment: Experiment
    runs: tuple[SeedRun, ...]
    gaps: dict[int, str]
    """Why the report goes without a seed's run, by seed."""

    @property
    def reduced(self) -> bool:
        """Whether it is at another scale than the catalogue's."""
        return is_reduced(self.experiment)

    @property
    def brain(self) -> tuple[str, str]:
        """What the experiment has in common with those of the same brain in other worlds."""
        return self.experiment.config.brain, str(self.experiment.config.brain_settings)

    @property
    def epochs(self) -> int:
        """Epochs of a run."""
        return self.experiment.config.epochs

    @cached_property
    def checked(self) -> CheckedConfig:
        """The configuration with what follows from it."""
        return check(self.experiment.config)

    @property
    def last_grid(self) -> Grid:
        """The grid of the last epoch."""
        return self.checked.grid(self.epochs)

    @property
    def jump_epoch(self) -> int:
        """The epoch in which the target jumps, 0 if it stays or the run ends before."""
        epoch = self.experiment.config.task.jump_epoch
        return epoch if 0 < epoch <= self.epochs else 0

    @property
    def crossed_epoch(self) -> int:
        """The epoch from which the wheels are crossed, 0 for never."""
        return self.experiment.config.task.crossed_epoch

    @property
    def body(self) -> str | None:
        """What is special about the body, as a name: crossed wheels, disturbances, its own sensors; None if nothing."""
        config = self.experiment.config
        if self.crossed_epoch:
            return f"crossed-{self.crossed_epoch}"
        plain = config.disturbance == DisturbanceConfig() and config.localisation == "truth"
        return None if plain else "disturbed"

    @property
    def obstructed(self) -> bool:
        """Whether actions go astray or cells are closed."""
        config = self.experiment.config
        return bool(config.task.action_noise or config.grid.closed_cells)

    @property
    def seeds(self) -> tuple[int, ...]:
        """Seeds of the finished runs."""
        return tuple(run.summary.seed for run in self.runs)

    @cached_property
    def hits(self) -> Array:
        """Hits per 1000 decisions."""
        return np.array([[epoch.hits_per_1000 for epoch in run.summary.epochs] for run in self.runs])

    @cached_property
    def ceilings(self) -> Array:
        """The ceiling of every epoch (epochs,), in hits per 1000 decisions."""
        return np.array([epoch.ceiling_hits_per_1000 for epoch in self.runs[0].summary.epochs])

    @cached_property
    def chances(self) -> Array:
        """What chance earns in every epoch (epochs,), in hits per 1000 decisions."""
        return np.array([self.checked.chance_hits_per_1000(epoch) for epoch in range(1, self.epochs + 1)])

    @cached_property
    def percent(self) -> Array:
        """Percent of each epoch's ceiling."""
        return statistics.percent_of_ceiling(self.hits, self.ceilings)

    def over(self, first: int, last: int) -> Stretch:
        """Return the epochs `first` to `last`, from 1 and inclusive."""
        above = statistics.percent_above_chance(self.hits, self.chances, self.ceilings)
        rates, percent, above = (
            statistics.span_means(values, first, last) for values in (self.hits, self.percent, above)
        )
        decisions, hits, nearer, beyond = self._counts[:, first - 1 : last].sum(axis=1).T
        regret = np.divide(beyond, hits, out=np.full(len(hits), np.inf), where=hits > 0)
        return Stretch(span_text(first, last), rates, percent, above, 100.0 * nearer / decisions, regret)

    @cached_property
    def _counts(self) -> Array:
        """Decisions, hits, moves nearer and moves beyond (seeds, epochs, 4)."""
        rows = [[(own.decisions, own.hits, own.moves_nearer, own.moves_beyond) for own in run.summary.epochs]
                for run in self.runs]  # fmt: skip
        return np.array(rows, dtype=np.float64)

    @property
    def changed_epoch(self) -> int:
        """The epoch in which the target jumps or the wheels are crossed, 1 if nothing changes during the run."""
        return max(self.jump_epoch, self.crossed_epoch, 1)

    def settled_within(self, last: int) -> tuple[int, int]:
        """Return the last two thirds of `last` epochs; after a jump or a crossing, those from the second one on."""
        first = statistics.settled_span(last)[0]
        return min(max(first, self.changed_epoch + 1 if self.changed_epoch > 1 else 1), last), last

    @cached_property
    def settled(self) -> Stretch:
        """The epochs of `settled_within` all that there are."""
        return self.over(*self.settled_within(self.epochs))

    @cached_property
    def early(self) -> Array:
        """Hits per 1000 in every block of `BLOCK_DECISIONS` of the first decisions (seeds, blocks)."""
        return np.array([run.early for run in self.runs])

    @property
    def early_decisions(self) -> Array:
        """The decision that ends each block of `early` (blocks,)."""
        size = min(BLOCK_DECISIONS, self.experiment.config.epochs * self.experiment.config.decisions)
        return size * np.arange(1.0, self.early.shape[1] + 1.0)

    @property
    def projections(self) -> tuple[Projection, ...]:
        """The runs' own, in the order of their mean weights."""
        return self.runs[0].projections

    @property
    def papers(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Which projections are the paper's agreeing and which its opposite ones, (projections,) each."""
        known = np.array([p.name in PROJECTION_NAMES for p in self.projections], bool)
        dashed = np.array([p.dashed for p in self.projections], bool)
        return known & ~dashed, known & dashed

    @cached_property
    def weights(self) -> Array | None:
        """Mean weights at the epochs' ends (seeds, epochs, projections), or None for a brain without synapses."""
        rows = [[epoch.mean_weights for epoch in run.summary.epochs] for run in self.runs]
        if any(means is None for row in rows for means in row):
            return None
        return np.array(rows, dtype=np.float64).reshape(len(rows), -1, len(self.projections))

    def weights_over(self, first: int, last: int) -> Weights | None:
        """Return the extremes of the mean weights at the ends of the epochs, or None for a brain without synapses."""
        if self.weights is None:
            return None
        means = self.weights[:, first - 1 : last]
        agreeing, opposite = self.papers
        gaps = means[..., agreeing].mean(axis=2) - means[..., opposite].mean(axis=2)
        return Weights(gaps.min(axis=1), means.min(axis=(1, 2)), means.max(axis=(1, 2)))

    @cached_property
    def probabilities(self) -> Array | None:
        """Action probabilities (W, H, 4) at the end, mean over seeds, or None for a brain without automata."""
        known = [run.probabilities for run in self.runs if run.probabilities is not None]
        return np.mean(known, axis=0) if len(known) == len(self.runs) > 0 else None
