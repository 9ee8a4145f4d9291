"""Everything in the network that changes with time, by name: views of its memory."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.brain.network.parameters import REGULAR_SPIKING

if TYPE_CHECKING:
    from scla_mj.brain.network.memory import Memory
    from scla_mj.config import NetworkConfig


class NetworkState(NamedTuple):
    """The network's state, as arrays that the kernel changes in place. `R` is float32 or float64.

    N neurons, n of them in a sensory or motor population: 1000 and 100 in the paper. `v`, `u`: membrane potential and
    recovery, (N,) R. `synaptic`: current that arrives in the next step, (N,) R. `trace`: STDP traces of the sensory and
    motor neurons, (8 n,) R. `dopamine`: concentration at each projection, (8,) float64. `weight` and `scaled`,
    (8, n, 100) R, hold weights and eligibility lazily: projection, presynaptic neuron, postsynaptic neuron of its
    block; `decayed` (4,), `gathered` (8,) and `gathered_at` (8, n), all float64, say how to read them (synapses.py).
    `dosed`, (8,) int64, counts the steps with dopamine at a projection: without one no weight changes. `noise_low`,
    `noise_high`: each neuron's own generator, (N,) uint32. `fired`: this step's spikes, (N,) uint8 (and
    `fired_octets`, the same memory by eights); `step_counts`: their number by population, (12,).
    """

    v: NDArray[Any]
    u: NDArray[Any]
    synaptic: NDArray[Any]
    trace: NDArray[Any]
    dopamine: NDArray[np.float64]
    weight: NDArray[Any]
    scaled: NDArray[Any]
    decayed: NDArray[np.float64]
    gathered: NDArray[np.float64]
    gathered_at: NDArray[np.float64]
    dosed: NDArray[np.int64]
    noise_low: NDArray[np.uint32]
    noise_high: NDArray[np.uint32]
    fired: NDArray[np.uint8]
    step_counts: NDArray[np.int64]


def state_of(memory: Memory) -> NetworkState:
    """Return views of the state in a network's memory."""
    record, synapses = memory[0], memory[0]["synapses"]
    lazy = {"weight": synapses["weight"], "scaled": synapses["scaled"]}
    return NetworkState(**lazy, **{name: record[name] for name in NetworkState._fields if name not in lazy})


def begin(
    state: NetworkState, config: NetworkConfig, *, weights: np.random.Generator, noise: np.random.SeedSequence
) -> None:
    """Put a network of zeros to rest, with uniform random weights and one seeded noise generator a neuron."""
    lanes = noise.generate_state(2 * len(state.v), np.uint32).reshape(2, -1)
    lanes[0][(lanes == 0).all(axis=0)] = 1  # an all-zero generator would stay at zero
    state.noise_low[:], state.noise_high[:] = lanes
    state.v[:] = REGULAR_SPIKING.c
    state.u[:] = REGULAR_SPIKING.b * REGULAR_SPIKING.c
    state.weight[:] = weights.uniform(config.weight_low, config.weight_high, state.weight.shape)
    state.decayed[:] = 1.0
