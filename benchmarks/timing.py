"""Contenders in turn, in CPU time of this process, and the median of each: noise of the machine falls on all alike."""

from __future__ import annotations

import itertools
import statistics
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final, NamedTuple

TURN: Final = 25
"""Decisions in a turn: a tenth of a second, and machines that change their speed do so more slowly."""

_ENDED: Final = object()

Watch = Callable[[], object]


class Contender(NamedTuple):
    """What is timed, `work`, given what `prepare` returns, which is not timed.

    Work that is a generator is done in turns, each up to the next item: contenders that have turns take them in step.
    """

    prepare: Callable[[], Any]
    work: Callable[[Any], object]


def nothing() -> None:
    """Prepare nothing."""


def median_cpu_s(contenders: Mapping[str, Contender], *, repetitions: int, watch: Watch) -> dict[str, float]:
    """Return each contender's median CPU seconds over interleaved repetitions.

    `watch` is called after each repetition. One repetition more is run first, which warms caches and compilers up and
    is not counted.
    """
    samples: dict[str, list[float]] = {name: [] for name in contenders}
    for repetition in range(repetitions + 1):
        spent = spent_s(contenders)
        for name, cpu_s in spent.items():
            if repetition:
                samples[name].append(cpu_s)
        watch()
    return {name: statistics.median(values) for name, values in samples.items()}


def turns(decisions: Iterator[object]) -> Iterator[None]:
    """Go through decisions, and stop after every `TURN` of them."""
    for number, _ in enumerate(decisions, 1):
        if number % TURN == 0:
            yield


def paced(run: Callable[[Callable[..., None]], object]) -> Iterator[None]:
    """Call `run` with a watch that it calls after every decision, in a thread that stands still after every `TURN`.

    A thread, since a function that calls its watch cannot pause in the middle by itself.
    """
    go, ready, decisions = threading.Semaphore(0), threading.Semaphore(0), itertools.count(1)
    failures: list[BaseException] = []
    abandoned = False

    def watch(*_: object) -> None:
        if next(decisions) % TURN == 0:
            ready.release()
            go.acquire()
            if abandoned:
                raise InterruptedError

    def work() -> None:
        go.acquire()
        try:
            run(watch)
        except BaseException as error:
            failures.append(error)
        finally:
            ended.set()
            ready.release()

    ended = threading.Event()
    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    try:
        while not ended.is_set():
            go.release()
            ready.acquire()
            if failures:
                raise failures[0]
            yield
    finally:
        abandoned = True
        go.release()
        thread.join()


def spent_s(contenders: Mapping[str, Contender]) -> dict[str, float]:
    """Let every contender do its work once, in turn; return the CPU seconds of each."""
    spent = dict.fromkeys(contenders, 0.0)
    at_work: dict[str, Iterator[object]] = {}
    for name, contender in contenders.items():
        prepared = contender.prepare()
        started_s = time.process_time()
        work = contender.work(prepared)
        spent[name] += time.process_time() - started_s
        if isinstance(work, Iterator):
            at_work[name] = work
    while at_work:
        for name, work in list(at_work.items()):
            started_s = time.process_time()
            if next(work, _ENDED) is _ENDED:
                del at_work[name]
            spent[name] += time.process_time() - started_s
    return spent
