"""Decodes a whole recording in a process of its own: bad bytes can make Rerun's decoder abort the one it runs in.

Run as a file, and with nothing imported but Rerun's own library, so that it takes a third of a second.
"""

import subprocess
import sys
from pathlib import Path

_TIMEOUT_S = 600.0
"""Far longer than the largest recording takes; a damaged one must not hang the reader."""


def survives_decoding(path: Path) -> bool:
    """Return whether every chunk can be decoded, or at worst raises an error that can be caught."""
    command = [sys.executable, __file__, str(path)]
    try:
        done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=_TIMEOUT_S)
    except subprocess.TimeoutExpired:
        return False
    return done.returncode >= 0


def _decode(path: str) -> None:
    from rerun_bindings import RrdReaderInternal

    for chunk in RrdReaderInternal(path).stream(store=None):
        chunk.to_record_batch().validate(full=True)


if __name__ == "__main__":
    _decode(sys.argv[1])
