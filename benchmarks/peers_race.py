"""The same network in other simulators, in turn with ours, one second of network time each; rates must agree."""

from __future__ import annotations

import contextlib
import json
import math
import statistics
import subprocess
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Final, NamedTuple, Self

import numpy as np

from benchmarks import crosscheck
from benchmarks.peer_job import write_job
from benchmarks.peers import REQUIREMENTS, WORKER
from benchmarks.table import Sheet, against
from benchmarks.timing import Watch
from benchmarks.workload import CHUNKS_A_SECOND, Workload, rewarded, run_chunks
from scla_mj.brain.network.network import Network
from scla_mj.config import RunConfig
from scla_mj.errors import SclaError

_TARGETS: Final = {"brian2": 25.0, "nest": 70.0, "numpy": 20.0}
_LABELS: Final = {
    "ours": "scla_mj",
    "numpy": "numpy",
    "brian2": "Brian2 (Cython)",
    "nest": "NEST",
}
_KINDS: Final = ("sensory", "motor", "inhibitory")
_RATE_TOLERANCE: Final = 0.1
"""Rates may differ by this much: NEST's noise is Gaussian, its pairing a step apart, and all draw their own noise."""
_NETWORK_MS: Final = 1000
_LONGEST_S: Final = 600.0
"""Brian2 compiles for a minute; ten mean that something is wrong."""


class Round(NamedTuple):
    """CPU seconds of a second of network time, and its spikes of sensory, motor and inhibitory neurons."""

    cpu_s: float
    spikes: tuple[int, ...]


class Peer:
    """A simulator in a process of its own, standing still until it is asked for a round."""

    def __init__(self, python: Path, name: str, job: Path) -> None:
        self.name = name
        self.set_up_s = math.nan
        self._python, self._job = python, job

    def __enter__(self) -> Self:
        started_s = time.perf_counter()
        with ExitStack() as stack:
            self._complaints = stack.enter_context(tempfile.TemporaryFile("w+"))
            self._process = start_worker(self._python, [self.name, str(self._job)], self._complaints)
            stack.callback(_end, self._process)
            self._answer()
            self._leave = stack.pop_all().close
        self.set_up_s = time.perf_counter() - started_s
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._leave()

    def round(self) -> Round:
        """Run a second of network time."""
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # it has ended: the missing answer says why
            self._process.stdin.write("go\n")
            self._process.stdin.flush()
        answer = self._answer()
        return Round(float(answer["cpu_s"]), _by_kind(answer["counts"]))

    def _answer(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            self._process.wait()
            raise SclaError(complaint(self.name, self._complaints))
        answer: dict[str, Any] = json.loads(line)
        return answer


def race(config: RunConfig, python: Path, *, repetitions: int, watch: Watch) -> list[Sheet]:
    """Check every peer's spike train, then time all in turn; return both tables.

    Raises:
        SclaError: a peer does not start, or its spikes or rates differ from ours.
    """
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        checked = _check(config, python, Path(folder), watch)
        work = _work(config, repetitions + 1)
        network = Network(config.network, config.plasticity, seed=config.seed)
        job = Path(folder) / "race.npz"
        write_job(job, config.network, config.plasticity, network.weights, work, plastic=True, record=False)
        peers = [stack.enter_context(Peer(python, name, job)) for name in _TARGETS]
        rounds: dict[str, list[Round]] = {name: [] for name in _LABELS}
        for turn in range(repetitions + 1):
            rounds["ours"].append(_own_round(network, work, turn))
            for peer in peers:
                rounds[peer.name].append(peer.round())
            watch()
    require_same_rates({name: total(done) for name, done in rounds.items()})
    return [checked, race_sheet(rounds, {peer.name: peer.set_up_s for peer in peers})]


def race_sheet(rounds: Mapping[str, Sequence[Round]], set_up_s: Mapping[str, float]) -> Sheet:
    """Return the table; the first round of each warms up and is not counted."""
    cost = {name: 1e6 * statistics.median(r.cpu_s for r in done[1:]) / _NETWORK_MS for name, done in rounds.items()}
    rows = []
    for name, label in _LABELS.items():
        ratio = cost[name] / cost["ours"]
        target = against(ratio, _TARGETS[name], at_least=True) if name in _TARGETS else ""
        seconds = len(rounds[name])
        rates = " / ".join(f"{spikes / seconds:.0f}" for spikes in total(rounds[name]))
        set_up = f"{set_up_s[name]:.1f}" if name in set_up_s else ""
        rows.append((label, f"{cost[name]:.2f}", f"{ratio:.1f}", target, rates, set_up))
    header = ("what", "µs per simulated ms", "over ours", "target", "S / M / I spikes/s", "set-up s")
    return Sheet(
        "peers",
        "CPU time per simulated ms in other simulators",
        header,
        tuple(rows),
        "In turn, one second of network time each, one thread, float32 (NEST: float64). Spikes of all sensory, motor "
        "and inhibitory neurons. Set-up: wall-clock time until the first step. "
        "Plasticity and noise on, input and read-out every 50 ms.",
        {f"{name}, µs per simulated ms": value for name, value in cost.items()},
    )


def require_same_rates(spikes: Mapping[str, Sequence[int]]) -> None:
    """Compare every peer's spikes with `ours`, by kind of neuron.

    Raises:
        SclaError: they differ by more than a tenth.
    """
    for name, counts in spikes.items():
        for kind, own, other in zip(_KINDS, spikes["ours"], counts, strict=True):
            if not abs(other - own) <= _RATE_TOLERANCE * own:
                raise SclaError(
                    f"{_LABELS[name]}: {other} spikes of {kind} neurons, ours {own}: more than "
                    f"{100 * _RATE_TOLERANCE:.0f} % apart, so the bench compares different networks"
                )


def total(rounds: Sequence[Round]) -> tuple[int, ...]:
    """Return all rounds' spikes by kind of neuron."""
    return tuple(int(count) for count in np.sum([done.spikes for done in rounds], axis=0))


def start_worker(python: Path, arguments: list[str], complaints: IO[str]) -> subprocess.Popen[str]:
    """Start a peer's process.

    Raises:
        SclaError: the interpreter cannot be started.
    """
    try:
        return subprocess.Popen(
            [str(python), str(WORKER), *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=complaints,
            text=True,
        )
    except OSError as error:
        raise SclaError(f"--peers {python} cannot be started: {error.strerror}; name the peers' own python") from error


def run_to_the_end(python: Path, name: str, job: Path, result: Path) -> None:
    """Run a peer's whole job, and leave its spikes in `result`.

    Raises:
        SclaError: the peer does not start, fails, or takes ten minutes.
    """
    with ExitStack() as stack:
        complaints = stack.enter_context(tempfile.TemporaryFile("w+"))
        process = start_worker(python, [name, str(job), str(result)], complaints)
        stack.callback(_end, process)
        try:
            process.communicate(timeout=_LONGEST_S)
        except subprocess.TimeoutExpired:
            raise SclaError(f"the peer {name} has not ended after {_LONGEST_S:.0f} s: start it by hand") from None
        if process.returncode or not result.exists():
            raise SclaError(complaint(name, complaints))


def _end(process: subprocess.Popen[str]) -> None:
    process.kill()
    process.communicate()


def complaint(name: str, complaints: IO[str]) -> str:
    """Return the sentence for a peer that ended early: its last line, and how its environment is made."""
    complaints.seek(0)
    last = (complaints.read().strip().splitlines() or ["it said nothing"])[-1]
    return f"the peer {name} ended early: {last}; its environment is made from {REQUIREMENTS}"


def _check(config: RunConfig, python: Path, folder: Path, watch: Watch) -> Sheet:
    found = []
    for number, check in enumerate(crosscheck.CHECKS):
        job = folder / f"check-{number}.npz"
        ours = crosscheck.prepare(check, job, config.plasticity, seed=config.seed)
        for name in check.peers:
            result = folder / f"check-{number}-{name}.npz"
            run_to_the_end(python, name, job, result)
            apart = crosscheck.require_same(_LABELS[name], check, ours, crosscheck.read_train(result))
            found.append((_LABELS[name], check, len(ours.step), apart))
            watch()
    return crosscheck.sheet(found)


def _work(config: RunConfig, seconds: int) -> Workload:
    return rewarded(
        seconds * CHUNKS_A_SECOND,
        drive=config.network.sensory_drive,
        release=config.plasticity.dopamine_release,
        rng=np.random.Generator(np.random.PCG64(config.seed)),
    )


def _own_round(network: Any, work: Workload, turn: int) -> Round:
    part = slice(turn * CHUNKS_A_SECOND, (turn + 1) * CHUNKS_A_SECOND)
    started_s = time.process_time()
    counts = run_chunks(network, Workload(work.drives[part], work.releases[part]))
    return Round(time.process_time() - started_s, _by_kind(counts.tolist()))


def _by_kind(counts: Sequence[int]) -> tuple[int, ...]:
    return tuple(int(count) for count in np.reshape(counts, (len(_KINDS), -1)).sum(axis=1))
