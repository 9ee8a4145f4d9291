"""Compiles the drive in parallel with the network in the first run on a machine, where compiling takes seconds.

numba compiles one function at a time in a process, so a second process compiles the loop of control periods, and what
reads the network's weights, into the cache that both share, while this one compiles the network itself. It is started
only where nothing is cached yet, and `join` waits for it before the first drive. Whatever becomes of it, what the cache
lacks is compiled here.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import subprocess
import sys
from pathlib import Path
from typing import Any, Final

from scla_mj.brain.network.network import Network
from scla_mj.checked import check
from scla_mj.collector import collect_rarely
from scla_mj.config import RunConfig
from scla_mj.loop.drive import Driver
from scla_mj.world.world import World

_PATIENCE_S: Final = 30.0
"""Ten times what it takes; after that this process compiles for itself."""


class CompiledAhead:
    """A second process that compiles into the cache of one compiled function, if there is anything to gain from it."""

    def __init__(self, compiled: Any) -> None:
        """`compiled` is the function whose cache is to be filled: the loop of control periods."""
        self._child: subprocess.Popen[bytes] | None = None
        if (os.cpu_count() or 1) > 1 and sys.executable and not _is_cached(compiled):
            # -P: what lies in the working directory is not for us to import.
            with contextlib.suppress(OSError):
                self._child = subprocess.Popen(
                    [sys.executable, "-P", "-m", "scla_mj.engine.compile_ahead"],
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                )
                atexit.register(self.join)

    @property
    def is_running(self) -> bool:
        """Whether there is a second process to wait for."""
        return self._child is not None

    def join(self) -> None:
        """Wait until the second process has ended; a second call does nothing."""
        if self._child is None:
            return
        try:
            self._child.wait(_PATIENCE_S)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()
        finally:
            atexit.unregister(self.join)
            self._child = None


def _is_cached(compiled: Any) -> bool:
    """Return whether a function needs no compiling here: numba keeps its machine code, or can keep none."""
    folder = compiled.stats.cache_path
    return folder is None or any(Path(folder).glob(f"*.{compiled.__name__}-*.nbc"))


def compile_here() -> None:
    """Have all this compiled, or taken from the cache, by driving a robot nowhere and reading a network's weights."""
    checked = check(RunConfig())
    Driver(World(checked.grid(), checked.clock), checked.clock, checked.config.controller).hold(1)
    network = Network()
    network.mean_weights()
    _ = network.weights


if __name__ == "__main__":
    collect_rarely()
    compile_here()
