"""Rerun's viewer in a process of its own: opened on a recording's files, or fed with one that still grows.

A run knows nothing of its viewers, and opens no port: whoever follows it reads its files, and touches a mark next to
them; for as long as that happens the run's recorder writes every second, instead of every thousand decisions.
"""

from __future__ import annotations

import contextlib
import logging
import math
import os
import re
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import IO, Any, Final

from scla_mj import paths
from scla_mj.environment import hidden, require_display
from scla_mj.telemetry.reading.frames import HEADER_BYTES, whole_bytes

_LOG: Final = logging.getLogger(__name__)
_LOOK_EVERY_S: Final = 0.1
_WRITE_EVERY_S: Final = 1.0
"""Some 250 decisions: shorter columns make a larger file."""
_MARK_HOLDS_S: Final = 10.0
"""A viewer that has taken nothing for so long needs nothing soon."""
_PORT: Final = re.compile(rb"Listening for gRPC connections on 127\.0\.0\.1:(\d+)")
_PATIENCE: Final = 60
"""Seconds, at least, for which a viewer is asked to follow."""
_CHUNK_BYTES: Final = 1 << 20


def open_files(parts: Sequence[Path]) -> int:
    """Open a recording's files in Rerun's viewer, and return its exit code once it is closed.

    Raises:
        SclaError: there is no display.
    """
    return _start(*parts).wait()


def follow(folder: Path, is_over: Callable[[], bool]) -> int:
    """Open a run's recording in Rerun's viewer as it grows, which stays at its newest decision; return as `open_files`.

    Raises:
        SclaError: there is no display.
    """
    viewer = _start("-", stdin=subprocess.PIPE, stderr=subprocess.PIPE)
    assert viewer.stdin is not None and viewer.stderr is not None
    threading.Thread(target=_keep_at_the_end, args=(viewer.stderr,), daemon=True).start()
    with contextlib.suppress(BrokenPipeError), viewer.stdin:
        feed(folder, viewer.stdin, lambda: viewer.poll() is not None or is_over())
        if viewer.poll() is None:
            _LOG.info("%s is over; the viewer stays open until you close it", folder)
    return viewer.wait()


def _start(*words: str | Path, **how: Any) -> subprocess.Popen[bytes]:
    """Start the viewer on files, or on its standard input ("-"); it listens on 127.0.0.1 alone."""
    require_display("Rerun's viewer", "`scla-mj render` needs none")
    # Standard input takes one thread for itself; with two cores Rerun has no other, and stands still.
    how_to = ("--bind", "127.0.0.1", "--port", "auto", "--threads", str(max(4, os.cpu_count() or 1)))
    with hidden("RERUN", "_RERUN"):
        return subprocess.Popen([sys.executable, "-m", "rerun", *how_to, *map(str, words)], **how)


def feed(folder: Path, viewer: IO[bytes], is_over: Callable[[], bool]) -> None:
    """Write a run's recording to a viewer as it grows, part after part, until the run `is_over` and all is written.

    A viewer that has closed its end gets no more. What a killed run has left of its last frame is left out.
    """
    written: dict[Path, int] = {}
    with contextlib.suppress(BrokenPipeError):
        while True:
            over = is_over()
            for part in paths.recordings(folder):
                start = written.get(part) or (HEADER_BYTES if any(written.values()) else 0)  # one header is enough
                written[part] = _copy_frames(part, start, viewer)
            if over:
                break
            with contextlib.suppress(OSError):  # a folder that only its run may write to
                (folder / paths.WATCHED).touch()
            time.sleep(_LOOK_EVERY_S)
    with contextlib.suppress(OSError):
        (folder / paths.WATCHED).unlink()


def _keep_at_the_end(log: IO[bytes]) -> None:
    """Read what the viewer logs, which names its port, and let it follow what comes: a recording opens at its start."""
    with log:
        for line in log:
            if port := _PORT.search(line):
                threading.Thread(target=_let_follow, args=(int(port[1]),), daemon=True).start()


def _let_follow(port: int) -> None:
    from rerun.experimental import ViewerClient

    for _ in range(_PATIENCE):
        with contextlib.suppress(Exception):  # it starts, or draws
            ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy").set_time(play_state="following")
            return
        time.sleep(1.0)


def _copy_frames(part: Path, position: int, viewer: IO[bytes]) -> int:
    """Write a file's whole frames from `position` on, and return where they end."""
    with part.open("rb") as file:
        end = whole_bytes(file, position, closed=False)
        file.seek(position)
        while position < end:
            viewer.write(chunk := file.read(min(_CHUNK_BYTES, end - position)))
            position += len(chunk)
    viewer.flush()
    return end


class Watched:
    """Says when a run that somebody follows shall write what it has."""

    def __init__(self, folder: Path) -> None:
        self._mark, self._touched = folder / paths.WATCHED, 0
        self._look_at_s, self._until_s = -math.inf, -math.inf

    def wants_more(self) -> bool:
        """Return whether a second has passed, and a viewer waits."""
        now_s = time.monotonic()
        if now_s < self._look_at_s:
            return False
        self._look_at_s = now_s + _WRITE_EVERY_S
        try:
            touched = self._mark.stat().st_mtime_ns
        except OSError:
            return False
        if touched != self._touched:  # its clock may be another machine's
            self._touched, self._until_s = touched, now_s + _MARK_HOLDS_S
        return now_s < self._until_s
