"""Ctrl-C, SIGTERM and SIGHUP: one orderly stop for all, and never in the middle of a decision."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any, Final

HANGUP: Final = getattr(signal, "SIGHUP", signal.SIGTERM)
"""A closed terminal; Windows has none."""
_STOPPING: Final = tuple(dict.fromkeys((signal.SIGINT, signal.SIGTERM, HANGUP)))


class Terminated(KeyboardInterrupt):
    """SIGTERM or SIGHUP, its one argument: what ends on Ctrl-C ends on it in the same way."""


@contextlib.contextmanager
def terminable() -> Iterator[None]:
    """Turn Ctrl-C, SIGTERM and SIGHUP into `KeyboardInterrupt` in this block, those that are not ignored (`nohup`).

    A thread other than the main one can take no signals.
    """
    before: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():
        found = {number: signal.getsignal(number) for number in _STOPPING}
        before = {number: how for number, how in found.items() if callable(how) or how == signal.SIG_DFL}
    for number in before:
        signal.signal(number, _stop)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def held_back() -> Iterator[Callable[[], None]]:
    """Hold these signals back until the yielded function is called or the block ends; a second one acts at once.

    Only what Python would handle is held back: a signal that is ignored, or left to the system, stays so. A second
    SIGHUP does nothing: a shell and the system each send one as a terminal closes.
    """
    pending: list[int] = []
    before: dict[int, Callable[[int, FrameType | None], Any]] = {}

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)

    def hold(number: int, frame: FrameType | None) -> None:
        if number == HANGUP:
            _leave_terminal()
        if number != HANGUP or not pending:
            restore()
            if HANGUP in before:
                signal.signal(HANGUP, hold)
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


def _leave_terminal() -> None:
    """Write no more to a terminal that has closed: the error would end what is to end in order."""
    for descriptor in (1, 2):
        try:
            os.write(descriptor, b"")
        except OSError:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, descriptor)
            os.close(nowhere)


def _stop(number: int, frame: FrameType | None) -> None:
    if number == HANGUP:
        _leave_terminal()
    raise KeyboardInterrupt if number == signal.SIGINT else Terminated(number)
