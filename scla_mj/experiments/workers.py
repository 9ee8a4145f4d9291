"""A pool of processes that never outlives its parent, and that only the parent ends."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing.connection import Connection

from scla_mj.engine.interrupts import HANGUP


@contextlib.contextmanager
def pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool; leaving the block by an exception ends its processes at once, whatever they were doing.

    Every process listens on a pipe whose other end only the parent holds: that end closes with the block, or with the
    parent's death.
    """
    # Fresh processes: a fork would copy locks that MuJoCo's and numba's threads may hold.
    context = multiprocessing.get_context("spawn")
    listening, held = context.Pipe(duplex=False)
    with listening, held, ProcessPoolExecutor(workers, context, _end_with_parent, (listening,)) as executor:
        try:
            yield executor
        except BaseException:
            executor.shutdown(wait=False, cancel_futures=True)
            held.close()
            raise


@contextlib.contextmanager
def ignoring_the_terminal() -> Iterator[None]:
    """Processes started in this block ignore what a terminal sends to all, Ctrl-C and its closing: the parent ends
    them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, signal.SIG_IGN) for number in (signal.SIGINT, HANGUP)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _end_with_parent(listening: Connection) -> None:
    threading.Thread(target=_wait_for_the_end, args=(listening,), daemon=True).start()


def _wait_for_the_end(listening: Connection) -> None:
    with contextlib.suppress(EOFError, OSError):
        listening.recv_bytes()
    os._exit(1)
