"""The memory of many networks on a device: that of scla_mj/brain/network/memory.py, brain by brain."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import warp as wp

from benchmarks.gpu.structs import fields_of, filled, struct
from scla_mj.anatomy import NEURON_COUNT, NEURONS_PER_SIDE, POPULATIONS, PROJECTIONS
from scla_mj.brain.network.memory import NetworkArrays, arrays_of, initialise, new_memory
from scla_mj.brain.network.parameters import (
    STRETCH_STEPS,
    NeuronConstants,
    Parameters,
    PlasticityConstants,
    Rates,
    Wiring,
)
from scla_mj.brain.network.synapses import SIDES
from scla_mj.config import NetworkConfig

N: Final = NEURONS_PER_SIDE
WORDS: Final = -(-N // 32)
"""A population's spikes of a step as bits, 32 a word."""
_STEPS, _GROUPS = STRETCH_STEPS + 1, len(POPULATIONS)
_REAL, _DOUBLE, _INT, _WORD, _BYTE = wp.float32, wp.float64, wp.int32, wp.uint32, wp.uint8
_SENSORY, _PLASTIC = SIDES * N, len(PROJECTIONS)

_ARRAYS: Final[dict[str, tuple[Any, tuple[int, ...]]]] = {
    "v": (_REAL, (NEURON_COUNT,)),
    "u": (_REAL, (NEURON_COUNT,)),
    "synaptic": (_REAL, (NEURON_COUNT,)),
    "trace": (_REAL, (2 * _SENSORY,)),
    "dopamine": (_DOUBLE, (_PLASTIC,)),
    "weight": (_REAL, (_PLASTIC, N, N)),
    "scaled": (_REAL, (_PLASTIC, N, N)),
    "decayed": (_DOUBLE, (SIDES,)),
    "gathered": (_DOUBLE, (_PLASTIC,)),
    "gathered_at": (_DOUBLE, (_PLASTIC, N)),
    "noise_low": (_WORD, (NEURON_COUNT,)),
    "noise_high": (_WORD, (NEURON_COUNT,)),
    "fired": (_BYTE, (NEURON_COUNT,)),
    # What a call is asked for, and the spikes of its populations:
    "released": (_DOUBLE, (_PLASTIC,)),
    "driven": (_INT, ()),
    "current": (_REAL, ()),
    "left": (_INT, ()),
    "total": (_INT, (_GROUPS,)),
    # A stretch's (memory.py): its steps, what no spike changes after each of them, and its spikes by step:
    "length": (_INT, ()),
    "settles": (_INT, (SIDES,)),
    "decays": (_DOUBLE, (_STEPS, SIDES)),
    "gathers": (_DOUBLE, (_STEPS, _PLASTIC)),
    "dopamine_after": (_DOUBLE, (_PLASTIC,)),
    "reach": (_REAL, (_SENSORY,)),
    "since": (_INT, (_SENSORY,)),
    "post": (_REAL, (_SENSORY,)),
    "post_gathered": (_REAL, (_PLASTIC, N)),
    "next_spike": (_BYTE, (_STEPS, _SENSORY)),
    "last_spike": (_INT, (_SENSORY,)),
    "spikes": (_WORD, (_STEPS * SIDES * WORDS,)),
    "counted": (_INT, (_STEPS * _GROUPS,)),
}
"""Kinds, and shapes after a first axis of brains."""
STATE: Final = tuple(name for name in NetworkArrays._fields if name in _ARRAYS)
"""What outlives a call: all of it but counts that only readers use."""

Memory: Any = struct("Memory", {k: wp.array(dtype=kind, ndim=1 + len(shape)) for k, (kind, shape) in _ARRAYS.items()})
Cell: Any = struct("Cell", fields_of(NeuronConstants))
_TABLES: Final = {"noise_amplitude": _REAL, "fading": _REAL, "population_of": _INT}
Constants: Any = struct(
    "Constants",
    {"excitatory": Cell, "inhibitory": Cell, "stretch_steps": _INT}
    | fields_of(PlasticityConstants)
    | fields_of(Wiring)
    | dict.fromkeys(Rates._fields, _DOUBLE)
    | {name: wp.array(dtype=kind) for name, kind in _TABLES.items()},
)


def constants_of(parameters: Parameters) -> Any:
    """Return a network's constants on the device."""
    made = filled(Constants(), {"stretch_steps": parameters.stretch_steps})
    made.excitatory = filled(Cell(), parameters.excitatory._asdict())
    made.inhibitory = filled(Cell(), parameters.inhibitory._asdict())
    for group in (parameters.plasticity, parameters.wiring, parameters.rates):
        filled(made, group._asdict())
    return filled(made, {k: wp.array(getattr(parameters, k), dtype=kind) for k, kind in _TABLES.items()})


def memory_of(parameters: Parameters, config: NetworkConfig, seeds: Sequence[int]) -> Any:
    """Return the networks of these seeds at rest, on the device."""
    state = {name: np.empty((len(seeds), *_ARRAYS[name][1]), wp.dtype_to_numpy(_ARRAYS[name][0])) for name in STATE}
    for brain, seed in enumerate(seeds):
        fresh = arrays_of(new_memory(parameters))
        initialise(fresh, config, seed=seed)
        for name in STATE:
            state[name][brain] = getattr(fresh, name)
    made = {name: wp.array(values) for name, values in state.items()}
    made |= {k: wp.zeros((len(seeds), *shape), dtype=kind) for k, (kind, shape) in _ARRAYS.items() if k not in made}
    return filled(Memory(), made)
