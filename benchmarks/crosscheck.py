"""Our float64 spike train against that of independent simulators: identical, or the bench ends with a sentence.

The conditions: no noise; weights and inputs are multiples of 2**-10, so that their sums are exact in any order; the
same start. With plasticity the weights are no longer such multiples: Brian2 and numpy still give the same spikes, and
weights within 1e-12. NEST pairs spikes/step apart from the others and is compared without plasticity only.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.peer_job import own_spikes, write_job
from benchmarks.table import Sheet
from benchmarks.workload import CHUNKS_A_SECOND, SIGNS, Workload
from scla_mj.anatomy import NEURON_COUNT, PROJECTIONS
from scla_mj.brain.network.network import Network
from scla_mj.config import NetworkConfig, PlasticityConfig
from scla_mj.errors import SclaError

_UNIT: Final = 1024
"""Weights and inputs are multiples of 1 / 1024."""
_WEIGHT_TOLERANCE: Final = 1e-12
_QUIET: Final = NetworkConfig(
    precision="float64", sensory_noise=0.0, motor_noise=0.0, inhibitory_noise=0.0, inhibitory_to_motor=-0.625
)
"""Without noise, and with an inhibition that is a multiple of 2**-10."""


class Check(NamedTuple):
    """One comparison: which peers, how long, with or without plasticity."""

    name: str
    peers: tuple[str, ...]
    seconds: int
    plastic: bool


CHECKS: Final = (
    Check("no plasticity", ("numpy", "brian2", "nest"), 2, False),
    Check("with plasticity", ("numpy", "brian2"), 5, True),
)


class Train(NamedTuple):
    """Every spike in the order of time, then of neurons; the weights at the end, (8, 100, 100)."""

    step: NDArray[Any]
    neuron: NDArray[Any]
    weights: NDArray[np.float64]


def prepare(check: Check, file: Path, plasticity: PlasticityConfig, *, seed: int) -> Train:
    """Write the check's job for the peers, and return what our network makes of it."""
    rng = np.random.Generator(np.random.PCG64(seed))
    weights = _multiples(rng, (len(PROJECTIONS), 100, 100), 0.5, 1.5)
    work = _input(check, plasticity.dopamine_release, rng)
    write_job(file, _QUIET, plasticity, weights, work, plastic=check.plastic, record=True)
    network = Network(_QUIET, dataclasses.replace(plasticity, dopamine_delay_s=0.0), seed=seed)
    network.weights = weights
    return Train(*own_spikes(network, work))


def read_train(file: Path) -> Train:
    """Return what a peer wrote."""
    with np.load(file, allow_pickle=False) as arrays:
        return Train(arrays["step"], arrays["neuron"], arrays["weights"])


def require_same(peer: str, check: Check, ours: Train, theirs: Train) -> float:
    """Return the largest difference of a weight.

    Raises:
        SclaError: a spike differs, or a weight by more than 1e-12; the sentence says which.
    """
    shared = min(len(ours.step), len(theirs.step))
    differs = (ours.step[:shared] != theirs.step[:shared]) | (ours.neuron[:shared] != theirs.neuron[:shared])
    if differs.any():
        at = int(np.argmax(differs))
        raise SclaError(
            f"{peer}, {check.name}: spike {at} is of neuron {theirs.neuron[at]} at {theirs.step[at]} ms, "
            f"ours of neuron {ours.neuron[at]} at {ours.step[at]} ms: the bench compares different networks"
        )
    if len(ours.step) != len(theirs.step):
        raise SclaError(
            f"{peer}, {check.name}: {len(theirs.step)} spikes, ours {len(ours.step)}: "
            "the bench compares different networks"
        )
    apart = float(np.abs(ours.weights - theirs.weights).max())
    if not apart <= _WEIGHT_TOLERANCE:
        raise SclaError(
            f"{peer}, {check.name}: a weight differs by {apart:.1e}: it must be at most {_WEIGHT_TOLERANCE}"
        )
    return apart


def sheet(found: list[tuple[str, Check, int, float]]) -> Sheet:
    """Return the table of comparisons that held: peer, check, spikes, largest difference of a weight."""
    rows = tuple(
        (peer, check.name, f"{check.seconds} s", f"{spikes:,}", "identical", f"{apart:.1e}" if check.plastic else "")
        for peer, check, spikes, apart in found
    )
    return Sheet(
        "crosscheck",
        "Spike trains of other simulators against ours, float64",
        ("peer", "network", "time", "spikes", "train", "weights apart"),
        rows,
        "No noise, input changing every 50 ms, weights and inputs multiples of 2^-10. A difference ends the bench.",
        {f"{peer}, {check.name}, spikes": float(spikes) for peer, check, spikes, _ in found},
    )


def _input(check: Check, release: float, rng: np.random.Generator) -> Workload:
    chunks = check.seconds * CHUNKS_A_SECOND
    releases = np.zeros((chunks, len(PROJECTIONS)))
    if check.plastic:
        releases[3::4] = release * SIGNS
    return Workload(_multiples(rng, (chunks, NEURON_COUNT), 0.0, 12.0), releases)


def _multiples(rng: np.random.Generator, shape: tuple[int, ...], low: float, high: float) -> NDArray[np.float64]:
    drawn: NDArray[np.float64] = rng.integers(int(low * _UNIT), int(high * _UNIT), shape) / _UNIT
    return drawn
