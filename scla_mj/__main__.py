"""`scla-mj`, or `python -m scla_mj`: from its first moment Ctrl-C ends it in one line, not in an import's traceback."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from types import FrameType
from typing import Final

_ENDINGS: Final = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}
_PATIENCE_S: Final = 5.0
"""What a thread gets to come to its end after the work is done."""


def main(arguments: list[str] | None = None) -> int:
    """Run the command line (see `scla_mj.cli.main`) and return its exit code."""
    for number in _ENDINGS:
        if callable(signal.getsignal(number)) or signal.getsignal(number) == signal.SIG_DFL:
            signal.signal(number, _leave)
    from scla_mj.cli.main import main as run

    code = run(arguments)
    others = [thread for thread in threading.enumerate() if not thread.daemon and thread is not threading.main_thread()]
    for thread in others:
        thread.join(_PATIENCE_S)
    if any(thread.is_alive() for thread in others):  # a user's brain started it; Python would wait for it for ever
        os._exit(code)
    return code


def _leave(number: int, frame: FrameType | None) -> None:
    """End at once: nothing is on disk, and an exception might be lost in the middle of a library's import."""
    with contextlib.suppress(OSError):
        os.write(2, f"scla-mj: {_ENDINGS[signal.Signals(number)]}\n".encode())
    os._exit(128 + number)


if __name__ == "__main__":
    sys.exit(main())
