"""The neurons: noise, currents, equations 1 and 2, and the list of those that fired."""

# No `from __future__ import annotations`: numba reads nothing from annotations, readers do.
from typing import Any, Final

import numpy as np

from scla_mj.brain.network.parameters import NeuronConstants
from scla_mj.brain.network.rows import fill
from scla_mj.compiled import leaf_njit

_TILE: Final = 1024
"""Neurons per tile: at 29 bytes each they fit into the L1 cache (32 kB); a multiple of any vector length."""
NOT_FINITE: Final = -1
"""What `run` of a network returns instead of a number of spikes if a membrane potential is no longer finite."""


@leaf_njit(inline="always")
def next_noise(low: Any, high: Any, i: int) -> Any:
    """Return neuron i's next 32 random bits (xoroshiro64*, Blackman and Vigna 2018), as a signed integer.

    Every result is cast back to 32 bits: numba computes with 64, and would keep the bits shifted out.
    """
    s0 = low[i]
    s1 = np.uint32(high[i] ^ s0)
    low[i] = np.uint32(np.uint32((s0 << np.uint32(26)) | (s0 >> np.uint32(6))) ^ s1) ^ np.uint32(s1 << np.uint32(9))
    high[i] = np.uint32((s1 << np.uint32(13)) | (s1 >> np.uint32(19)))
    return np.int32(np.uint32(s0 * np.uint32(0x9E3779BB)))


@leaf_njit(inline="always")
def gather_current(current: Any, drive: Any, low: Any, high: Any, amplitude: Any, unit: Any, pulse: Any) -> None:
    """Add up this step's current: drive, the last step's spikes, noise."""
    real = current.dtype.type
    for i in range(current.shape[0]):
        bits = next_noise(low, high, i)
        current[i] = drive[i] + pulse * current[i] + amplitude[i] * (unit * real(bits))


@leaf_njit(inline="always")
def constants_of(cell: Any) -> NeuronConstants:
    """Return a record's numbers, read once: a loop that stores would read them again for every neuron."""
    return NeuronConstants(
        cell.quadratic,
        cell.linear,
        cell.offset,
        cell.half_step,
        cell.limit,
        cell.pulse,
        cell.peak,
        cell.rate,
        cell.sensitivity,
        cell.reset_v,
        cell.reset_u,
    )


@leaf_njit(inline="always")
def next_state(v: Any, u: Any, current: Any, c: NeuronConstants) -> tuple[Any, Any, bool]:
    """Equations 1 and 2: v in two half steps with the old u, then u from the new v; reset, and whether it fired."""
    v += c.half_step * (c.quadratic * v * v + c.linear * v + c.offset - u + current)
    v = min(max(v, -c.limit), c.limit)
    v += c.half_step * (c.quadratic * v * v + c.linear * v + c.offset - u + current)
    u += c.rate * (c.sensitivity * v - u)
    over = v >= c.peak
    return c.reset_v if over else v, u + c.reset_u if over else u, over


@leaf_njit(inline="always")
def _advance(v: Any, u: Any, current: Any, fired: Any, cell: Any) -> None:
    """Advance neurons of one kind by one step."""
    constants = constants_of(cell)
    for i in range(v.shape[0]):
        v[i], u[i], fired[i] = next_state(v[i], u[i], current[i], constants)


@leaf_njit(inline="always")
def integrate(m: Any) -> None:
    """Advance all neurons by one step, and reset their synaptic currents.

    The loops run tile by tile, so that in a large network what one loop has loaded is still in the cache for the next.
    """
    unit, zero = m.wiring.noise_unit, m.v.dtype.type(0)
    start, split, total = 0, m.trace.shape[0], m.v.shape[0]
    while start < total:
        cell = m.excitatory if start < split else m.inhibitory
        stop = min(start + _TILE, split if start < split else total)
        # Slices that start at 0, because a loop from a start of unknown sign is not vectorised.
        current = m.synaptic[start:stop]
        low, high = m.noise_low[start:stop], m.noise_high[start:stop]
        gather_current(current, m.drive[start:stop], low, high, m.noise_amplitude[start:stop], unit, cell.pulse)
        _advance(m.v[start:stop], m.u[start:stop], current, m.fired[start:stop], cell)
        fill(current, zero)
        start = stop


@leaf_njit(inline="always")
def list_spikes(fired: Any, fired_octets: Any, neurons: Any) -> int:
    """Write the indices of the neurons that fired, testing eight at a time; return how many.

    Each of the eight is written, and overwritten by the next unless it fired: a branch would be mispredicted as often
    as a neuron fires. So `neurons` needs room for one more.
    """
    count = 0
    for octet in range(fired_octets.shape[0]):
        if fired_octets[octet]:
            for neuron in range(8 * octet, 8 * octet + 8):
                neurons[count] = neuron
                count += fired[neuron]
    return count


@leaf_njit(inline="always")
def is_finite(values: Any) -> bool:
    """Return whether all values are finite."""
    finite = True
    for i in range(values.shape[0]):
        finite &= np.isfinite(values[i])
    return finite
