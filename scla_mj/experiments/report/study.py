"""What OUT holds of each experiment, read back from its run folders; what is missing is kept by name."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from scla_mj.config import RunConfig
from scla_mj.errors import SclaError
from scla_mj.experiments import statistics
from scla_mj.experiments.campaign import run_folder
from scla_mj.experiments.experiment import Experiment
from scla_mj.experiments.report.coverage import in_catalogue
from scla_mj.experiments.report.evidence import BLOCK_DECISIONS, Array, Evidence, SeedRun
from scla_mj.grid import PROTOCOLS
from scla_mj.paths import BRAIN_NPZ, CONFIG_JSON, DECISIONS_PARQUET, SUMMARY_JSON
from scla_mj.runs.brain import read_brain
from scla_mj.runs.decisions import NONE, read_decisions
from scla_mj.runs.folder import open_run
from scla_mj.runs.seal import check_seal
from scla_mj.runs.summary import read_summary

_EARLY_DECISIONS: Final = 2000


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

    def by_world(self, items: Sequence[Evidence]) -> list[list[Evidence]]:
        """Return the experiments that differ in their brain alone together, in the order of their first ones."""
        found: dict[str, list[Evidence]] = {}
        for item in items:
            world = dataclasses.replace(item.experiment.config, brain=RunConfig.brain, brain_settings={})
            found.setdefault(repr(world), []).append(item)
        return list(found.values())

    def by_form(self, *names: str) -> dict[str, list[Evidence]]:
        """Return the measured experiments of some groups by the name of their brain."""
        found: dict[str, list[Evidence]] = {}
        for item in self.group(*names):
            found.setdefault(item.experiment.config.brain, []).append(item)
        return found

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

    def of_brains(self, *brains: str) -> list[Evidence]:
        """Return the paper's own measured experiments with these brains, in the brains' order within each protocol."""
        own = {(item.experiment.config.protocol, item.experiment.config.brain): item
               for item in reversed(self.group("paper"))}  # fmt: skip
        pairs = ((protocol, brain) for protocol in reversed(PROTOCOLS) for brain in brains)
        return [own[pair] for pair in pairs if pair in own]

    def with_brain(self, item: Evidence, brain: str) -> Evidence | None:
        """Return the measured experiment that differs from `item` in its brain alone."""
        config = dataclasses.replace(item.experiment.config, brain=brain, brain_settings={})
        return next((other for other in self.evidence if other.runs and other.experiment.config == config), None)

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
    run = open_run(folder)
    if run.config != config:
        raise SclaError("made with other settings")
    summary = read_summary(folder)
    done = sum(epoch.decisions for epoch in summary.epochs)
    if done != config.epochs * config.decisions or len(summary.epochs) != config.epochs:
        raise SclaError(f"unfinished: {done} of {config.epochs * config.decisions} decisions")
    table = read_decisions(folder)
    hits = table["hit"].to_numpy()
    ceilings = np.array([epoch.ceiling_hits_per_1000 for epoch in summary.epochs])
    mastery = statistics.decisions_to_mastery(hits, ceilings[table["epoch"].to_numpy() - 1])
    advised, decided = (table[name].to_numpy() for name in ("advised", "action"))
    drawn, early = advised != NONE, _blocks(hits[:_EARLY_DECISIONS])
    relayed = int((advised == decided)[drawn].sum())
    projections = () if run.anatomy is None else run.anatomy.projections
    return SeedRun(summary, read_brain(folder).probabilities, mastery, early, int(drawn.sum()), relayed, projections)


def _blocks(hits: NDArray[np.bool_]) -> Array:
    """Return hits per 1000 in every whole block, or in all there is if that is less than one."""
    size = min(BLOCK_DECISIONS, len(hits))
    whole = hits[: len(hits) // size * size]
    return np.asarray(1000.0 * whole.reshape(-1, size).mean(axis=1))
