"""Who runs a sweep: Dask, on this machine alone or under a scheduler that the user has started."""

from __future__ import annotations

import contextlib
import functools
import logging
import signal
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from distributed import Client, Future, KilledWorker, LocalCluster, WorkerPlugin, as_completed

from scla_mj.config import RunConfig
from scla_mj.engine.interrupts import HANGUP
from scla_mj.engine.lock import InUseError
from scla_mj.errors import SclaError
from scla_mj.experiments.campaign import Job
from scla_mj.experiments.workers import ignoring_the_terminal

_CONNECT_S: Final = 10.0
"""How long a scheduler may take to answer."""
_START_S: Final = 60.0
"""How long our own may take, on a machine that has much else to do."""
_IN_USE_S: Final = 1.0
"""Between two looks at a run that another process is making, such as a worker that its scheduler has given up."""
_DEATHS: Final = 10
"""Of a run's workers, on this machine; each time it goes on from its checkpoint. One that fills the memory ends so."""

_LOG: Final = logging.getLogger(__name__)


def run_jobs(
    jobs: Sequence[Job],
    *,
    workers: int,
    scheduler: str | None,
    checkpoint_period_s: float,
    watch: Callable[[Job], None],
) -> list[SclaError]:
    """Run the jobs on Dask; `watch` is called with each one that is done.

    What was interrupted is resumed, here or elsewhere. A run that another process is making is waited for.

    Returns:
        Why runs are not done, one error per run. The others are.

    Raises:
        SclaError: the scheduler does not answer, or has gone.
    """
    if not jobs:
        return []
    refusals, waited = list[SclaError](), set[Path]()
    with _client(scheduler, min(workers, len(jobs))) as client:
        pending: dict[Future, Job] = {}

        def ask(job: Job, *, later: int = 0) -> Future:
            how = {"key": f"{job.experiment.name}-{uuid.uuid4().hex}", "pure": False, "priority": -later}
            future = client.submit(_run, job.config, job.folder.absolute(), _versions(), checkpoint_period_s, **how)
            pending[future] = job
            return future

        finished = as_completed([ask(job) for job in jobs], loop=client.loop)
        for asked, future in enumerate(finished):
            job = pending.pop(future)
            error = None if future.status == "finished" else _error(future, job)
            if isinstance(error, InUseError):
                if job.folder not in waited:
                    _LOG.info("another process is making %s: waiting for it", job.folder)
                waited.add(job.folder)
                finished.add(ask(job, later=asked + 1))
            elif error is not None:
                refusals.append(error)
            else:
                watch(job)
    return refusals


def _error(future: Future, job: Job) -> SclaError:
    """Return why a run is not done.

    Raises:
        SclaError: the scheduler has gone, and with it all that it had been asked for.
        Exception: it is a mistake in the program.
    """
    if future.cancelled() or future.status == "lost":
        raise SclaError("the scheduler has gone: start it and the same command again, which resumes what is missing")
    error = future.exception()
    match error:
        case SclaError():
            return error
        case KilledWorker():
            return SclaError(
                f"{job.folder} lost its worker too often, perhaps for lack of memory: the same command again resumes it"
            )
        case ImportError() | OSError():  # of a worker whose environment or disk is not this one's
            return SclaError(f"{job.folder} cannot be made by a worker: {type(error).__name__}: {error}")
    raise error


def _run(config: RunConfig, folder: Path, versions: dict[str, str], checkpoint_period_s: float) -> None:
    """Make a run in the process of a worker."""
    from scla_mj.engine.ensure import ensure

    here = _versions()
    changed = [f"{name} {here[name]} (here {version})" for name, version in versions.items() if here[name] != version]
    if changed:
        raise SclaError(f"a worker has {', '.join(changed)}: give all workers the same environment")
    try:
        ensure(config, folder, checkpoint_period_s=checkpoint_period_s)
    except InUseError:
        time.sleep(_IN_USE_S)
        raise


@functools.cache
def _versions() -> dict[str, str]:
    """Return the versions of what decides a run's bits."""
    from scla_mj.runs.folder import MAKERS, package_versions

    versions = package_versions()
    return {name: versions[name] for name in MAKERS}


class _Client(Client):  # type: ignore[misc]
    """A client that gives up on whoever takes its call and never answers."""

    def start(self, *, timeout: float, **how: Any) -> None:
        """Connect, in `timeout` seconds at most."""
        try:
            super().start(timeout=timeout, callback_timeout=timeout, **how)
        except BaseException:
            with contextlib.suppress(TimeoutError):
                self.close()  # else its finaliser does, whenever: it waits for ever in a thread that has Dask's lock
            raise


@contextlib.contextmanager
def _client(scheduler: str | None, workers: int) -> Iterator[Client]:
    with _quiet(), contextlib.ExitStack() as stack:
        if scheduler is None:
            with ignoring_the_terminal():
                cluster = stack.enter_context(_local(workers))
        try:
            limit_s = _CONNECT_S if scheduler else _START_S
            client = stack.enter_context(_Client(scheduler or cluster, timeout=limit_s, set_as_default=False))
        except (OSError, ValueError, TypeError) as error:
            if scheduler is None:
                raise SclaError(f"Dask has not started within {limit_s:g} s: try again when less runs here") from error
            raise SclaError(
                f"no scheduler answers at --scheduler {scheduler} within {limit_s:g} s: give the address that "
                "`dask scheduler` prints, such as tcp://192.168.0.5:8786"
            ) from error
        if scheduler is None:
            client.register_plugin(_IgnoringTheTerminal())
        elif not client.scheduler_info()["workers"]:
            _LOG.info("the scheduler at %s has no workers yet: waiting for them", scheduler)
        if client.dashboard_link and (scheduler or find_spec("bokeh")):
            _LOG.info("Dask's dashboard: %s", client.dashboard_link)
        yield client


def _local(workers: int) -> LocalCluster:
    """Return workers on this machine: reached over loopback only, with keys that only this command's processes have."""
    return LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        host="127.0.0.1",
        dashboard_address="127.0.0.1:0",
        security=True,
        memory_limit=None,
        silence_logs=logging.CRITICAL,
        scheduler_kwargs={"allowed_failures": _DEATHS},
    )


class _IgnoringTheTerminal(WorkerPlugin):  # type: ignore[misc]
    """Ctrl-C, which a terminal sends to every process, is for the command alone: it ends the workers."""

    def setup(self, worker: Any) -> None:
        """Ignore it in this worker, also in one that takes a killed one's place."""
        for number in (signal.SIGINT, HANGUP):
            signal.signal(number, signal.SIG_IGN)


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep Dask's log off the terminal: what concerns the user becomes a sentence."""
    log = logging.getLogger("distributed")
    before = log.level
    log.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        log.setLevel(before)
