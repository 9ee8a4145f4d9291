"""Environment variables that would decide what a run does, or keep it from running: hidden from the libraries."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable, Iterator
from typing import Any, Final

from scla_mj.errors import SclaError

_DECIDING: Final = (
    "ARROW_",
    "MATPLOTLIBRC",
    "MPLBACKEND",
    "MUJOCO_GL",
    "NPY_",
    "NUMBA_",
    "NUMPY_",
    "OTEL_",
    "PYDANTIC_",
    "PYGLFW_",
    "PYOPENGL_",
    "PYTHON_TYRO_",
    "RERUN",
    "RUST_",
    "SCIPY_",
    "SOURCE_DATE_EPOCH",
    "TELEMETRY_",
    "_RERUN",
)
"""What the names begin with that our libraries read, some of them as they are imported."""
_OF_THE_USER: Final = ("NUMBA_CACHE_DIR", "NUMBA_CPU_", "NUMBA_NUM_THREADS")
"""Except these: where compiled code is kept and for which processor, which changes no bit of a run."""


def hide_all() -> None:
    """Remove them from this process, and so from those that it starts."""
    for name in _found(_DECIDING):
        if not name.startswith(_OF_THE_USER):
            del os.environ[name]


def has_display() -> bool:
    """Return whether windows can be opened, as far as the environment tells."""
    return not sys.platform.startswith("linux") or any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))


def require_display(what: str, instead: str = "") -> None:
    """Refuse `what` opens a window where there is none; `instead` is what to do.

    Raises:
        SclaError: there is no display.
    """
    if not has_display():
        raise SclaError(f"{what} needs a display, and there is none{instead and f': {instead}'}")


@contextlib.contextmanager
def hidden(*prefixes: str) -> Iterator[None]:
    """Hide the variables whose names begin so from the libraries that are called in this block."""
    before = {name: os.environ.pop(name) for name in _found(prefixes)}
    try:
        yield
    finally:
        os.environ.update(before)


def with_or_without(variable: str, load: Callable[[], Any]) -> Any:
    """Return what `load` imports, as an environment variable asks or, where that cannot be, as if it were not set."""
    try:
        return load()
    except Exception:  # of any kind: libraries of OpenGL and backends of matplotlib raise what they like
        if not _found((variable,)):
            raise
        with hidden(variable):
            return load()


def _found(prefixes: tuple[str, ...]) -> list[str]:
    return [name for name in os.environ if name.startswith(prefixes)]
