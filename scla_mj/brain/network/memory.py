"""The network's memory: one record, with a place for everything that the compiled code reads and writes.

A compiled function that takes one record takes one pointer, and knows where everything lies and how large it is; forty
arrays would be copied from call to call, and the compiler would spend most of its time on them.

Arrays that a loop walks through together lie apart from one another as far as the processor's caches look. A processor
first compares the last 12 bits of addresses: of arrays whose places differ by whole pages it takes a load from one for
a load of what was just stored to another, and waits; a network ms then costs up to a third more.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import MOTOR, NEURONS_PER_SIDE, POPULATIONS, PROJECTIONS, SENSORY, populations_of
from scla_mj.brain.network.parameters import STRETCH_STEPS, Parameters

PAGE_BYTES: Final = 4096
STAGGER_BYTES: Final = 576
"""Seven arrays share a page at this distance; each begins with a cache line (64 bytes), as the widest loads want."""
WALKED_TOGETHER: Final = ("v", "u", "synaptic", "noise_low", "noise_high", "fired", "drive", "noise_amplitude")
"""What the loops over neurons (neurons.py) walk through."""
_LINE_BYTES: Final = 64
_SMALL_BYTES: Final = 512
"""Up to here arrays are no loop's load, and lie side by side."""

Memory = NDArray[np.void]
"""An array of one record, (1,): numba takes it faster than the record itself."""


def new_memory(parameters: Parameters) -> Memory:
    """Return the memory of a network: its parameters in their places, and zero everywhere else."""
    memory = _zeros(_layout(parameters))
    for name, value in parameters._asdict().items():
        memory[name] = value
    return memory


def copy_of(memory: Memory) -> Memory:
    """Return a copy, placed alike."""
    copy = _zeros(memory.dtype)
    copy.view(np.uint8)[:] = memory.view(np.uint8)
    return copy


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
    """Return the fields of a network's state; `state.NetworkState` says what they mean."""
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
    """Return the fields that a stretch of at most `STRETCH_STEPS` steps keeps (synapses.py); none outlives it.

    `drive`, (N,) R, is the current into each neuron from outside. `reach`, (4 n,) R, and `since`, (4 n,) int64: by
    sensory neuron, A+ x / E and the step of its last spike. `post`, (4 n,) R, by motor neuron, and `post_gathered`,
    (8, n) R, by projection and motor neuron: sums over the motor neuron's spikes. `next_spike`, (steps + 1, 4 n), says
    in which step a motor neuron fired after the one in that step, from 0 on, and 0 if it did not; `last_spike`, (4 n,),
    in which it did last. `opening`, (8,), and `course`, (8, steps + 1), float64: `gathered` when the stretch began, and
    how far it has come since at each step. `table` is where one row is worked out (rows.py), fields of (100,) R, with
    `margin_bits`, the memory of `margin` as integers of 64 bits; `columns`, (100,) float64, is where rows are added up
    (readers.py).
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
    }


def _table(real: np.dtype[Any]) -> np.dtype[np.void]:
    row = np.dtype((real, NEURONS_PER_SIDE))
    formats = {"weight": row, "scaled": row, "margin": row, "margin_bits": np.dtype((np.uint64, row.itemsize // 8))}
    places = [0, row.itemsize, 2 * row.itemsize, 2 * row.itemsize]
    return np.dtype({"names": list(formats), "formats": list(formats.values()), "offsets": places}, True)


def _constant(parameters: Parameters) -> dict[str, Any]:
    """Return the fields of `Parameters`, each like what stands there: groups of numbers are records."""
    fields: dict[str, Any] = {}
    for name, value in parameters._asdict().items():
        if isinstance(value, tuple):
            names = value._fields  # type: ignore[attr-defined]
            fields[name] = np.dtype([(part, np.dtype(type(number))) for part, number in zip(names, value, strict=True)])
        else:
            fields[name] = (np.asarray(value).dtype, np.shape(value))
    return fields


def _zeros(layout: np.dtype[np.void]) -> Memory:
    """Return a record of zeros that begins with a page."""
    memory = np.zeros(layout.itemsize + PAGE_BYTES, np.uint8)
    start = -memory.ctypes.data % PAGE_BYTES
    record: Memory = memory[start : start + layout.itemsize].view(layout)
    return record
