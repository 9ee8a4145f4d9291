"""What must be measured in a separate process: start-up, peak memory, a long run's tail, two seeds on two cores."""

from __future__ import annotations

import dataclasses
import itertools
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, Final, NamedTuple

from benchmarks.rollouts import RATIO_TARGETS, bare_stretches
from benchmarks.table import BOUND_ABOVE, Sheet, against, doubted
from benchmarks.timing import Watch
from scla_mj.config import RunConfig
from scla_mj.errors import SclaError

_COMMAND: Final = (sys.executable, "-m", "scla_mj")
_CHILD: Final = (sys.executable, "-m", "benchmarks.subprocess_tasks")
_HELP_TARGET_S: Final = 0.3
_WARM_TARGET_S: Final = 1.5
_COLD_TARGET_S: Final = 4.0
_MEMORY_TARGET_MB: Final = 50.0
_TAIL_TARGET: Final = 1.10
_SEEDS_TARGET: Final = 1.8
_STRETCH: Final = 1000
_PACE: Final = 50
"""Decisions that a long run and its bare parts take in turn: a few tenths of a second."""
_WHOLE: Final = "whole over bare parts"
SHORT_EPOCHS: Final = 3
LONG_EPOCHS: Final = 30


class Took(NamedTuple):
    """Seconds of one process, by the clock on the wall and of its CPU time."""

    wall_s: float
    cpu_s: float


def start_up(*, repetitions: int, watch: Watch) -> Sheet:
    """Time `--help`, the first decision and a whole command of one decision, each in fresh processes."""
    samples: dict[str, list[Took]] = {}
    _first_decision(None)  # fills the cache that a warm start finds
    for _ in range(repetitions):
        with tempfile.TemporaryDirectory() as folder:
            for name, took in (
                ("scla-mj --help", _run([*_COMMAND, "--help"])),
                ("first decision, warm", _first_decision(None)),
                ("first decision, cold", _first_decision(Path(folder) / "cache")),
                ("rollout of one decision", _one_decision(Path(folder) / "run")),
            ):
                samples.setdefault(name, []).append(took)
        watch()
    return _start_sheet({name: _median(tooks) for name, tooks in samples.items()})


def long_run(config: RunConfig, *, watch: Watch) -> Sheet:
    """Run 3,000 and 30,000 decisions, each in a process of its own; compare their peaks, and first and last speed.

    The 30,000 are the paper's experiment: its bare parts are replayed too, some decisions in turn.
    """
    short = _finish([_start_long(dataclasses.replace(config, epochs=SHORT_EPOCHS, decisions=_STRETCH))])[0]
    watch()
    whole = dataclasses.replace(config, epochs=LONG_EPOCHS, decisions=_STRETCH)
    replay = bare_stretches(whole, _PACE)
    bare_s = [next(replay)]  # what is replayed is recorded first
    watch()
    child = _start_long(whole, pace=_PACE)
    assert child.stdin is not None
    assert child.stdout is not None
    try:
        for _ in range(LONG_EPOCHS * _STRETCH // _PACE):
            child.stdout.readline()  # it stands still until it is answered
            bare_s.extend(itertools.islice(replay, 1))
            if child.poll() is None:
                child.stdin.write("\n")
                child.stdin.flush()
    finally:
        long = _finish([child])[0]
    watch()
    each = _STRETCH // _PACE
    return long_sheet(short, long, bare_s=[sum(bare_s[k : k + each]) for k in range(0, len(bare_s), each)])


def long_sheet(short: dict[str, Any], long: dict[str, Any], *, bare_s: Sequence[float]) -> Sheet:
    """Return the table of two long runs, as `child.long_run` reports them.

    `bare_s`: seconds of the bare parts of every stretch of the longer one.
    """
    cpu_s, simulated_s = ([b - a for a, b in pairwise(long[key])] for key in ("cpu_s", "simulated_s"))
    tail = cpu_s[-1] / cpu_s[0]
    per_simulated = tail * simulated_s[0] / simulated_s[-1]
    per_bare = tail * bare_s[1] / bare_s[-1]
    bare_total_s = sum(bare_s)
    ratio = long["total_cpu_s"] / bare_total_s
    growth_mb = long["peak_mb"] - short["peak_mb"]
    rows = (
        ("peak memory, 3,000 decisions", f"{short['peak_mb']:.0f} MB", ""),
        ("peak memory, 30,000 decisions", f"{long['peak_mb']:.0f} MB", ""),
        ("growth", f"{growth_mb:.1f} MB", against(growth_mb, _MEMORY_TARGET_MB)),
        ("decisions 1,001 to 2,000", f"{1000 * cpu_s[0] / _STRETCH:.3f} ms per decision", ""),
        ("decisions 29,001 to 30,000", f"{1000 * cpu_s[-1] / _STRETCH:.3f} ms per decision", ""),
        ("last over first", f"{tail:.3f}", against(tail, _TAIL_TARGET)),
        ("last over first, by simulated second", f"{per_simulated:.3f}", ""),
        ("last over first, each over its bare parts", f"{per_bare:.3f}", against(per_bare, _TAIL_TARGET)),
        ("bare parts of 30,000 decisions", f"{bare_total_s:.1f} s", ""),
        ("the whole process, start to end", f"{long['total_cpu_s']:.1f} s", ""),
        (_WHOLE, f"{ratio:.2f}", against(ratio, RATIO_TARGETS["light"])),
    )
    values = {
        "short_peak_mb": short["peak_mb"],
        "long_peak_mb": long["peak_mb"],
        "growth_mb": growth_mb,
        "tail": tail,
        "tail_by_simulated_second": per_simulated,
        "total_cpu_s": long["total_cpu_s"],
        "tail_over_bare_parts": per_bare,
        "bare_cpu_s": bare_total_s,
        "ratio": ratio,
    }
    table = Sheet(
        "long",
        "A long run, CPU time and memory",
        ("what", "measured", "target"),
        rows,
        "The first 1,000 decisions warm up: they compile, and the robot learns to take fewer seconds for a move. "
        f"Telemetry light, figures drawn. The bare parts take {_PACE} decisions in turn with the run, in a process of "
        "their own: a machine that changes its speed meanwhile changes it for both.",
        values,
    )
    return doubted(table, BOUND_ABOVE, row=_WHOLE) if ratio < 1 else table


def two_seeds(config: RunConfig, *, repetitions: int, watch: Watch) -> Sheet:
    """Run two seeds one after the other, then both at once, in wall-clock time."""
    configs = [dataclasses.replace(config, seed=config.seed + offset) for offset in range(2)]
    in_turn_s, at_once_s = [], []
    for _ in range(repetitions):
        started_s = time.perf_counter()
        for one in configs:
            _finish([_start_long(one)])
        in_turn_s.append(time.perf_counter() - started_s)
        started_s = time.perf_counter()
        _finish([_start_long(one) for one in configs])
        at_once_s.append(time.perf_counter() - started_s)
        watch()
    turn, once = statistics.median(in_turn_s), statistics.median(at_once_s)
    speed = turn / once
    return Sheet(
        "seeds",
        f"Two seeds of {config.epochs * config.decisions} decisions, wall-clock time",
        ("what", "s", "target"),
        (
            ("one after the other", f"{turn:.2f}", ""),
            ("both at once", f"{once:.2f}", ""),
            ("speed-up", f"{speed:.2f}", against(speed, _SEEDS_TARGET, at_least=True)),
        ),
        f"{os.cpu_count()} cores, which must be free. Processes of their own, start-up included.",
        {"in_turn_s": turn, "at_once_s": once, "speed_up": speed},
    )


def _start_sheet(medians: dict[str, Took]) -> Sheet:
    targets = dict(zip(medians, (_HELP_TARGET_S, _WARM_TARGET_S, _COLD_TARGET_S), strict=False))
    rows, values = [], dict[str, float]()
    for name, took in medians.items():
        target = against(took.wall_s, targets[name]) if name in targets else ""
        rows.append((name, f"{took.wall_s:.2f}", f"{took.cpu_s:.2f}", target))
        values |= {f"{name}, wall s": took.wall_s, f"{name}, cpu s": took.cpu_s}
    return Sheet(
        "start",
        "Start-up, from the start of the process",
        ("what", "wall s", "CPU s", "target (wall)"),
        tuple(rows),
        "Warm: compiled by an earlier process. Cold: with an empty cache of compiled code. Telemetry light; the "
        "rollout of one decision draws its figures.",
        values,
    )


def _median(tooks: Sequence[Took]) -> Took:
    return Took(*(statistics.median(values) for values in zip(*tooks, strict=True)))


def _first_decision(cache: Path | None) -> Took:
    found = ask(
        "first", {"config": dataclasses.asdict(RunConfig(epochs=1, decisions=1)), "started_s": time.time()}, cache
    )
    return Took(found["wall_s"], found["cpu_s"])


def _one_decision(run: Path) -> Took:
    return _run([*_COMMAND, "rollout", str(run), "--epochs", "1", "--decisions", "1"])


def _run(command: Sequence[str]) -> Took:
    before, started_s = os.times(), time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    wall_s, after = time.perf_counter() - started_s, os.times()
    if done.returncode:
        raise SclaError(f"{' '.join(command[1:])} ended with code {done.returncode}: {done.stderr[-500:]}")
    cpu_s = after.children_user + after.children_system - before.children_user - before.children_system
    return Took(wall_s, cpu_s)


def _start_long(config: RunConfig, *, pace: int = 0) -> subprocess.Popen[str]:
    stretch = min(_STRETCH, config.decisions)
    return _start("long", {"config": dataclasses.asdict(config), "stretch": stretch, "pace": pace}, None)


def ask(task: str, options: dict[str, Any], cache: Path | None) -> dict[str, Any]:
    """Return what a task of `subprocess_tasks` answers, in a process of its own."""
    return _finish([_start(task, options, cache)])[0]


def _start(task: str, options: dict[str, Any], cache: Path | None) -> subprocess.Popen[str]:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)} if cache is not None else dict(os.environ)
    command = [*_CHILD, task, json.dumps(options)]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, env=environment)


def _finish(children: Sequence[subprocess.Popen[str]]) -> list[dict[str, Any]]:
    """Wait for all; whatever goes wrong, none is left behind."""
    answers = []
    try:
        for child in children:
            output, complaint = child.communicate()
            if child.returncode:
                raise SclaError(f"a process of the bench ended with code {child.returncode}: {complaint[-500:]}")
            answers.append(json.loads(output.splitlines()[-1]))
    finally:
        for child in children:
            if child.poll() is None:
                child.kill()
                child.communicate()
    return answers
