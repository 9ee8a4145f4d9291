"""A folder for one campaign, or one run, at a time; the system releases it however the process ends."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

from filelock import FileLock, Timeout

from scla_mj.errors import SclaError
from scla_mj.paths import LOCK
from scla_mj.runs.atomic import is_still, writing


class InUseError(SclaError):
    """Another process holds the folder: its end releases it."""


@contextlib.contextmanager
def exclusive(out: Path) -> Iterator[None]:
    """Make the folder `out` and hold it for a campaign.

    Raises:
        SclaError: another process holds it, or it cannot be written to.
    """
    with writing(out, folder="OUT"):
        out.mkdir(parents=True, exist_ok=True)
    with _held(out, "OUT", "is in use by another reproduce or sweep: wait for its end or choose another OUT"):
        yield


@contextlib.contextmanager
def running(run: Path) -> Iterator[None]:
    """Hold a run's folder.

    Raises:
        InUseError: another process runs it.
        SclaError: it cannot be written to.
    """
    with _held(run, "RUN", "is in use: another process is running it; wait for its end"):
        held = (run / LOCK).stat()
        try:
            yield
        finally:
            with contextlib.suppress(OSError):
                if is_still(run / LOCK, held):  # not that of a run which has taken this one's place
                    (run / LOCK).unlink()


def is_in_use(run: Path) -> bool:
    """Return whether another process runs a run."""
    if not (run / LOCK).exists():
        return False
    lock = FileLock(run / LOCK, blocking=False)
    try:
        with lock:
            return False
    except Timeout:
        return True
    except (NotImplementedError, OSError):  # it cannot be told
        return False


@contextlib.contextmanager
def _held(folder: Path, what: str, refusal: str) -> Iterator[None]:
    lock = FileLock(folder / LOCK, blocking=False)
    try:
        lock.acquire()
    except Timeout as error:
        raise InUseError(f"{folder} {refusal}") from error
    except NotImplementedError:
        yield  # a file system without locks: better to run unguarded than not at all
        return
    except OSError:
        with writing(folder, folder=what):
            raise
    try:
        yield
    finally:
        lock.release()
