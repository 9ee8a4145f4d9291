"""MuJoCo's own viewer: a window that a thread of its own draws."""

from __future__ import annotations

import atexit
import threading
from collections.abc import Callable
from typing import Any, Final

from scla_mj.environment import require_display
from scla_mj.errors import SclaError
from scla_mj.world.opengl import opens_windows

_PATIENCE_S: Final = 10.0


def open_window(model: Any, data: Any, what: str, instead: str) -> tuple[Any, Callable[[], None]]:
    """Open the viewer on a model and its data; return its handle, and what closes it and waits for its thread.

    A thread that still draws as Python ends would end it with a crash, so this one is closed before that in any case.

    Raises:
        SclaError: `what` needs a display, and there is none; `instead` is what to do.
    """
    require_display(what, instead)
    if not opens_windows():  # MuJoCo would end the process
        raise SclaError(f"{what} needs a display, and the one that is named cannot be opened: {instead}")
    from mujoco import viewer

    before = set(threading.enumerate())
    shown = viewer.launch_passive(model, data, show_left_ui=False, show_right_ui=False)
    threads = set(threading.enumerate()) - before

    def close() -> None:
        shown.close()
        for thread in threads:
            thread.join(_PATIENCE_S)
        atexit.unregister(close)

    atexit.register(close)
    return shown, close
