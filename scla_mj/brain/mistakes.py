"""What went wrong in a user's own code, in half a sentence."""

from __future__ import annotations

import sysconfig
import traceback
from pathlib import Path
from typing import Final

_OTHERS: Final = (
    str(Path(__file__).resolve().parents[1]),  # this package
    *(sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib")),
    "<frozen",  # the import system
)


def told(error: BaseException) -> str:
    """Return an exception's type, its message, and the file and line of the user's code where it came up, if known."""
    message = " ".join(str(error).split())
    text = f"{type(error).__name__}: {message}" if message else type(error).__name__
    place = _place(error)
    return text if place is None or place in text else f"{text}, {place}"


def _place(error: BaseException) -> str | None:
    """The innermost line that is neither ours nor a library's."""
    if isinstance(error, SyntaxError) and error.filename:
        return f"{error.filename} line {error.lineno}"
    users = [frame for frame in traceback.extract_tb(error.__traceback__) if not frame.filename.startswith(_OTHERS)]
    return f"{users[-1].filename} line {users[-1].lineno}" if users else None
