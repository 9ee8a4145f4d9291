"""Many runs in parallel: every experiment with every seed; an interrupted campaign can be resumed."""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Callable, Sequence
from concurrent.futures import as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Final, NamedTuple

from scla_mj.config import RunConfig
from scla_mj.errors import SclaError
from scla_mj.experiments.catalogue import Experiment
from scla_mj.experiments.workers import ignoring_sigint, pool
from scla_mj.paths import SUMMARY_JSON

_UNFINISHED: Final = ".part"


class Job(NamedTuple):
    """One run of a campaign and where it goes."""

    experiment: Experiment
    config: RunConfig
    folder: Path


def run_folder(out: Path, experiment: Experiment, seed: int) -> Path:
    """Return where a campaign keeps one run."""
    return out / "runs" / experiment.name / f"seed-{seed:02d}"


def open_jobs(out: Path, experiments: Sequence[Experiment]) -> list[Job]:
    """Return the runs that `out` does not hold yet.

    Raises:
        SclaError: a run that is there was made with other settings.
    """
    jobs = []
    for experiment in experiments:
        for seed in experiment.seeds:
            config = dataclasses.replace(experiment.config, seed=seed)
            folder = run_folder(out, experiment, seed)
            if not (folder / SUMMARY_JSON).exists():
                jobs.append(Job(experiment, config, folder))
            else:
                _check_same(folder, config)
    return jobs


def run_jobs(jobs: Sequence[Job], *, workers: int, watch: Callable[[Job], None]) -> None:
    """Run the jobs on that many processes; `watch` is called with each one that is done.

    A run's bits depend on its configuration alone, so neither the number of processes nor the order matters. An
    interrupted run leaves a folder that ends in `.part`; the next call resumes it, or where that cannot be, starts
    it anew.

    Raises:
        SclaError: a run cannot be carried out or written, or its process was killed.
    """
    try:
        with pool(workers) as executor:
            with ignoring_sigint():
                pending = {executor.submit(_run, job.config, job.folder): job for job in jobs}
            for future in as_completed(pending):
                future.result()
                watch(pending[future])
    except BrokenProcessPool as error:
        raise SclaError(
            "a run's process was killed, perhaps for lack of memory: start the command again and it resumes"
        ) from error


def _run(config: RunConfig, folder: Path) -> None:
    from scla_mj.engine.rollout import rollout  # each process imports the simulators for itself

    unfinished = folder.with_name(folder.name + _UNFINISHED)
    try:
        if not _gone_on(unfinished, config):
            if unfinished.exists():
                shutil.rmtree(unfinished)
            rollout(config, unfinished, pictures=False)
        unfinished.rename(folder)
    except OSError as error:
        why = error.strerror or error
        raise SclaError(
            f"cannot make {folder} out of {unfinished}: {why}; move them away or choose another OUT"
        ) from error


def _gone_on(unfinished: Path, config: RunConfig) -> bool:
    """Resume an interrupted run; return whether that was possible. Its bits are the same either way."""
    from scla_mj.engine.resume import resume
    from scla_mj.runs.folder import open_run

    try:
        if not unfinished.exists() or open_run(unfinished).config != config:
            return False
        resume(unfinished, pictures=False)
    except SclaError:
        return False
    return True


def _check_same(folder: Path, config: RunConfig) -> None:
    from scla_mj.runs.folder import open_run

    if open_run(folder).config != config:
        raise SclaError(f"{folder} holds a run with other settings: choose another OUT or move that one away")
