"""Kills the workers and the scheduler of a sweep: `python tests/kill_workers.py [--runs 40] [--kills 5]`.

Three times the same sweep: on this machine, its workers sent SIGKILL in mid-run; on this machine, the command itself
sent SIGKILL, and started again; under a scheduler and workers of their own, the scheduler sent SIGKILL, and all started
again. Each time all runs must be there once, with the bits of runs that were made one by one.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from scla_mj.config import RunConfig
from scla_mj.engine.ensure import ensure
from scla_mj.experiments.campaign import run_folder
from scla_mj.experiments.sweeps.plan import Plan, configurations, grouped
from scla_mj.paths import BRAIN_NPZ, CHECKPOINT_NPZ, CONFIG_JSON, DECISIONS_PARQUET
from scla_mj.runs.atomic import read_json
from scla_mj.runs.seal import broken_files, is_sealed

COMMAND: Final = (sys.executable, "-m", "scla_mj.cli.main", "sweep")
LIMIT_S: Final = 900.0
Digests = dict[str, tuple[str, ...]]


def options(seeds: int, decisions: int) -> list[str]:
    """Return a sweep of two brains and that many seeds of each, with many checkpoints."""
    shape = ["--epochs", "2", "--decisions", str(decisions), "--checkpoint-period-s", "0.1"]
    return ["--brain", "automata-everywhere", "q-learning", "--seeds", str(seeds), *shape]


def configs(seeds: int, decisions: int) -> list[RunConfig]:
    """Return the runs of `options`."""
    vary = {("brain",): ["automata-everywhere", "q-learning"], ("epochs",): [2], ("decisions",): [decisions]}
    return configurations(Plan(), vary, seeds=seeds)


def digests(out: Path) -> Digests:
    """Return the SHA-256 of the decisions and the brain of every complete, sound run, by its folder."""
    found: Digests = {}
    for run in sorted(out.glob("runs/*/seed-*")):
        assert is_sealed(run) and not broken_files(run), run
        files = [run / name for name in (DECISIONS_PARQUET, BRAIN_NPZ)]
        found[str(run.relative_to(out))] = tuple(hashlib.sha256(file.read_bytes()).hexdigest() for file in files)
    return found


def one_by_one(out: Path, seeds: int, decisions: int) -> Digests:
    """Make the runs in this process, one after another."""
    for experiment in grouped(configs(seeds, decisions)):
        for seed in experiment.seeds:
            config = next(each for each in configs(seeds, decisions)
                          if each.seed == seed and each.brain == experiment.config.brain)  # fmt: skip
            ensure(config, run_folder(out, experiment, seed))
    return digests(out)


@contextlib.contextmanager
def started(*words: str) -> Iterator[subprocess.Popen[str]]:
    """Start a command in a session of its own; leaving the block ends what is left of it."""
    with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                          start_new_session=True) as process:  # fmt: skip
        try:
            yield process
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)


def workers_of(process: subprocess.Popen[str]) -> list[int]:
    """Return the processes that a sweep has started for its runs."""
    children = " ".join(file.read_text() for file in Path(f"/proc/{process.pid}/task").glob("*/children"))
    return [pid for pid in map(int, children.split()) if b"spawn_main" in command_of(pid)]


def command_of(pid: int) -> bytes:
    """Return a process's command line, nothing if it has ended."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    return b""


def identities(out: Path) -> dict[Path, str]:
    """Return the identity of every run that has a checkpoint and so is in the middle."""
    found = {}
    for file in out.glob(f"runs/*/*/{CHECKPOINT_NPZ}"):
        with contextlib.suppress(Exception):
            found[file.parent] = read_json(file.parent / CONFIG_JSON)["run_id"]
    return found


def kill_workers(out: Path, process: subprocess.Popen[str], kills: int, workers: int) -> dict[Path, str]:
    """Kill a worker in mid-run, that many times; return the runs that were then in the middle."""
    seen: dict[Path, str] = {}
    killed: set[int] = set()
    while len(killed) < kills and process.poll() is None:
        time.sleep(0.05)
        alive = [pid for pid in workers_of(process) if pid not in killed]
        middle = identities(out)
        if len(alive) < workers or not middle:  # the last one killed has not been replaced yet
            continue
        victim = alive[len(killed) % len(alive)]
        os.kill(victim, signal.SIGKILL)
        killed.add(victim)
        seen |= middle
        print(f"killed worker {victim} with {len(middle)} runs in the middle", flush=True)
    assert len(killed) == kills, f"the sweep ended after {len(killed)} kills: make its runs longer"
    return seen


def swept(out: Path, words: list[str], expected: Digests) -> None:
    """Run a sweep to its end and compare its bits."""
    done = subprocess.run([*COMMAND, str(out), *words], capture_output=True, text=True, timeout=LIMIT_S, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert digests(out) == expected
    assert (out / "sweep.parquet").exists() and (out / "sweep.png").exists()


def try_kills(out: Path, words: list[str], kills: int, expected: Digests, *, workers: int = 2) -> None:
    """Kill workers of a sweep on this machine; it ends by itself with everything done."""
    with started(*COMMAND, str(out), *words, "--workers", str(workers)) as process:
        seen = kill_workers(out, process, kills, workers)
        _, said = process.communicate(timeout=LIMIT_S)
    assert process.returncode == 0, said[-2000:]
    assert digests(out) == expected
    again = {run: read_json(run / CONFIG_JSON)["run_id"] for run in seen}
    assert again == seen, "a run was begun anew"


def try_command(out: Path, words: list[str], expected: Digests) -> None:
    """Kill the command, and with it the scheduler on this machine; start it again."""
    with started(*COMMAND, str(out), *words, "--workers", "2") as process:
        wait_for_runs(out)
        left = workers_of(process)
        process.kill()
        process.wait()
        end = time.monotonic() + 10.0
        while any(command_of(pid) for pid in left):
            assert time.monotonic() < end, "a worker outlives its sweep"
            time.sleep(0.05)
    swept(out, [*words, "--workers", "2"], expected)


def try_scheduler(out: Path, words: list[str], expected: Digests) -> None:
    """Kill a scheduler that the user has started; the workers are left to themselves, and all is started again."""
    words = [*words, "--scheduler", "tcp://127.0.0.1:8790"]
    with cluster() as scheduler, started(*COMMAND, str(out), *words) as process:
        wait_for_runs(out)
        scheduler.kill()
        _, said = process.communicate(timeout=LIMIT_S)
        assert process.returncode == 2, (process.returncode, said[-2000:])
        print(said.splitlines()[-1])
        assert "the same command again" in said
        with cluster():
            swept(out, words, expected)


@contextlib.contextmanager
def cluster() -> Iterator[subprocess.Popen[str]]:
    """Start a scheduler and two workers with Dask's own commands."""
    dask = (sys.executable, "-m", "dask")
    scheduler = (*dask, "scheduler", "--host", "127.0.0.1", "--port", "8790", "--no-dashboard")
    worker = (*dask, "worker", "tcp://127.0.0.1:8790", "--host", "127.0.0.1", "--no-dashboard", "--nthreads", "1")
    worker += ("--death-timeout", "20")
    with started(*scheduler) as process, started(*worker), started(*worker):
        yield process


def wait_for_runs(out: Path) -> None:
    """Wait until one run is complete and another is in the middle."""
    end = time.monotonic() + LIMIT_S
    while not (identities(out) and list(out.glob("runs/*/*/seal.json"))):
        assert time.monotonic() < end
        time.sleep(0.05)


def main() -> int:
    """Try all three; an assertion says what went wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=40)
    parser.add_argument("--kills", type=int, default=5)
    parser.add_argument("--decisions", type=int, default=1000)
    chosen = parser.parse_args()
    seeds = chosen.runs // 2
    words = options(seeds, chosen.decisions)
    with tempfile.TemporaryDirectory() as folder:
        work, started_s = Path(folder), time.monotonic()
        expected = one_by_one(work / "one-by-one", seeds, chosen.decisions)
        assert len(expected) == 2 * seeds
        print(f"{len(expected)} runs one by one: {time.monotonic() - started_s:.0f} s", flush=True)
        try_kills(work / "workers", words, chosen.kills, expected)
        print(f"{chosen.kills} workers killed: all {len(expected)} runs there, the same bits", flush=True)
        try_command(work / "command", words, expected)
        print("the command killed, and started again: the same bits", flush=True)
        try_scheduler(work / "scheduler", words, expected)
        print("the scheduler killed, all started again: the same bits", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
