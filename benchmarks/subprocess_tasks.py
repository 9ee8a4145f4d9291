"""`python -m benchmarks.subprocess_tasks TASK JSON`: one measurement in a separate process.

Prints a line of JSON. `first`: time to the end of the first decision; `long`: a rollout's CPU time by stretches of
decisions and the process's peak memory; `memory`: of robots, and of robots with brains. A long run with a `pace` prints
an empty line after every so many decisions, and continues when it receives one.
"""

from __future__ import annotations

import dataclasses
import json
import math
import os
import resource
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from scla_mj.checked import option
from scla_mj.collector import collect_rarely
from scla_mj.config import RunConfig
from scla_mj.validation import validated


def first_decision(config: RunConfig, started_s: float) -> dict[str, Any]:
    """Run one decision; `started_s` is the wall clock's time when the process was started."""
    from scla_mj.engine.rollout import rollout

    found: dict[str, Any] = {}

    def watch(*_: object) -> None:
        found.setdefault("wall_s", time.time() - started_s)
        found.setdefault("cpu_s", sum(os.times()[:4]))  # with the process that compiled at the same time

    with tempfile.TemporaryDirectory() as folder:
        rollout(config, Path(folder) / "run", watch=watch, pictures=False)
    return found


def long_run(config: RunConfig, stretch: int, *, pace: int) -> dict[str, Any]:
    """Run every decision; return the CPU time and the simulated time at the end of every `stretch` decisions."""
    from scla_mj.engine.rollout import rollout

    cpu_s, simulated_s, done = [], [], 0

    def watch(record: Any, _: object) -> None:
        nonlocal done
        done += 1
        if done % stretch == 0:
            cpu_s.append(time.process_time())
            simulated_s.append(record.time_s + record.move.duration_s)
        if pace and done % pace == 0:
            print(flush=True)
            sys.stdin.readline()

    with tempfile.TemporaryDirectory() as folder:
        rollout(config, Path(folder) / "run", watch=watch)
    return {"cpu_s": cpu_s, "simulated_s": simulated_s, "peak_mb": peak_mb(), "total_cpu_s": time.process_time()}


def memory(config: RunConfig, robots: int) -> dict[str, float]:
    """Return what a robot of a fleet adds to the resident memory, in MB, and one with its brain; NaN but on Linux."""
    from scla_mj.engine.build import simulate_fleet

    found, kept = {}, []
    for name, one in (("robot", dataclasses.replace(config, brain="q-learning")), ("brain", config)):
        for number in (4, robots):  # the first few load what all share
            before = resident_mb()
            kept.append(simulate_fleet(one, range(number), threads=1))
            for _ in range(3):
                kept[-1].step()
            found[name] = (resident_mb() - before) / number
    return found


def resident_mb() -> float:
    """Return this process's resident memory in MB; NaN where there is no /proc."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return math.nan
    return pages * resource.getpagesize() / 1e6


def peak_mb() -> float:
    """Return this process's peak resident memory in MB (Linux counts in KiB, macOS in bytes)."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 1e6 if sys.platform == "darwin" else peak * 1024 / 1e6


def main(task: str, argument: str) -> None:
    """Carry out one task."""
    collect_rarely()  # as the command does
    options = json.loads(argument)
    config = validated(RunConfig, options.pop("config"), spell=option)
    tasks: dict[str, Any] = {"first": first_decision, "long": long_run, "memory": memory}
    print(json.dumps(tasks[task](config, **options)))


if __name__ == "__main__":
    main(*sys.argv[1:])
