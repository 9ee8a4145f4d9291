"""The one exception that the user is meant to read."""

import errno
from typing import Final

_FULL: Final = (errno.ENOSPC, errno.EDQUOT)


class SclaError(Exception):
    """An error that the user can correct: one sentence says what was wrong and what would be right.

    The command line prints it and exits with code 2; a library user catches it like any other exception.
    """


def remedy(error: OSError, *, folder: str) -> str:
    """Return what helps where `folder`, RUN or OUT, cannot be written to: room on a full disk, else another place."""
    return "free the disk" if error.errno in _FULL else f"choose another {folder}, one that can be written to"
