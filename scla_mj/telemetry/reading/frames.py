"""A `.rrd` file as its frames, which a file that still grows, or was cut short, ends in the middle of."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import BinaryIO, Final

# Rerun 0.41's file: a header, then frames of kind and length (both uint64) and that many bytes.
HEADER_BYTES: Final = 12
_FRAME: Final = struct.Struct("<QQ")
_END: Final = 0
"""The kind of the frame that a recording is closed with."""


def whole_bytes(file: BinaryIO, position: int = 0, *, closed: bool = True) -> int:
    """Return where the last whole frame ends, from the `position` of an earlier one's end on; 0 for no header yet.

    `closed` says that the frame which closes a recording counts.
    """
    size = file.seek(0, 2)
    position = max(position, HEADER_BYTES)
    if size < position:
        return 0
    for kind, end in _frames(file, position):
        if end > size or (kind == _END and not closed):
            break
        position = end
    return position


def _frames(file: BinaryIO, position: int) -> Iterator[tuple[int, int]]:
    while len(head := _head(file, position)) == _FRAME.size:
        kind, length = _FRAME.unpack(head)
        position += _FRAME.size + length
        yield kind, position


def _head(file: BinaryIO, position: int) -> bytes:
    file.seek(position)
    return file.read(_FRAME.size)
