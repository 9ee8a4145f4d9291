"""The network's work as a robot's loop gives it: 50 ms at a time, with input before and a read-out after.

Every stretch drives one sensory population, drawn anew; once a second two projections get dopamine, one up and one
down. All simulators get the same stretches.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import NEURON_COUNT, PROJECTIONS, SENSORY, populations_of
from scla_mj.brain.network.network import Network
from scla_mj.grid import Action

CHUNK_MS: Final = 50
CHUNKS_A_SECOND: Final = 1000 // CHUNK_MS
SIGNS: Final = np.array([1.0 if projection.agrees else -1.0 for projection in PROJECTIONS])
"""By projection, (8,): whether its dopamine is ever positive or negative, as signed modulation has it."""


class Workload(NamedTuple):
    """`drives`, (chunks, neurons), and `releases`, (chunks, 8): a stretch's input, and the dopamine before it."""

    drives: NDArray[np.float64]
    releases: NDArray[np.float64]


def rewarded(
    chunks: int, *, drive: float, release: float, rng: np.random.Generator, neurons: int = NEURON_COUNT
) -> Workload:
    """Return stretches in which one sensory population at a time is driven, and rewarded once a second."""
    drives, releases = np.zeros((chunks, neurons)), np.zeros((chunks, len(PROJECTIONS)))
    populations = populations_of(neurons)[: len(SENSORY)]
    for chunk in range(chunks):
        side = Action(int(rng.integers(len(populations))))
        drives[chunk, populations[side].start : populations[side].stop] = drive
        if chunk % CHUNKS_A_SECOND == CHUNKS_A_SECOND - 1:
            releases[chunk] = [release * sign * (p.sensor == side) for sign, p in zip(SIGNS, PROJECTIONS, strict=True)]
    return Workload(drives, releases)


def run_chunks(network: Network, workload: Workload) -> NDArray[np.int64]:
    """Run every stretch; return the spikes by population, (12,)."""
    counts = np.zeros(len(populations_of(NEURON_COUNT)), np.int64)
    for drive, release in zip(workload.drives, workload.releases, strict=True):
        if release.any():
            network.release_dopamine(release)
        counts += network.advance(CHUNK_MS, drive)
    return counts
