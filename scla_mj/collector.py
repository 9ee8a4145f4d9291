"""When Python looks for garbage: not while a start makes hundreds of thousands of objects that are there to stay."""

from __future__ import annotations

import gc
from typing import Final

_OBJECTS: Final = 50_000
"""Python's own 700 make it look a thousand times while numba, MuJoCo and Rerun load: a tenth of a start."""


def collect_rarely() -> None:
    """Let this process's garbage wait for longer: for a process that is ours alone, which a library's is not."""
    _, middle, old = gc.get_threshold()
    gc.set_threshold(_OBJECTS, middle, old)
