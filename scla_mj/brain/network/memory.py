"""Where arrays lie that a loop walks through together: apart from one another as far as the processor's caches look.

A processor first compares the last 12 bits of addresses. Of arrays whose places differ by whole pages it takes a load
from one for a load of what was just stored to another, and waits; a network ms then costs up to a third more, or not,
as the memory happens to be handed out.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

PAGE_BYTES: Final = 4096
STAGGER_BYTES: Final = 576
"""Seven arrays share a page at this distance; each begins with a cache line (64 bytes), as the widest loads want."""


def placed(arrays: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Return copies in one piece of memory, each beginning `STAGGER_BYTES` further into a page than the one before."""
    offsets, end = [], 0
    for number, array in enumerate(arrays.values()):
        wanted = number * STAGGER_BYTES % PAGE_BYTES
        end += (wanted - end) % PAGE_BYTES
        offsets.append(end)
        end += array.nbytes
    memory = np.empty(end + PAGE_BYTES, np.uint8)
    start = -memory.ctypes.data % PAGE_BYTES
    copies = {}
    for (name, array), offset in zip(arrays.items(), offsets, strict=True):
        place = memory[start + offset : start + offset + array.nbytes]
        copies[name] = place.view(array.dtype).reshape(array.shape)
        copies[name][...] = array
    return copies
