"""A folder for one campaign at a time."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Final

from scla_mj.errors import SclaError

LOCK: Final = ".lock"


@contextlib.contextmanager
def exclusive(out: Path) -> Iterator[None]:
    """Make the folder `out` and hold it; the system lets go of it however the process ends.

    Raises:
        SclaError: another process holds it, or it cannot be written to.
    """
    with contextlib.ExitStack() as stack:
        try:
            out.mkdir(parents=True, exist_ok=True)
            file = stack.enter_context((out / LOCK).open("ab"))
        except OSError as error:
            raise SclaError(f"cannot write into {out}: {error.strerror or error}; choose another OUT") from error
        if not _taken(file):
            raise SclaError(f"{out} is in use by another reproduce: wait for its end or choose another OUT")
        yield


if sys.platform == "win32":
    import msvcrt

    def _taken(file: IO[bytes]) -> bool:
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
