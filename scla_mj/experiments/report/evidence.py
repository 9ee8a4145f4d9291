"""What OUT holds of each experiment, read back from its run folders; what is missing is kept by name."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import PROJECTIONS
from scla_mj.checked import CheckedConfig, check
from scla_mj.disturbances import DisturbanceConfig
from scla_mj.errors import SclaError
from scla_mj.experiments import statistics
from scla_mj.experiments.campaign import run_folder
from scla_mj.experiments.experiment import Experiment
from scla_mj.experiments.report.coverage import in_catalogue, is_reduced
from scla_mj.experiments.report.tables import span_text
from scla_mj.grid import PROTOCOLS, Grid
from scla_mj.paths import BRAIN_NPZ, CONFIG_JSON, DECISIONS_PARQUET, SUMMARY_JSON
from scla_mj.runs.brain import read_brain
from scla_mj.runs.decisions import read_decisions
from scla_mj.runs.folder import open_run
from scla_mj.runs.seal import check_seal
from scla_mj.runs.summary import Summary, read_summary

Array = NDArray[np.float64]
BLOCK_DECISIONS: Final = 100
"""Decisions in a block of a run's beginning: fine enough to see a first epoch learn."""
_EARLY_DECISIONS: Final = 2000


class SeedRun(NamedTuple):
    """What the report wants of one finished run."""

    summary: Summary
    probabilities: Array | None
    mastery: int | None
    early: Array
    """Hits per 1000 in each block of the run's first decisions."""


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

    @cached_property
    def settled(self) -> Stretch:
        """The last two thirds of the epochs; after a jump or a crossing, the epochs from the second one on."""
        first, last = statistics.settled_span(self.epochs)
        changed = max(self.jump_epoch, self.crossed_epoch if self.crossed_epoch > 1 else 0)
        return self.over(min(max(first, changed + 1), last), last)

    @cached_property
    def early(self) -> Array:
        """Hits per 1000 in every block of `BLOCK_DECISIONS` of the first decisions (seeds, blocks)."""
        return np.array([run.early for run in self.runs])

    @property
    def early_decisions(self) -> Array:
        """The decision that ends each block of `early` (blocks,)."""
        size = min(BLOCK_DECISIONS, self.experiment.config.epochs * self.experiment.config.decisions)
        return size * np.arange(1.0, self.early.shape[1] + 1.0)

    @cached_property
    def weights(self) -> Array | None:
        """Mean weights at the epochs' ends (seeds, epochs, 8), or None for a brain without synapses."""
        rows = [[epoch.mean_weights for epoch in run.summary.epochs] for run in self.runs]
        if any(means is None for row in rows for means in row):
            return None
        return np.array(rows, dtype=np.float64).reshape(len(rows), -1, len(PROJECTIONS))

    @cached_property
    def probabilities(self) -> Array | None:
        """Action probabilities (W, H, 4) at the end, mean over seeds, or None for a brain without automata."""
        known = [run.probabilities for run in self.runs if run.probabilities is not None]
        return np.mean(known, axis=0) if len(known) == len(self.runs) > 0 else None


@dataclass(frozen=True)
class Study:
    """All experiments of a report, in its order."""

    evidence: tuple[Evidence, ...]

    def group(self, *names: str) -> list[Evidence]:
        """Return the measured experiments of some groups."""
        return [item for item in self.evidence if item.experiment.group in names and item.runs]

    def by_protocol(self, *names: str) -> list[tuple[str, list[Evidence]]]:
        """Return the measured experiments of some groups, those of each protocol together."""
        parts = [
            (protocol, [item for item in self.group(*names) if item.experiment.config.protocol == protocol])
            for protocol in PROTOCOLS
        ]
        return [(protocol, items) for protocol, items in parts if items]

    def by_body(self) -> dict[str, list[Evidence]]:
        """Return the measured worlds whose body is special, those of each body and protocol together."""
        found: dict[str, list[Evidence]] = {}
        for item in self.group("world"):
            if item.body:
                found.setdefault(f"{item.body}-{item.experiment.config.protocol}", []).append(item)
        return found

    def named(self, name: str | None) -> Evidence | None:
        """Return an experiment if it is measured."""
        return next((item for item in self.evidence if item.experiment.name == name and item.runs), None)

    def of_brain(self, brain: str, *protocols: str) -> list[Evidence]:
        """Return the paper's own experiment with a brain and each of the protocols, if it is measured."""
        own = {item.experiment.config.protocol: item for item in reversed(self.group("paper"))
               if item.experiment.config.brain == brain}  # fmt: skip
        return [own[protocol] for protocol in protocols if protocol in own]

    def in_catalogue(self, *, whole: bool = False) -> int:
        """Return how many experiments are the catalogue's; with `whole` only those at its scale."""
        own = [item for item in self.evidence if in_catalogue(item.experiment)]
        return sum(not (whole and item.reduced) for item in own)

    def gaps(self) -> list[tuple[str, list[int], str]]:
        """Return which seeds of which experiment are missing, and why."""
        return [
            (item.experiment.name, list(seeds), reason)
            for item in self.evidence
            for reason, seeds in groupby(item.gaps, key=item.gaps.__getitem__)
        ]


def gather(out: Path, experiments: Sequence[Experiment]) -> Study:
    """Read every finished run of the experiments in `out`."""
    return Study(tuple(_gather_one(out, experiment) for experiment in experiments))


def _gather_one(out: Path, experiment: Experiment) -> Evidence:
    runs, gaps = [], dict[int, str]()
    for seed in experiment.seeds:
        try:
            runs.append(_read(run_folder(out, experiment, seed), experiment, seed))
        except SclaError as reason:
            gaps[seed] = str(reason)
    return Evidence(experiment, tuple(runs), gaps)


def _read(folder: Path, experiment: Experiment, seed: int) -> SeedRun:
    """Return a finished run.

    Raises:
        SclaError: it is missing, unfinished, damaged, or was made with other settings.
    """
    if not (folder / SUMMARY_JSON).exists():
        raise SclaError("not finished" if (folder / CONFIG_JSON).exists() else "not run")
    check_seal(folder, CONFIG_JSON, SUMMARY_JSON, DECISIONS_PARQUET, BRAIN_NPZ)
    config = dataclasses.replace(experiment.config, seed=seed)
    if open_run(folder).config != config:
        raise SclaError("made with other settings")
    summary = read_summary(folder)
    done = sum(epoch.decisions for epoch in summary.epochs)
    if done != config.epochs * config.decisions or len(summary.epochs) != config.epochs:
        raise SclaError(f"unfinished: {done} of {config.epochs * config.decisions} decisions")
    table = read_decisions(folder)
    hits = table["hit"].to_numpy()
    ceilings = np.array([epoch.ceiling_hits_per_1000 for epoch in summary.epochs])
    mastery = statistics.decisions_to_mastery(hits, ceilings[table["epoch"].to_numpy() - 1])
    return SeedRun(summary, read_brain(folder).probabilities, mastery, _blocks(hits[:_EARLY_DECISIONS]))


def _blocks(hits: NDArray[np.bool_]) -> Array:
    """Return hits per 1000 in every whole block, or in all there is if that is less than one."""
    size = min(BLOCK_DECISIONS, len(hits))
    whole = hits[: len(hits) // size * size]
    return np.asarray(1000.0 * whole.reshape(-1, size).mean(axis=1))
