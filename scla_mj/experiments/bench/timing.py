"""Contenders in turn, in CPU time of this process, and the median of each: noise of the machine falls on all alike."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

Watch = Callable[[], object]


class Contender(NamedTuple):
    """What is timed, `work`, given what `prepare` returns, which is not timed."""

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
        for name, contender in contenders.items():
            prepared = contender.prepare()
            started_s = time.process_time()
            contender.work(prepared)
            if repetition:
                samples[name].append(time.process_time() - started_s)
        watch()
    return {name: statistics.median(values) for name, values in samples.items()}
