"""dm_control over MuJoCo's data, and the OpenGL it loads: glfw first, which warns and cannot draw without a display."""

from __future__ import annotations

import contextlib
import ctypes.util
import os
import sys
from collections.abc import Iterator
from typing import Any, Final

from scla_mj.environment import with_or_without

_VARIABLE: Final = "MUJOCO_GL"


@contextlib.contextmanager
def _opengl_without_display() -> Iterator[None]:
    """While dm_control is imported, point it to EGL, or to none, unless there is a display or the user chose."""
    has_display = not sys.platform.startswith("linux") or "DISPLAY" in os.environ
    if has_display or _VARIABLE in os.environ:
        yield
        return
    os.environ[_VARIABLE] = "egl" if ctypes.util.find_library("EGL") else "disable"
    try:
        yield
    finally:
        del os.environ[_VARIABLE]


def make_physics(data: Any) -> Any:
    """Return a `dm_control.mujoco.Physics` of these data and of their model."""
    mujoco = dm_control()
    return mujoco.Physics(mujoco.wrapper.MjData(data))


def dm_control() -> Any:
    """Return `dm_control.mujoco`, imported so that it draws with or without a display."""
    return with_or_without(_VARIABLE, _imported)


def _imported() -> Any:
    with _opengl_without_display():
        from dm_control import mujoco

    return mujoco
