"""A network by description next to the paper's kernel and Brian2, in turn; and how its cost grows with its size."""

from __future__ import annotations

import dataclasses
import math
import statistics
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.peer_job import write_job
from benchmarks.peers import INSTALL, PYTHON
from benchmarks.peers_race import Peer
from benchmarks.table import Sheet, against
from benchmarks.timing import Watch
from benchmarks.workload import CHUNK_MS, CHUNKS_A_SECOND, Workload, rewarded, run_chunks
from scla_mj.brain.network.general import GeneralNetwork
from scla_mj.brain.network.network import Network
from scla_mj.brain.network.paper import paper_description
from scla_mj.config import RunConfig

_LARGE: Final = 10_000
_PAPERS: Final = "the paper's kernel"
_DESCRIBED: Final = "by description"
_GROWN: Final = f"by description, {_LARGE:,} neurons, {80 * _LARGE:,} synapses"
_BRIAN2: Final = "Brian2 (Cython)"
_FIFTH_TARGET: Final = 0.2
_GROWN_TARGET: Final = 12.0


def measure(config: RunConfig, python: Path | None, *, repetitions: int, watch: Watch) -> Sheet:
    """Time one second of network time of each in turn; Brian2 in the python named, or in `.peers` if that exists."""
    config = dataclasses.replace(config, network=dataclasses.replace(config.network, precision="float32"))
    large = dataclasses.replace(config, network=dataclasses.replace(config.network, neurons=_LARGE))
    work, more = _work(config, 1000), _work(config, _LARGE)
    own: dict[str, tuple[Any, Workload]] = {
        _PAPERS: (Network(config.network, config.plasticity, seed=config.seed), work),
        _DESCRIBED: (GeneralNetwork(paper_description(config), seed=config.seed), work),
        _GROWN: (GeneralNetwork(paper_description(large), seed=config.seed), more),
    }
    python = python or (PYTHON if PYTHON.is_file() else None)
    spent: dict[str, list[float]] = {name: [] for name in own}
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        peer = None
        if python is not None:
            job, weights = Path(folder) / "job.npz", own[_PAPERS][0].weights
            write_job(job, config.network, config.plasticity, weights, work, plastic=True, record=False)
            peer = stack.enter_context(Peer(python, "brian2", job))
            spent[_BRIAN2] = []
        for _ in range(repetitions + 1):
            for name, (network, load) in own.items():
                started_s = time.process_time()
                run_chunks(network, load)
                spent[name].append(time.process_time() - started_s)
            if peer is not None:
                spent[_BRIAN2].append(peer.round().cpu_s)
            watch()
    ms = CHUNKS_A_SECOND * CHUNK_MS
    return sheet({name: 1e6 * statistics.median(seconds[1:]) / ms for name, seconds in spent.items()})


def sheet(cost: dict[str, float]) -> Sheet:
    """Return the table from the cost of each, in µs per simulated ms; Brian2 may be missing."""
    described, brian2 = cost[_DESCRIBED], cost.get(_BRIAN2, math.nan)
    targets = {
        _GROWN: f"{cost[_GROWN] / described:.1f} x by description, {against(cost[_GROWN] / described, _GROWN_TARGET)}"
    }
    if _BRIAN2 in cost:
        share = described / brian2
        targets[_DESCRIBED] = f"{share:.2f} x Brian2, {against(share, _FIFTH_TARGET)}"
    rows = [
        (name, f"{value:.2f}", f"{value / cost[_PAPERS]:.1f}", targets.get(name, "")) for name, value in cost.items()
    ]
    if _BRIAN2 not in cost:
        rows.append((_BRIAN2, "", "", f"not installed: {INSTALL}"))
    return Sheet(
        "described",
        "CPU time per simulated ms of a network by description",
        ("what", "µs per simulated ms", "over the paper's kernel", "target"),
        tuple(rows),
        "In turn, one second of network time each, one thread, float32, plasticity and noise on, input and read-out "
        "every 50 ms. The paper's network, 80,000 plastic synapses, where no other size is given.",
        {f"{name}, µs per simulated ms": value for name, value in cost.items()},
    )


def _work(config: RunConfig, neurons: int) -> Workload:
    rng = np.random.Generator(np.random.PCG64(config.seed))
    drive, release = config.network.sensory_drive, config.plasticity.dopamine_release
    return rewarded(CHUNKS_A_SECOND, drive=drive, release=release, rng=rng, neurons=neurons)
