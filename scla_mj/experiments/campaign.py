"""Many runs in parallel: every experiment with every seed; an interrupted campaign can be resumed."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from concurrent.futures import as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import NamedTuple

from scla_mj.checked import check
from scla_mj.config import RunConfig
from scla_mj.engine.lock import exclusive
from scla_mj.errors import SclaError
from scla_mj.experiments.catalogue import Experiment
from scla_mj.experiments.workers import ignoring_the_terminal, pool
from scla_mj.runs.atomic import is_still


class Job(NamedTuple):
    """One run of a campaign and where it goes."""

    experiment: Experiment
    config: RunConfig
    folder: Path


Watch = Callable[[int, int, Job | None], None]


def campaign(
    experiments: Sequence[Experiment],
    out: Path,
    *,
    run: Callable[[Sequence[Job], Callable[[Job], None]], list[SclaError]],
    write: Callable[[], Path],
    watch: Watch,
) -> Path:
    """Run what `out` lacks, then write what came out of it; return what `write` does, the path of its page or table.

    Args:
        experiments: what to run, with every seed of each.
        out: the folder, made if need be and held meanwhile.
        run: carries out jobs, calls its second argument with each one that is done, and returns why others are not.
        write: is called once all jobs are done or refused.
        watch: is called with the number of finished runs, of all runs, and the last one finished: None at first.

    Raises:
        SclaError: `out` is in use, cannot be written, or holds other runs; or, once all else is done and written, a run
            in it is not complete.
    """
    with exclusive(out):
        place, jobs = out.stat(), open_jobs(out, experiments)
        watch(0, len(jobs), None)
        finished = iter(range(1, len(jobs) + 1))
        refusals = run(jobs, lambda job: watch(next(finished), len(jobs), job))
        if not is_still(out, place):
            raise SclaError(f"{out} was moved or removed while its runs were made: start again with where it is now")
        try:
            written = write()
        except SclaError as error:
            raise (refusals or [error])[0] from error  # why there is nothing to write, if that is known
    if refusals:
        raise SclaError(
            f"{len(refusals)} of {len(jobs)} runs are not complete, and {written} leaves them out: {refusals[0]}"
        )
    return written


def run_folder(out: Path, experiment: Experiment, seed: int) -> Path:
    """Return where a campaign keeps one run."""
    return out / "runs" / experiment.name / f"seed-{seed:02d}"


def open_jobs(out: Path, experiments: Sequence[Experiment]) -> list[Job]:
    """Return the runs that `out` does not hold whole.

    Raises:
        SclaError: a run that is there was made with other settings.
    """
    from scla_mj.engine.ensure import OtherSettingsError, holds

    jobs = []
    for experiment in experiments:
        for seed in experiment.seeds:
            config = check(dataclasses.replace(experiment.config, seed=seed)).config
            folder = run_folder(out, experiment, seed)
            try:
                whole = holds(folder, config)
            except OtherSettingsError:
                raise
            except SclaError:
                whole = False  # it is damaged, which is told once the others are done
            if not whole:
                jobs.append(Job(experiment, config, folder))
    return jobs


def run_jobs(jobs: Sequence[Job], *, workers: int, watch: Callable[[Job], None]) -> list[SclaError]:
    """Run the jobs on that many processes; `watch` is called with each one that is done.

    A run's bits depend on its configuration alone, so neither the number of processes nor the order matters. The next
    call resumes what was interrupted.

    Returns:
        Why runs are not done, one error per run: it is in use by another process, damaged, or cannot be carried out
        or written. The others are.

    Raises:
        SclaError: a run's process was killed.
    """
    refusals = []
    try:
        with pool(workers) as executor:
            with ignoring_the_terminal():
                pending = {executor.submit(_run, job.config, job.folder): job for job in jobs}
            for future in as_completed(pending):
                try:
                    future.result()
                except SclaError as refusal:
                    refusals.append(refusal)
                else:
                    watch(pending[future])
    except BrokenProcessPool as error:
        raise SclaError(
            "a run's process was killed, perhaps for lack of memory: start the command again and it resumes"
        ) from error
    return refusals


def _run(config: RunConfig, folder: Path) -> None:
    from scla_mj.engine.ensure import ensure  # each process imports the simulators for itself

    ensure(config, folder)
