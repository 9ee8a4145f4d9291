"""`PYTHON worker.py PEER JOB.npz [RESULT.npz]`: run one peer's network, a round at a time, as the bench asks for it.

The bench writes a line to standard input for every round that it wants and reads a line of JSON back: the CPU seconds
of the round and its spikes by population. A round is the job's `chunks_a_round` stretches of 50 ms, with new input and
a read-out between two of them. With RESULT.npz the job is run to its end instead, and its spikes are written there.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
import time
from pathlib import Path
from typing import IO, Any, Final, NamedTuple

import numpy as np

PEERS: Final = ("numpy", "brian2", "nest")


class Job(NamedTuple):
    """The network and its input. `drives`, (chunks, 1000), and `releases`, (chunks, 8), belong to a 50 ms stretch each.

    `constants` are pure numbers by name; `weights`, (8, 100, 100); `noise_half_width`, (1000,); `populations`, (13,):
    where each begins and the last one ends; `projections`, (8, 2): sensory and motor population; `signs`, (8,): whether
    a projection's dopamine is positive or negative.
    """

    constants: dict[str, float]
    weights: Any
    drives: Any
    releases: Any
    noise_half_width: Any
    populations: Any
    projections: Any
    signs: Any
    chunk_ms: int
    plastic: bool
    record: bool


class Rounds:
    """Hands out the job's stretches, and stands still between two rounds until the bench asks for the next."""

    def __init__(self, job: Job, *, chunks_a_round: int, reply: IO[str] | None) -> None:
        self._job = job
        self._chunks_a_round = chunks_a_round
        self._reply = reply
        self._chunk = 0
        self._counts = np.zeros(len(job.populations) - 1, np.int64)
        self._started_s = 0.0

    def __call__(self, counts: Any) -> tuple[Any, Any] | None:
        """Take the last stretch's spikes by population; return the next one's drive and release, or None at the end."""
        self._counts += counts
        if self._reply is None and self._chunk == len(self._job.drives):
            return None
        if self._reply is not None and self._chunk % self._chunks_a_round == 0 and not self._turn():
            return None
        index = self._chunk % len(self._job.drives)
        self._chunk += 1
        return self._job.drives[index], self._job.releases[index]

    def _turn(self) -> bool:
        """Report the round that has ended, and wait for the bench."""
        answer = {"cpu_s": time.process_time() - self._started_s, "counts": self._counts.tolist()}
        print(json.dumps(answer), file=self._reply, flush=True)
        go = sys.stdin.readline().strip() == "go"
        self._counts[:] = 0
        self._started_s = time.process_time()
        return go


def load_job(path: Path) -> tuple[Job, int]:
    """Return the job of a file, and the stretches of a round."""
    with np.load(path, allow_pickle=False) as file:
        arrays = {name: file[name] for name in Job._fields if name in file}
        settings = json.loads(str(file["settings"]))
    return Job(**arrays, **settings["job"]), int(settings["chunks_a_round"])


def _private_output() -> IO[str]:
    """Return standard output, and send what the simulators print to standard error instead."""
    output = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    return output


def main(peer: str, job_file: str, result_file: str | None = None) -> None:
    """Run one peer."""
    reply = _private_output()
    job, chunks_a_round = load_job(Path(job_file))
    simulator = importlib.import_module(f"network_{peer}")
    if result_file is None:
        simulator.simulate(job, Rounds(job, chunks_a_round=chunks_a_round, reply=reply))
        return
    # Every spike in the order of time, `step` from 0 and `neuron`; and the `weights` at the end.
    np.savez(result_file, **simulator.simulate(job, Rounds(job, chunks_a_round=chunks_a_round, reply=None)))


if __name__ == "__main__":
    main(*sys.argv[1:])
