"""Kills a run at random moments, and resumes it: `python tests/kill_anywhere.py 50 [--seed 0] [--first 0]`.

Each case starts `scla-mj rollout`, sends it SIGKILL somewhere in its life, from the first import to the last file, then
resumes it, with another such moment for `resume` itself in half of the cases. What is left in the end must be the
uninterrupted run to the bit. Case n of a seed always draws the same moments; what a process does then is chance.
"""

from __future__ import annotations

import argparse
import collections
import dataclasses
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from scla_mj import paths
from scla_mj.runs.seal import broken_files, is_sealed
from scla_mj.runs.summary import read_summary
from scla_mj.telemetry.reading.reader import inspect_recording

COMMAND: Final = (sys.executable, "-m", "scla_mj.cli.main")
SHAPE: Final = ("--epochs", "1", "--decisions", "60", "--telemetry", "light", "--checkpoint-period-s", "0.02")
MOMENTS: Final = (
    "", paths.LOCK, paths.CONFIG_JSON, paths.DECISIONS_PARTIAL, paths.RECORDING_RRD, paths.CHECKPOINT_NPZ,
    f".{paths.CHECKPOINT_NPZ}.*", f".{paths.DECISIONS_PARQUET}.*", paths.DECISIONS_PARQUET, paths.SUMMARY_JSON,
    paths.BRAIN_NPZ, paths.LEARNING_PNG, f".{paths.WEIGHTS_PNG}.*", paths.POLICY_PNG, f".{paths.SEAL_JSON}.*",
    paths.SEAL_JSON,
)  # fmt: skip
"""Half of the kills wait for such a file and then a moment; the others for a random part of the whole run's time."""
LIMIT_S: Final = 300.0


class Case(NamedTuple):
    """What became of one case: `told` is empty if the run is the uninterrupted one, else says how it is not."""

    number: int
    kills: list[str]
    told: str


def make_whole(work: Path, *options: str) -> float:
    """Leave the uninterrupted run in `work / "whole"`; return how long it took, in seconds."""
    started = time.monotonic()
    subprocess.run([*COMMAND, "rollout", str(work / "whole"), *SHAPE, *options], check=True, stdout=subprocess.DEVNULL)
    return time.monotonic() - started


def try_case(work: Path, seed: int, number: int, whole_s: float, *options: str) -> Case:
    """Kill a run, resume it to its end, and compare it with the one in `work / "whole"`."""
    rng, run, kills = np.random.default_rng([seed, number]), work / f"run-{number}", list[str]()
    for _ in range(1 + int(rng.integers(2))):
        moment = str(rng.choice(MOMENTS)) if rng.random() < 0.5 else ""
        moment = "" if moment and any(run.glob(moment)) else moment  # a killed run has left it
        delay_s = float(rng.random()) * (0.05 if moment else whole_s)
        kills.append(_killed(command(run, *options), run, moment, delay_s))
    for _ in range(2):  # where nothing was written yet, or all was, the first says so
        done = subprocess.run(command(run, *options), capture_output=True, text=True, timeout=LIMIT_S, check=False)
        if done.returncode == 0 or "is complete" in done.stderr:
            return Case(number, kills, difference(work / "whole", run))
    return Case(number, kills, f"exit code {done.returncode}: {done.stderr[-500:]}")


def command(run: Path, *options: str) -> list[str]:
    """Return how a user goes on: `resume`, or the same command again where nothing was written."""
    if (run / paths.CONFIG_JSON).exists():
        return [*COMMAND, "resume", str(run), "--checkpoint-period-s", "0.02"]
    return [*COMMAND, "rollout", str(run), *SHAPE, *options]


def _killed(words: list[str], run: Path, moment: str, delay_s: float) -> str:
    """Start a command and kill it; return when that was, and what it left."""
    with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        while moment and process.poll() is None and not any(run.glob(moment)):
            time.sleep(0.0005)
        end = time.monotonic() + delay_s
        while process.poll() is None and time.monotonic() < end:
            time.sleep(0.0005)
        process.kill()
    left = sorted(path.name for path in run.iterdir()) if run.exists() else []
    ended = "" if process.returncode < 0 else f" (ended before, {process.returncode})"
    return f"{words[3]} at {moment or 'start'} + {delay_s:.3f} s{ended}, leaves {', '.join(left) or 'nothing'}"


def difference(whole: Path, run: Path) -> str:
    """Return how a run differs from the uninterrupted one, nothing if it does not."""
    for name in (paths.DECISIONS_PARQUET, paths.BRAIN_NPZ, paths.LEARNING_PNG, paths.WEIGHTS_PNG, paths.POLICY_PNG):
        if (whole / name).exists() and not (run / name).exists():
            return f"{name} is missing"
        if (whole / name).exists() and (whole / name).read_bytes() != (run / name).read_bytes():
            return f"{name} differs"
    one, other = (dataclasses.replace(read_summary(path), wall_s=0.0) for path in (whole, run))
    if one != other:
        return f"{paths.SUMMARY_JSON} differs"
    if not is_sealed(run) or broken_files(run):
        return f"not sealed: {broken_files(run)}"
    names = {path.name for path in whole.iterdir()}
    odd = [path.name for path in run.iterdir() if path.name not in names and paths.part_number(path.name) is None]
    if odd:
        return f"left behind: {odd}"
    return "the recording differs" if not _same_recording(whole, run) else _inspected(run)


def _same_recording(whole: Path, run: Path) -> bool:
    expected, seen = (inspect_recording(*paths.recordings(path)) for path in (whole, run))
    told: dict[str, Any] = {"parts": (), "properties": {}, "path_length_m": 0.0}
    same = seen.weights.keys() == expected.weights.keys()
    same = same and all(np.array_equal(seen.weights[name], expected.weights[name]) for name in expected.weights)
    same = same and np.array_equal(seen.probabilities, expected.probabilities)
    told |= {"weights": {}, "probabilities": None}
    return same and seen._replace(**told) == expected._replace(**told)


def _inspected(run: Path) -> str:
    done = subprocess.run([*COMMAND, "inspect", str(run)], capture_output=True, text=True, check=False)
    sound = done.returncode == 0 and ": sound, complete:" in done.stdout
    return "" if sound else f"{done.stdout[:300]}{done.stderr[-300:]}"


def main() -> int:
    """Try the cases, print a line for every bad one and the counts; return 1 if any was bad."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=float("inf"), help="start no case after so long")
    parser.add_argument("--verbose", action="store_true", help="print every case")
    options = parser.parse_args()
    started, outcomes = time.monotonic(), collections.Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "warm").mkdir()
        make_whole(Path(folder) / "warm")  # compiles, if need be
        whole_s = make_whole(Path(folder))
        for number in range(options.first, options.first + options.cases):
            if time.monotonic() - started > options.seconds:
                print(f"stopped before case {number}: --first {number} continues")
                break
            case = try_case(Path(folder), options.seed, number, whole_s)
            outcomes["differs" if case.told else "bit-equal"] += 1
            if case.told or options.verbose:
                print(*case, sep=" | ", flush=True)
    print(f"{sum(outcomes.values())} killed and resumed: {dict(outcomes)}")
    return int(bool(outcomes["differs"]))


if __name__ == "__main__":
    sys.exit(main())
