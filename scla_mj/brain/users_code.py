"""Running code that is the user's own: it gets what it expects, the run stays as it was, a mistake is one sentence."""

from __future__ import annotations

import contextlib
import os
import sys
import sysconfig
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from scla_mj.errors import SclaError

_NOT_THE_USERS: Final = (
    str(Path(__file__).resolve().parents[1]),  # this package
    *(sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib")),
    "<",  # the import system, and what libraries generate
)
_MOST_CHARACTERS: Final = 300
_moved: dict[str, str] = {}
"""Where code that was called from a working directory has gone from there; it finds itself there again."""


@contextlib.contextmanager
def users_code(doing: str) -> Iterator[None]:
    """Run the block, which calls the user's code, in its own surroundings: `doing` begins the sentence on a mistake.

    It imports from the working directory, as with `python -m` (an installed command does not), and only in the block:
    nobody named what a library might find there. Its working directory and numpy's error handling are its own. A
    process that it forks ends with the block, for there is one run.

    Raises:
        SclaError: whatever is raised in the block, except `KeyboardInterrupt`.
    """
    process, home = os.getpid(), _working_directory()
    sys.path.append(home)
    try:
        _go(_moved.get(home, home))
        with np.errstate():
            yield
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        if isinstance(error, SclaError) and _users_line(error) is None:
            raise
        raise SclaError(f"{doing} {describe(error)}") from error
    finally:
        if os.getpid() != process:
            os._exit(1)
        with contextlib.suppress(ValueError):  # the last one: a script of this folder has it at the front too
            del sys.path[-1 - sys.path[::-1].index(home)]
        for name in ("stdout", "stderr"):
            if getattr(getattr(sys, name), "closed", False):  # what is still said ends nowhere
                setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115
        _moved[home] = _working_directory()
        _go(home)


def describe(error: BaseException) -> str:
    """Return an exception's type, message, and the file and line of the user's code that raised it, if known."""
    message = _printed(str, error)
    text = f"{type(error).__name__}: {message}" if message else type(error).__name__
    place = _users_line(error)
    return text if place is None or place in text else f"{text}, {place}"


def shown(got: Any) -> str:
    """Return what a user's code has answered, and its type, in a few words."""
    if isinstance(got, np.ndarray):
        return f"a {got.dtype} array of shape {got.shape}"
    text = _printed(repr, got)
    return f"{text if len(text) <= 40 else text[:37] + '...'} ({type(got).__name__})"


def _printed(how: Any, it: Any) -> str:
    try:
        text = " ".join(how(it).split())
    except Exception as error:
        return f"<its {how.__name__}() raises {type(error).__name__}>"
    return text if len(text) <= _MOST_CHARACTERS else f"{text[:_MOST_CHARACTERS]}..."


def _users_line(error: BaseException) -> str | None:
    """Return the innermost line that is neither in this package nor in a library."""
    if isinstance(error, SyntaxError) and error.filename:
        return f"{error.filename} line {error.lineno}"
    frames = [f for f in traceback.extract_tb(error.__traceback__) if not f.filename.startswith(_NOT_THE_USERS)]
    return f"{frames[-1].filename} line {frames[-1].lineno}" if frames else None


def _working_directory() -> str:
    """Return the working directory, or that it is here, where it has been removed."""
    try:
        return os.getcwd()  # noqa: PTH109 (a path object would take longer than most decisions of a table)
    except OSError:
        return os.curdir


def _go(folder: str) -> None:
    with contextlib.suppress(OSError):  # it may have been removed
        os.chdir(folder)
