"""Opens damaged files by the thousand: `python tests/fuzz_damage.py 10000 [--seed 0] [--first 0] [--seconds S]`.

Case n of a seed is always the same damage: `--first` continues a count that `--seconds` has ended, several processes
may share one, and any case can be seen again. Ten take two seconds of a core. The cases run in processes of their own:
one that dies or hangs is told with its number.
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import json
import os
import resource
import select
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

LIMIT_S = 60.0
"""For one case, on a busy machine; a sound case takes less than two seconds, a resumed run ten."""
MEMORY_BYTES = 2**31
"""The most that a process that opens runs of a megabyte may ever hold."""
ADDRESSES_BYTES = 2**35
BAD = ("taken for sound", "traceback", "many lines", "outside touched", "died", "hung", "much memory")


def main() -> int:
    """Run the cases, print a line a bad one and the counts; return 1 if any was bad."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after so long")
    parser.add_argument("--worker", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        work(options.worker, options.seed, options.first, options.cases)
        return 0
    with tempfile.TemporaryDirectory() as folder:
        make(Path(folder))
        counts = count(Path(folder), options.seed, options.first, options.cases, options.seconds)
    print(json.dumps({kind: dict(sorted(found.items())) for kind, found in sorted(counts.items())}, indent=2))
    total: collections.Counter[str] = sum(counts.values(), collections.Counter())
    print(
        f"{sum(total.values())} cases: " + ", ".join(f"{number} {outcome}" for outcome, number in total.most_common())
    )
    return int(any(total[outcome] for outcome in BAD))


def make(folder: Path) -> None:
    import damage

    (folder / "temporary").mkdir()
    damage.make_runs(folder)


def count(folder: Path, seed: int, first: int, cases: int, seconds: float) -> dict[str, collections.Counter[str]]:
    """Return the outcomes by run, file and way of opening."""
    counts: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    started, reported = time.monotonic(), 0
    for done, case in enumerate(outcomes(folder, seed, first, first + cases), 1):
        counts[case["kind"]][case["outcome"]] += 1
        if case["outcome"] in BAD:
            print(json.dumps(case), flush=True)
        if done >= reported + 500:
            reported = done
            print(f"{done} of {cases} in {time.monotonic() - started:.0f} s", file=sys.stderr, flush=True)
        if time.monotonic() - started > seconds:
            print(f"stopped: --first {case['number'] + 1} continues")
            break
    return counts


def outcomes(folder: Path, seed: int, first: int, end: int) -> Iterator[dict[str, Any]]:
    """Yield every case's outcome; a worker that dies or hangs is followed by another."""
    while first < end:
        with worker(folder, seed, first, end - first) as process, contextlib.ExitStack() as stop:
            assert process.stdout is not None
            begun = {"number": first, "kind": "?"}
            stop.callback(process.kill)
            while True:
                ready = select.select([process.stdout], [], [], LIMIT_S)[0]
                line = process.stdout.readline() if ready else ""
                if not line:
                    break
                case = json.loads(line)
                if "outcome" not in case:
                    begun = case
                    continue
                first = case["number"] + 1
                yield case
            if not ready:
                process.kill()
            process.wait()
        if first < end:
            yield begun | {"outcome": "died" if ready else "hung", "said": f"exit code {process.returncode}"}
            first = begun["number"] + 1


def worker(folder: Path, seed: int, first: int, cases: int) -> subprocess.Popen[str]:
    arguments = [str(cases), "--seed", str(seed), "--first", str(first), "--worker", str(folder)]
    environment = os.environ | {"TMPDIR": str(folder / "temporary")}
    return subprocess.Popen(
        [sys.executable, __file__, *arguments], stdout=subprocess.PIPE, text=True, env=environment, bufsize=1
    )


def work(folder: Path, seed: int, first: int, cases: int) -> None:
    """Try the cases, saying before and after each what it is."""
    import damage

    resource.setrlimit(resource.RLIMIT_AS, (ADDRESSES_BYTES, ADDRESSES_BYTES))
    truths: dict[Any, Any] = {}
    for number in range(first, first + cases):
        way = damage.way_of(seed, number)
        kind = f"{way.run} {way.file} {way.open}"
        say(number=number, kind=kind)
        case = damage.try_case(folder, seed, number, truths)
        kilobytes = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
        if kilobytes * 1024 > MEMORY_BYTES:
            case = case._replace(outcome="much memory", said=f"{kilobytes} kB")
        say(number=number, kind=kind, how=case.how, outcome=case.outcome, said=case.said[:300])
        if case.outcome == "much memory":
            return


def say(**what: Any) -> None:
    os.write(1, (json.dumps(what) + "\n").encode())


if __name__ == "__main__":
    sys.exit(main())
