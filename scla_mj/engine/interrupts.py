"""Ctrl-C and SIGTERM: one orderly stop for both, and never in the middle of a decision."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any, Final

_STOPPING: Final = (signal.SIGINT, signal.SIGTERM)


class Terminated(KeyboardInterrupt):
    """SIGTERM, where `terminable` listens to it: what ends on Ctrl-C ends on it in the same way."""


@contextlib.contextmanager
def terminable() -> Iterator[None]:
    """Turn SIGTERM into `Terminated` in this block; a thread other than the main one can take no signals."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, _terminate)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextlib.contextmanager
def held_back() -> Iterator[Callable[[], None]]:
    """Hold Ctrl-C and SIGTERM back until the yielded function is called or the block ends; a second one acts at once.

    Only what Python would handle is held back: a signal that is ignored, or left to the system, stays so.
    """
    pending: list[int] = []
    before: dict[int, Callable[[int, FrameType | None], Any]] = {}

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)

    def hold(number: int, frame: FrameType | None) -> None:
        restore()
        pending.append(number)

    def let_through() -> None:
        if pending:
            number = pending.pop()
            before[number](number, None)

    if threading.current_thread() is threading.main_thread():
        before |= {number: handler for number in _STOPPING if callable(handler := signal.getsignal(number))}
        for number in before:
            signal.signal(number, hold)
    try:
        yield let_through
        let_through()
    finally:
        restore()


def _terminate(number: int, frame: FrameType | None) -> None:
    raise Terminated
