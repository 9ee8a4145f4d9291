"""A folder for one campaign, or one run, at a time; the system lets go of it however the process ends."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Final

from scla_mj.errors import SclaError
from scla_mj.paths import CONFIG_JSON
from scla_mj.runs.atomic import cannot_write

LOCK: Final = ".lock"


@contextlib.contextmanager
def exclusive(out: Path) -> Iterator[None]:
    """Make the folder `out` and hold it.

    Raises:
        SclaError: another process holds it, or it cannot be written to.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
        file = (out / LOCK).open("ab")
    except OSError as error:
        raise SclaError(f"cannot write into {out}: {error.strerror or error}; choose another OUT") from error
    with file:
        if not _taken(file):
            raise SclaError(f"{out} is in use by another reproduce: wait for its end or choose another OUT")
        yield


@contextlib.contextmanager
def running(run: Path) -> Iterator[None]:
    """Hold a run folder, by the `config.json` that is in it.

    Raises:
        SclaError: another process runs it, or it cannot be written to.
    """
    try:
        file = (run / CONFIG_JSON).open("rb+")
    except OSError as error:
        raise cannot_write(run / CONFIG_JSON, error) from error
    with file:
        if not _taken(file):
            raise SclaError(f"{run} is in use: another process is running it; wait for its end")
        yield


if sys.platform == "win32":
    import msvcrt

    _LOCKED_BYTE: Final = 2**30  # a lock keeps others from reading what it covers: this one covers nothing

    def _taken(file: IO[bytes]) -> bool:
        file.seek(_LOCKED_BYTE)
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        return True
else:
    import fcntl

    def _taken(file: IO[bytes]) -> bool:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError:
            return True  # a file system without locks: better to run unguarded than not at all
        return True
