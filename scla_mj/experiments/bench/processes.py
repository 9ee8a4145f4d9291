"""What only a process of its own can tell: start-up, peak memory, a long run's tail, two seeds on two cores."""

from __future__ import annotations

import dataclasses
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

from scla_mj.config import RunConfig
from scla_mj.errors import SclaError
from scla_mj.experiments.bench.rollouts import RATIO_TARGETS, bare_cpu_s
from scla_mj.experiments.bench.sheet import FLOOR_ABOVE, Sheet, against, doubted
from scla_mj.experiments.bench.timing import Watch

_COMMAND: Final = (sys.executable, "-m", "scla_mj.cli.main")
_CHILD: Final = (sys.executable, "-m", "scla_mj.experiments.bench.child")
_HELP_TARGET_S: Final = 0.3
_WARM_TARGET_S: Final = 1.5
_COLD_TARGET_S: Final = 4.0
_MEMORY_TARGET_MB: Final = 50.0
_TAIL_TARGET: Final = 1.10
_SEEDS_TARGET: Final = 1.8
_STRETCH: Final = 1000
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

    The 30,000 are the paper's experiment: its bare parts are replayed too.
    """
    short = _long_child(dataclasses.replace(config, epochs=SHORT_EPOCHS, decisions=_STRETCH))
    watch()
    long = _long_child(dataclasses.replace(config, epochs=LONG_EPOCHS, decisions=_STRETCH))
    watch()
    bare_s = bare_cpu_s(dataclasses.replace(config, epochs=LONG_EPOCHS, decisions=_STRETCH))
    watch()
    return long_sheet(short, long, bare_s=bare_s)


def long_sheet(short: dict[str, Any], long: dict[str, Any], *, bare_s: float) -> Sheet:
    """Return the table of two long runs, as `child.long_run` tells of them, beside the longer one's bare parts."""
    cpu_s, simulated_s = ([b - a for a, b in pairwise(long[key])] for key in ("cpu_s", "simulated_s"))
    tail = cpu_s[-1] / cpu_s[0]
    per_simulated = tail * simulated_s[0] / simulated_s[-1]
    ratio = long["total_cpu_s"] / bare_s
    growth_mb = long["peak_mb"] - short["peak_mb"]
    rows = (
        ("peak memory, 3,000 decisions", f"{short['peak_mb']:.0f} MB", ""),
        ("peak memory, 30,000 decisions", f"{long['peak_mb']:.0f} MB", ""),
        ("growth", f"{growth_mb:.1f} MB", against(growth_mb, _MEMORY_TARGET_MB)),
        ("decisions 1,001 to 2,000", f"{1000 * cpu_s[0] / _STRETCH:.3f} ms a decision", ""),
        ("decisions 29,001 to 30,000", f"{1000 * cpu_s[-1] / _STRETCH:.3f} ms a decision", ""),
        ("last over first", f"{tail:.3f}", against(tail, _TAIL_TARGET)),
        ("last over first, by simulated second", f"{per_simulated:.3f}", ""),
        ("bare parts of 30,000 decisions", f"{bare_s:.1f} s", ""),
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
        "bare_cpu_s": bare_s,
        "ratio": ratio,
    }
    table = Sheet(
        "long",
        "A long run, CPU time and memory",
        ("what", "measured", "target"),
        rows,
        "The first 1,000 decisions warm up: they compile, and the robot learns to take fewer seconds for a move. "
        "Telemetry light, figures drawn; one run each, one after the other.",
        values,
    )
    return doubted(table, FLOOR_ABOVE, row=_WHOLE) if ratio < 1 else table


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
    found = _ask(
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


def _long_child(config: RunConfig) -> dict[str, Any]:
    return _finish([_start_long(config)])[0]


def _start_long(config: RunConfig) -> subprocess.Popen[str]:
    return _start("long", {"config": dataclasses.asdict(config), "stretch": min(_STRETCH, config.decisions)}, None)


def _ask(task: str, options: dict[str, Any], cache: Path | None) -> dict[str, Any]:
    return _finish([_start(task, options, cache)])[0]


def _start(task: str, options: dict[str, Any], cache: Path | None) -> subprocess.Popen[str]:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)} if cache is not None else dict(os.environ)
    command = [*_CHILD, task, json.dumps(options)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)


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
