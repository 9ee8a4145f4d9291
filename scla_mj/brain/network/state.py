"""Everything in the network that changes with time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import MOTOR, NEURON_COUNT, NEURONS_PER_SIDE, POPULATIONS, PROJECTIONS, SENSORY, populations_of
from scla_mj.brain.network.memory import placed
from scla_mj.brain.network.parameters import REGULAR_SPIKING, STRETCH_STEPS
from scla_mj.compiled import leaf_njit

if TYPE_CHECKING:
    from scla_mj.config import NetworkConfig


class NetworkState(NamedTuple):
    """The network's state, as arrays that the kernel changes in place. `R` is float32 or float64.

    N neurons, n of them in a sensory or motor population: 1000 and 100 in the paper. `v`, `u`: membrane potential and
    recovery, (N,) R. `synaptic`: current that arrives in the next step, (N,) R. `trace`: STDP traces of the sensory and
    motor neurons, (8 n,) R. `dopamine`: concentration at each projection, (8,) float64. `weight` and `scaled`,
    (8, n, 100) R, hold weights and eligibility lazily: projection, presynaptic neuron, postsynaptic neuron of its
    block; `decayed` (4,), `gathered` (8,) and `gathered_at` (8, n), all float64, say how to read them (synapses.py).
    `dosed`, (8,) int64, counts the steps with dopamine at a projection: without one no weight changes. `noise_low`,
    `noise_high`: each neuron's own generator, (N,) uint32. `fired`: this step's spikes, (N,) uint8, and
    `fired_octets`, (N / 8,), the same memory by eights; `step_counts`: their number by population, (12,).
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
    fired_octets: NDArray[np.uint64]
    step_counts: NDArray[np.int64]


class Stretch(NamedTuple):
    """What a stretch of at most `STRETCH_STEPS` steps keeps of its spikes (synapses.py); nothing of it outlives it.

    `drive`, (N,) R, is the current into each neuron from outside. `reach`, (4 n,) R, and `since`, (4 n,) int64: by
    sensory neuron, A+ x / E and the step of its last spike. `post`, (4 n,) R, by motor neuron, and `post_gathered`,
    (8, n) R, by projection and motor neuron: sums over the motor neuron's spikes. `next_spike`, (steps + 1, 4 n), says
    in which step a motor neuron fired after the one in that step, from 0 on, and 0 if it did not; `last_spike`, (4 n,),
    in which it did last. `opening`, (8,), and `course`, (8, steps + 1), float64: `gathered` when the stretch began, and
    how far it has come since at each step. `doubts`, (100,), and `replayed`, (2, 100) R, are the table on which one row
    is worked out.
    """

    drive: NDArray[Any]
    reach: NDArray[Any]
    since: NDArray[np.int64]
    post: NDArray[Any]
    post_gathered: NDArray[Any]
    next_spike: NDArray[np.uint8]
    last_spike: NDArray[np.uint8]
    opening: NDArray[np.float64]
    course: NDArray[np.float64]
    doubts: NDArray[np.uint8]
    replayed: NDArray[Any]


class Neurons(NamedTuple):
    """What the loops over neurons take of the state and the stretch: a compiler takes its time over large tuples."""

    v: NDArray[Any]
    u: NDArray[Any]
    synaptic: NDArray[Any]
    noise_low: NDArray[np.uint32]
    noise_high: NDArray[np.uint32]
    fired: NDArray[np.uint8]
    drive: NDArray[Any]


class Synapses(NamedTuple):
    """What synapses.py takes of the state and the stretch."""

    trace: NDArray[Any]
    dopamine: NDArray[np.float64]
    weight: NDArray[Any]
    scaled: NDArray[Any]
    decayed: NDArray[np.float64]
    gathered: NDArray[np.float64]
    gathered_at: NDArray[np.float64]
    dosed: NDArray[np.int64]
    reach: NDArray[Any]
    since: NDArray[np.int64]
    post: NDArray[Any]
    post_gathered: NDArray[Any]
    next_spike: NDArray[np.uint8]
    last_spike: NDArray[np.uint8]
    opening: NDArray[np.float64]
    course: NDArray[np.float64]
    doubts: NDArray[np.uint8]
    replayed: NDArray[Any]


@leaf_njit(inline="always")
def neurons_of(state: NetworkState, stretch: Stretch) -> Neurons:
    """Return the neurons of a network."""
    return Neurons(state.v, state.u, state.synaptic, state.noise_low, state.noise_high, state.fired, stretch.drive)


@leaf_njit(inline="always")
def synapses_of(state: NetworkState, stretch: Stretch) -> Synapses:
    """Return the synapses of a network."""
    return Synapses(
        state.trace,
        state.dopamine,
        state.weight,
        state.scaled,
        state.decayed,
        state.gathered,
        state.gathered_at,
        state.dosed,
        stretch.reach,
        stretch.since,
        stretch.post,
        stretch.post_gathered,
        stretch.next_spike,
        stretch.last_spike,
        stretch.opening,
        stretch.course,
        stretch.doubts,
        stretch.replayed,
    )


def initial_state(
    config: NetworkConfig,
    *,
    weights: np.random.Generator,
    noise: np.random.SeedSequence,
    neurons: int = NEURON_COUNT,
) -> NetworkState:
    """Return a network at rest with uniform random weights and one seeded noise generator a neuron."""
    real = np.dtype(config.precision)
    excitatory = populations_of(neurons)[: len(SENSORY) + len(MOTOR)]
    shape = (len(PROJECTIONS), excitatory[0].size, NEURONS_PER_SIDE)
    lanes = noise.generate_state(2 * neurons, np.uint32).reshape(2, neurons)
    lanes[0][(lanes == 0).all(axis=0)] = 1  # an all-zero generator would stay at zero
    rest_v = REGULAR_SPIKING.c
    return settled_in(
        v=np.full(neurons, rest_v, real),
        u=np.full(neurons, REGULAR_SPIKING.b * rest_v, real),
        synaptic=np.zeros(neurons, real),
        noise_low=lanes[0],
        noise_high=lanes[1],
        fired=np.zeros(neurons, np.uint8),
        trace=np.zeros(excitatory[-1].stop, real),
        dopamine=np.zeros(len(PROJECTIONS)),
        weight=weights.uniform(config.weight_low, config.weight_high, shape).astype(real),
        scaled=np.zeros(shape, real),
        decayed=np.ones(len(SENSORY)),
        gathered=np.zeros(len(PROJECTIONS)),
        gathered_at=np.zeros(shape[:2]),
        dosed=np.zeros(len(PROJECTIONS), np.int64),
        step_counts=np.zeros(len(POPULATIONS), np.int64),
    )


def settled_in(**arrays: NDArray[Any]) -> NetworkState:
    """Return a state of copies of all arrays but `fired_octets`, laid where the kernel likes them (memory.py)."""
    places = placed(arrays)
    return NetworkState(**places, fired_octets=places["fired"].view(np.uint64))


def empty_stretch(state: NetworkState) -> Stretch:
    """Return room for a stretch of a network's steps."""
    projections, size, _ = state.weight.shape
    real = state.weight.dtype
    places = placed(
        {
            "drive": np.zeros(len(state.v), real),
            "reach": np.zeros(len(SENSORY) * size, real),
            "post": np.zeros(len(MOTOR) * size, real),
            "post_gathered": np.zeros((projections, size), real),
            "since": np.zeros(len(SENSORY) * size, np.int64),
            "next_spike": np.zeros((STRETCH_STEPS + 1, len(MOTOR) * size), np.uint8),
            "last_spike": np.zeros(len(MOTOR) * size, np.uint8),
            "opening": np.zeros(projections),
            "course": np.zeros((projections, STRETCH_STEPS + 1)),
            "doubts": np.zeros(NEURONS_PER_SIDE, np.uint8),
            "replayed": np.zeros((2, NEURONS_PER_SIDE), real),
        }
    )
    return Stretch(**places)
