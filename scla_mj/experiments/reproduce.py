"""Experiments from their settings to the report: run what is missing, then write it. The catalogue's, or your own."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from scla_mj.checked import check
from scla_mj.errors import SclaError
from scla_mj.experiments.campaign import Watch, campaign, run_jobs
from scla_mj.experiments.catalogue import CATALOGUE, Experiment
from scla_mj.experiments.report import write_report


def reproduce(
    experiments: Sequence[Experiment],
    out: Path | str,
    *,
    workers: int | None = None,
    watch: Watch = lambda done, total, job: None,
    command: str | None = None,
) -> Path:
    """Run every seed of the experiments that `out` does not hold yet, and write the report there; return its page.

    The runs take up to `workers` processes, by default one per processor; their number changes no bit of any result.
    The report covers these experiments and what else of the catalogue `out` holds. Interrupted, the same call resumes.

    Args:
        experiments: from `CATALOGUE`, or your own under names that it does not have.
        out: the folder for runs and report; made if need be.
        workers: runs in parallel.
        watch: is called with the number of finished runs, of all runs, and the last one finished: None at first.
        command: the command line that the report names as its origin.

    Raises:
        SclaError: an experiment cannot be run as it is, or `out` is in use, cannot be written, or holds other runs;
            or, once all else is done and reported, a run in it is in use by another process or damaged.
    """
    _check(experiments)
    out = Path(out)
    return campaign(
        experiments,
        out,
        run=lambda jobs, done: run_jobs(jobs, workers=workers or os.cpu_count() or 1, watch=done),
        write=lambda: write_report(out, experiments, command=command),
        watch=watch,
    )


def _check(experiments: Sequence[Experiment]) -> None:
    ours = {experiment.name: experiment for experiment in CATALOGUE}
    known = ours.keys() | {experiment.name for experiment in experiments}
    for name, count in Counter(experiment.name for experiment in experiments).items():
        if count > 1:
            raise SclaError(f"{count} experiments are named {name}: give each a name of its own")
    for experiment in experiments:
        check(experiment.config)
        full, config = ours.get(experiment.name, experiment), experiment.config
        if experiment != full.at_scale(experiment.seeds, config.epochs, config.decisions):
            raise SclaError(f"{experiment.name} is an experiment of the catalogue: choose another name for your own")
        rivals = [rival for target in experiment.targets for rival in target.rivals]
        for name in (*rivals, *([experiment.baseline] if experiment.baseline else [])):
            if name not in known:
                raise SclaError(f"{experiment.name} is compared with {name}, which is not an experiment")
