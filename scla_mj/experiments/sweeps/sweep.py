"""Many runs of any settings and seeds: what is missing is run on Dask, then the results are gathered."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from scla_mj.config import CHECKPOINT_PERIOD_S, RunConfig
from scla_mj.experiments.campaign import Watch, campaign
from scla_mj.experiments.sweeps.plan import grouped
from scla_mj.extras import need


def sweep(
    configs: Sequence[RunConfig],
    out: Path | str,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    watch: Watch = lambda done, total, job: None,
    checkpoint_period_s: float = CHECKPOINT_PERIOD_S,
) -> Path:
    """Make every run that `out` does not hold yet, and write its table and figure there; return the table's path.

    Interrupted, the same call resumes. Neither the number of workers nor a worker's death changes a bit of any run.

    Args:
        configs: one configuration per run; those that differ in their seed alone are one row of the table.
        out: the folder for the runs, under `runs/`, and for `sweep.parquet` and `sweep.png`; made if need be.
        workers: processes on this machine, by default one per processor.
        scheduler: the address of a Dask scheduler whose workers do it instead; they must see `out` under the same path.
        watch: is called with the number of finished runs, of all runs, and the last one finished: None at first.
        checkpoint_period_s: wall time between two checkpoints of a run.

    Raises:
        SclaError: Dask is not installed, a run cannot be made as it is, the scheduler does not answer or has gone, or
            `out` is in use, cannot be written, or holds other runs; or, once all else is done, a run is not complete.
    """
    need("distributed", "a sweep")
    from scla_mj.experiments.sweeps.cluster import run_jobs
    from scla_mj.experiments.sweeps.gather import write_table

    experiments, out = grouped(configs), Path(out)
    return campaign(
        experiments,
        out,
        run=lambda jobs, done: run_jobs(
            jobs,
            workers=workers or os.cpu_count() or 1,
            scheduler=scheduler,
            checkpoint_period_s=checkpoint_period_s,
            watch=done,
        ),
        write=lambda: write_table(out, experiments),
        watch=watch,
    )
