"""What a checkpoint vouches for of a recording: its length then, and the SHA-256 of every byte up to there.

Rerun's file sink only appends (tests/telemetry/test_growth.py), so what was on the disk once stays as it was.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import Any, Final

from scla_mj.errors import SclaError
from scla_mj.paths import CHECKPOINT_NPZ, part_number

_CHUNK_BYTES: Final = 1 << 20


class Growth:
    """Follows one part of a recording as it grows, reading every byte once."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._bytes = 0
        self._hash = hashlib.sha256()

    def sync(self) -> None:
        """Force what was appended since the last call to the disk, and take it in.

        Raises:
            OSError: the file has gone, or the disk fails.
        """
        with self._path.open("rb+") as file:
            os.fsync(file.fileno())
            file.seek(self._bytes)
            while chunk := file.read(_CHUNK_BYTES):
                self._hash.update(chunk)
                self._bytes += len(chunk)

    def state(self) -> dict[str, Any]:
        """Return the part's name, its length at the last `sync` and the digest of so many bytes."""
        return {"name": self._path.name, "bytes": self._bytes, "sha256": self._hash.hexdigest()}


def check_parts(folder: Path, parts: list[dict[str, Any]]) -> None:
    """Refuse a recording that does not begin with what its checkpoint vouches for, given as `Growth.state` returns it.

    Raises:
        SclaError: a part is missing, shorter or damaged; the sentence names it and what to do.
        ValueError: a name is not that of a part.
    """
    for part in parts:
        if part_number(part["name"]) is None:
            raise ValueError(f"{part['name']} is not part of a recording")
        path = folder / part["name"]
        fault = _fault(path, part["bytes"], part["sha256"])
        if fault is not None:
            raise SclaError(
                f"{path} {fault}: fetch a sound copy, or move it and {CHECKPOINT_NPZ} away and the run starts again "
                "from its beginning, to the same bits"
            )


def _fault(path: Path, size_bytes: int, digest: str) -> str | None:
    if not path.exists():
        return "is missing"
    if not path.is_file():
        return "is damaged, as it must be a file"
    found, left = hashlib.sha256(), size_bytes
    try:
        with path.open("rb") as file:
            while left and (chunk := file.read(min(left, _CHUNK_BYTES))):
                found.update(chunk)
                left -= len(chunk)
    except OSError as error:
        return f"cannot be read ({error.strerror or error})"
    if left:
        return f"is damaged, as it holds {size_bytes - left} bytes where its checkpoint knows {size_bytes}"
    if found.hexdigest() != digest:
        return f"is damaged, as its first {size_bytes} bytes are not those that the run wrote"
    return None
