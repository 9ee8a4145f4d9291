"""OpenGL for pictures off screen: through a window where there is a display, otherwise through EGL or OSMesa."""

from __future__ import annotations

import contextlib
import ctypes.util
import importlib
import os
import sys
import warnings
from collections.abc import Iterator
from typing import Any, Final

import mujoco

from scla_mj.environment import has_display
from scla_mj.errors import SclaError
from scla_mj.world.robot import one_line

VARIABLE: Final = "MUJOCO_GL"
_PLATFORM: Final = "PYOPENGL_PLATFORM"
_REMEDY: Final = (
    "on Debian and Ubuntu `apt install libegl1 libgl1-mesa-dri` brings EGL, and `apt install libosmesa6` OSMesa, which "
    "needs no device"
)
_WITHOUT_DISPLAY: Final = {"egl": "EGL", "osmesa": "OSMesa"}
"""MuJoCo's modules, each with the system's library that it loads."""


def without_display() -> Iterator[str]:
    """Yield what can draw without a display here, the best first: "egl", "osmesa"."""
    return (name for name, library in _WITHOUT_DISPLAY.items() if ctypes.util.find_library(library))


def make_contexts(model: Any) -> tuple[Any, Any]:
    """Return an OpenGL context, current in this thread, and MuJoCo's of a model in it. MUJOCO_GL may name what draws.

    Raises:
        SclaError: nothing can draw here.
    """
    reasons = []
    for name in _choices():
        try:
            with _trying(name), contextlib.ExitStack() as undo:
                context = importlib.import_module(f"mujoco.{name}").GLContext(1, 1)
                undo.callback(context.free)
                context.make_current()
                drawing = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_150.value)
                undo.pop_all()
                return context, drawing
        except Exception as error:  # of any kind: libraries of OpenGL raise what they like
            reasons.append(f"{name}: {one_line(error)}")
    reason = "; ".join(reasons) or "neither a display nor EGL nor OSMesa is there"
    raise SclaError(f"no picture can be drawn here ({reason}): {_REMEDY}")


@contextlib.contextmanager
def _trying(name: str) -> Iterator[None]:
    """Tell MuJoCo what draws, and forget what fails: it has chosen for the process, and no other could be loaded."""
    modules, variables = set(sys.modules), {key: os.environ.get(key) for key in (VARIABLE, _PLATFORM)}
    os.environ[VARIABLE] = name
    try:
        yield
        del variables[_PLATFORM]
    except Exception:
        for own in [own for own in sys.modules if own.startswith(("OpenGL", "mujoco.")) and own not in modules]:
            del sys.modules[own]
        raise
    finally:
        for key, value in variables.items():
            os.environ.pop(key, None)
            if value is not None:
                os.environ[key] = value


def _choices() -> Iterator[str]:
    """Yield MuJoCo's modules with an OpenGL context, the best first."""
    asked = os.environ.get(VARIABLE, "").lower().strip()
    if asked in _WITHOUT_DISPLAY:
        yield asked
    elif sys.platform == "darwin":
        yield "cgl"
    if has_display() and opens_windows():
        yield "glfw"
    if sys.platform.startswith("linux"):
        yield from without_display()


def opens_windows() -> bool:
    """Return whether glfw can: a context of its without a window would end the process."""
    import glfw

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a display that is not there
        return bool(glfw.init())
