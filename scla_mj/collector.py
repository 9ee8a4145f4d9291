"""Raises the GC threshold during start-up, which allocates hundreds of thousands of objects that stay alive."""

from __future__ import annotations

import gc
from typing import Final

_OBJECTS: Final = 50_000
"""Python's default of 700 causes a thousand collections while numba, MuJoCo and Rerun load: a tenth of the start-up."""


def collect_rarely() -> None:
    """Let this process's garbage wait for longer: for a process that is ours alone, which a library's is not."""
    _, middle, old = gc.get_threshold()
    gc.set_threshold(_OBJECTS, middle, old)
