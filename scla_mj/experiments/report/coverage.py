"""What a report covers: the experiments asked for and whatever else of the catalogue lies in OUT, at which scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from scla_mj.config import RunConfig
from scla_mj.errors import SclaError
from scla_mj.experiments.campaign import run_folder
from scla_mj.experiments.catalogue import CATALOGUE, Experiment
from scla_mj.paths import CHECKPOINT_NPZ, SUMMARY_JSON
from scla_mj.runs.folder import open_run

_BY_NAME: Final = {experiment.name: experiment for experiment in CATALOGUE}


def in_catalogue(experiment: Experiment) -> Experiment | None:
    """Return the catalogue's experiment of that name, at the scale at which its targets are judged."""
    return _BY_NAME.get(experiment.name)


def is_reduced(experiment: Experiment) -> bool:
    """Return whether the catalogue has that experiment with other seeds, epochs or decisions."""
    full = in_catalogue(experiment)
    return full is not None and _scale(full) != _scale(experiment)


def covered(out: Path, asked: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """Return the experiments of the report: those asked for, with all of their seeds that `out` holds, and the others.

    An experiment of the catalogue that was not asked for is covered if it has a finished run in `out`, at that run's
    scale. The order is the catalogue's, behind whatever is not in it.
    """
    by_name = {experiment.name: experiment for experiment in asked}
    foreign = tuple(experiment for experiment in asked if in_catalogue(experiment) is None)
    ours = [
        _with_all_seeds(out, by_name[full.name], full) if full.name in by_name else _found(out, full)
        for full in CATALOGUE
    ]
    return (*foreign, *(experiment for experiment in ours if experiment is not None))


def _scale(experiment: Experiment) -> tuple[tuple[int, ...], int, int]:
    return experiment.seeds, experiment.config.epochs, experiment.config.decisions


def _with_all_seeds(out: Path, asked: Experiment, full: Experiment) -> Experiment:
    finished = _finished(out, full)
    others = [seed for seed in finished if _held_config(out, full, seed) == replace(asked.config, seed=seed)]
    return replace(asked, seeds=tuple(sorted({*asked.seeds, *others})))


def _found(out: Path, full: Experiment) -> Experiment | None:
    finished = _finished(out, full)
    if not finished:
        return None
    held = _held_config(out, full, finished[0])
    if held is None or (held.epochs, held.decisions) == (full.config.epochs, full.config.decisions):
        return full  # a run that is damaged or has other settings is then named as missing
    return full.at_scale(finished, held.epochs, held.decisions)


def _finished(out: Path, full: Experiment) -> tuple[int, ...]:
    folders = {seed: run_folder(out, full, seed) for seed in full.seeds}
    return tuple(
        seed
        for seed, folder in folders.items()
        if (folder / SUMMARY_JSON).exists() and not (folder / CHECKPOINT_NPZ).exists()
    )


def _held_config(out: Path, experiment: Experiment, seed: int) -> RunConfig | None:
    try:
        return open_run(run_folder(out, experiment, seed)).config
    except SclaError:
        return None
