"""Everything in the network that changes with time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import MOTOR, NEURON_COUNT, NEURONS_PER_SIDE, POPULATIONS, PROJECTIONS, SENSORY, populations_of
from scla_mj.brain.network.parameters import REGULAR_SPIKING

if TYPE_CHECKING:
    from scla_mj.config import NetworkConfig

_CACHE_LINE_BYTES: Final = 64


class NetworkState(NamedTuple):
    """The network's state, as arrays that the kernel changes in place. `R` is float32 or float64.

    N neurons, n of them in a sensory or motor population: 1000 and 100 in the paper. `v`, `u`: membrane potential and
    recovery, (N,) R. `synaptic`: current that arrives in the next step, (N,) R. `trace`: STDP traces of the sensory and
    motor neurons, (8 n,) R. `dopamine`: concentration at each projection, (8,) float64. `anchor` and `scaled`,
    (8, n, 100) R, hold weights and eligibility lazily (see kernel.py): projection, postsynaptic neuron, presynaptic
    neuron of its block, in this order because twenty motor neurons fire for each sensory one, and each wants what
    leads to it side by side. `decayed` (1,) and `gathered` (8,), both float64, are what they are scaled by.
    `noise_low`, `noise_high`: each neuron's own generator, (N,) uint32. `fired`: this step's spikes, (N,) uint8, and
    `fired_octets`, (N / 8,), the same memory by eights; `step_counts`: their number by population, (12,).
    """

    v: NDArray[Any]
    u: NDArray[Any]
    synaptic: NDArray[Any]
    trace: NDArray[Any]
    dopamine: NDArray[np.float64]
    anchor: NDArray[Any]
    scaled: NDArray[Any]
    decayed: NDArray[np.float64]
    gathered: NDArray[np.float64]
    noise_low: NDArray[np.uint32]
    noise_high: NDArray[np.uint32]
    fired: NDArray[np.uint8]
    fired_octets: NDArray[np.uint64]
    step_counts: NDArray[np.int64]


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
    anchor = np.empty(shape, real)
    presynaptic_first(anchor)[:] = weights.uniform(config.weight_low, config.weight_high, shape).reshape(
        presynaptic_first(anchor).shape
    )
    lanes = noise.generate_state(2 * neurons, np.uint32).reshape(2, neurons)
    lanes[0][(lanes == 0).all(axis=0)] = 1  # an all-zero generator would stay at zero
    fired = _aligned(np.zeros(neurons, np.uint8))
    rest_v = REGULAR_SPIKING.c
    return NetworkState(
        v=_aligned(np.full(neurons, rest_v, real)),
        u=_aligned(np.full(neurons, REGULAR_SPIKING.b * rest_v, real)),
        synaptic=_aligned(np.zeros(neurons, real)),
        trace=_aligned(np.zeros(excitatory[-1].stop, real)),
        dopamine=np.zeros(len(PROJECTIONS)),
        anchor=_aligned(anchor),
        scaled=_aligned(np.zeros(shape, real)),
        decayed=np.ones(1),
        gathered=np.zeros(len(PROJECTIONS)),
        noise_low=_aligned(lanes[0]),
        noise_high=_aligned(lanes[1]),
        fired=fired,
        fired_octets=fired.view(np.uint64),
        step_counts=np.zeros(len(POPULATIONS), np.int64),
    )


def presynaptic_first(synapses: NDArray[Any]) -> NDArray[Any]:
    """Return a view of an array (8, n, 100) of synapses as the paper lists them: presynaptic, then postsynaptic neuron.

    Its shape is (8, 100, 100), or (8, n / 100, 100, 100) where there are several blocks.
    """
    blocks = synapses.reshape(len(PROJECTIONS), -1, NEURONS_PER_SIDE, NEURONS_PER_SIDE).swapaxes(2, 3)
    return blocks[:, 0] if blocks.shape[1] == 1 else blocks


def _aligned(values: NDArray[Any]) -> NDArray[Any]:
    """Return a copy that begins with a cache line: the kernel's widest loads cross none, a tenth of its time."""
    memory = np.empty(values.nbytes + _CACHE_LINE_BYTES, np.uint8)
    start = -memory.ctypes.data % _CACHE_LINE_BYTES
    copy: NDArray[Any] = memory[start : start + values.nbytes].view(values.dtype).reshape(values.shape)
    copy[:] = values
    return copy
