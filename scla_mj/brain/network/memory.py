"""The network's memory: one record that holds every array the compiled code reads and writes, and views of its state.

A compiled function that takes one record takes one pointer and knows every offset and size; forty arrays would be
copied from call to call, and the compiler would spend most of its time on them.

Arrays that one loop reads and writes together are staggered within their pages, to avoid 4K aliasing: a processor first
compares only the low 12 bits of addresses, so that a load from one array waits for a recent store to another at the
same offset within a page. Without the stagger a simulated ms costs up to a third more.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import MOTOR, NEURONS_PER_SIDE, POPULATIONS, PROJECTIONS, SENSORY, populations_of
from scla_mj.brain.network.parameters import REGULAR_SPIKING, STRETCH_STEPS, Parameters
from scla_mj.config import NetworkConfig
from scla_mj.randomness import Consumer, generator, noise_lanes

PAGE_BYTES: Final = 4096
STAGGER_BYTES: Final = 576
"""Seven arrays share a page at this distance; each begins on a cache line (64 bytes), as the widest loads need."""
WALKED_TOGETHER: Final = ("v", "u", "synaptic", "noise_low", "noise_high", "fired", "drive", "noise_amplitude")
"""The arrays that the loops over neurons (neurons.py) access together."""
WATCHED: Final = len(SENSORY) + len(MOTOR)
WATCHED_STEPS: Final = 200
"""Steps of a window for which potentials are kept: the decision window of any plausible clock."""
_LINE_BYTES: Final = 64
_SMALL_BYTES: Final = 512
"""Arrays up to this size are packed without a stagger: no loop spends its time on them."""

Memory = NDArray[np.void]
"""An array of one record, (1,): numba takes it faster than the record itself."""


class NetworkArrays(NamedTuple):
    """The state of a network, as views of its memory, which the kernel changes in place. `R` is float32 or float64.

    N neurons, n of them in a sensory or motor population: 1000 and 100 in the paper. `v`, `u`: membrane potential, mV,
    and recovery, (N,) R. `synaptic`: current that arrives in the next step, (N,) R. `trace`: STDP traces of the sensory
    and motor neurons, (8 n,) R. `dopamine`: concentration at each projection, (8,) float64. `weight` and `scaled`,
    (8, n, 100) R, hold weights and eligibility lazily: projection, presynaptic neuron, postsynaptic neuron of its
    block; `decayed` (4,), `gathered` (8,) and `gathered_at` (8, n), all float64, say how to read them (synapses.py).
    `dosed`, (8,) int64, counts the steps with dopamine at a projection: without one no weight changes. `noise_low`,
    `noise_high`: each neuron's own random generator, (N,) uint32. `fired`: this step's spikes, (N,) uint8 (and
    `fired_octets`, the same memory as uint64); `step_counts`: their number per population, (12,).
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


def new_memory(parameters: Parameters) -> Memory:
    """Return the memory of a network: its parameters, and zero everywhere else."""
    memory = _zeros(_layout(parameters))
    for name, value in parameters._asdict().items():
        memory[name] = value
    memory["watched"] = [population.start for population in populations_of(len(parameters.population_of))[:WATCHED]]
    return memory


def copy_of(memory: Memory) -> Memory:
    """Return a copy, aligned alike."""
    copy = _zeros(memory.dtype)
    copy.view(np.uint8)[:] = memory.view(np.uint8)
    return copy


def arrays_of(memory: Memory) -> NetworkArrays:
    """Return views of the state in a network's memory."""
    record, synapses = memory[0], memory[0]["synapses"]
    lazy = {"weight": synapses["weight"], "scaled": synapses["scaled"]}
    return NetworkArrays(**lazy, **{name: record[name] for name in NetworkArrays._fields if name not in lazy})


def initialise(arrays: NetworkArrays, config: NetworkConfig, *, seed: int) -> None:
    """Put a network of zeros to rest, with uniform random weights and one seeded noise generator per neuron."""
    weights = generator(seed, Consumer.WEIGHTS)
    arrays.noise_low[:], arrays.noise_high[:] = noise_lanes(seed, len(arrays.v))
    arrays.v[:] = REGULAR_SPIKING.c
    arrays.u[:] = REGULAR_SPIKING.b * REGULAR_SPIKING.c
    arrays.weight[:] = weights.uniform(config.weight_low, config.weight_high, arrays.weight.shape)
    arrays.decayed[:] = 1.0


def _layout(parameters: Parameters) -> np.dtype[np.void]:
    """Return the record of a network, staggered."""
    neurons, real = len(parameters.population_of), parameters.fading.dtype
    fields = {**_state(neurons, real), **_stretch(neurons, real), **_constant(parameters)}
    sizes = {name: np.dtype(field).itemsize for name, field in fields.items()}
    small = [name for name in fields if sizes[name] <= _SMALL_BYTES]
    large = [name for name in fields if sizes[name] > _SMALL_BYTES]
    offsets, end = {}, 0
    for name in small:
        offsets[name] = end + -end % _LINE_BYTES
        end = offsets[name] + sizes[name]
    for number, name in enumerate(sorted(large, key=lambda name: name not in WALKED_TOGETHER)):
        offsets[name] = end + (number * STAGGER_BYTES - end) % PAGE_BYTES
        end = offsets[name] + sizes[name]
    fields["fired_octets"], offsets["fired_octets"] = (np.uint64, (sizes["fired"] // 8,)), offsets["fired"]
    names, formats = list(fields), list(fields.values())
    places = [offsets[name] for name in names]
    return np.dtype({"names": names, "formats": formats, "offsets": places, "itemsize": end + -end % PAGE_BYTES}, True)


def _state(neurons: int, real: np.dtype[Any]) -> dict[str, Any]:
    """Return the fields of `NetworkArrays`."""
    n = populations_of(neurons)[0].size
    projections = len(PROJECTIONS)
    synapses = np.dtype([("weight", real, NEURONS_PER_SIDE), ("scaled", real, NEURONS_PER_SIDE)], align=True)
    return {
        "v": (real, (neurons,)),
        "u": (real, (neurons,)),
        "synaptic": (real, (neurons,)),
        "noise_low": (np.uint32, (neurons,)),
        "noise_high": (np.uint32, (neurons,)),
        "fired": (np.uint8, (neurons,)),
        "trace": (real, ((len(SENSORY) + len(MOTOR)) * n,)),
        "synapses": (synapses, (projections, n)),
        "gathered_at": (np.float64, (projections, n)),
        "gathered": (np.float64, (projections,)),
        "decayed": (np.float64, (len(SENSORY),)),
        "dopamine": (np.float64, (projections,)),
        "dosed": (np.int64, (projections,)),
        "step_counts": (np.int64, (len(POPULATIONS),)),
    }


def _stretch(neurons: int, real: np.dtype[Any]) -> dict[str, Any]:
    """Return the scratch fields of a stretch of at most `STRETCH_STEPS` steps (synapses.py); none outlives it.

    `drive`, (N,) R, is the external current into each neuron. `reach`, (4 n,) R, and `since`, (4 n,) int64, per sensory
    neuron: A+ x / E, and the step of its last spike. `post`, (4 n,) R, per motor neuron, and `post_gathered`, (8, n) R,
    per projection and motor neuron: sums over the motor neuron's spikes. `next_spike`, (steps + 1, 4 n): the step in
    which a motor neuron fired next after its spike in that step (row 0: its first spike), or 0; `last_spike`, (4 n,):
    the step of its last spike. `opening`, (8,), and `course`, (8, steps + 1), float64: `gathered` when the
    stretch began, and its change since then at each step. `table`, fields of (100,) R, is where rows.py works out one
    row, with `margin_bits`, the memory of `margin` as 64-bit integers; `columns`, (100,) float64, is where readers.py
    adds up rows. `potentials`, (`WATCHED_STEPS`, 8) R, are those of the neurons `watched`, the first of each
    sensory and motor population, after each step at the beginning of a window of time.
    """
    n = populations_of(neurons)[0].size
    sensory, motor, projections, steps = len(SENSORY) * n, len(MOTOR) * n, len(PROJECTIONS), STRETCH_STEPS + 1
    return {
        "drive": (real, (neurons,)),
        "reach": (real, (sensory,)),
        "since": (np.int64, (sensory,)),
        "post": (real, (motor,)),
        "post_gathered": (real, (projections, n)),
        "next_spike": (np.uint8, (steps, motor)),
        "last_spike": (np.uint8, (motor,)),
        "opening": (np.float64, (projections,)),
        "course": (np.float64, (projections, steps)),
        "table": _table(real),
        "columns": (np.float64, (NEURONS_PER_SIDE,)),
        "watched": (np.int64, (WATCHED,)),
        "potentials": (real, (WATCHED_STEPS, WATCHED)),
    }


def _table(real: np.dtype[Any]) -> np.dtype[np.void]:
    row = np.dtype((real, NEURONS_PER_SIDE))
    formats = {"weight": row, "scaled": row, "margin": row, "margin_bits": np.dtype((np.uint64, row.itemsize // 8))}
    places = [0, row.itemsize, 2 * row.itemsize, 2 * row.itemsize]
    return np.dtype({"names": list(formats), "formats": list(formats.values()), "offsets": places}, True)


def _constant(parameters: Parameters) -> dict[str, Any]:
    """Return the fields of `Parameters`; groups of numbers become records."""
    fields: dict[str, Any] = {}
    for name, value in parameters._asdict().items():
        if isinstance(value, tuple):
            names = value._fields  # type: ignore[attr-defined]
            fields[name] = np.dtype([(part, np.dtype(type(number))) for part, number in zip(names, value, strict=True)])
        else:
            fields[name] = (np.asarray(value).dtype, np.shape(value))
    return fields


def _zeros(layout: np.dtype[np.void]) -> Memory:
    """Return a record of zeros that begins on a page."""
    memory = np.zeros(layout.itemsize + PAGE_BYTES, np.uint8)
    start = -memory.ctypes.data % PAGE_BYTES
    record: Memory = memory[start : start + layout.itemsize].view(layout)
    return record
