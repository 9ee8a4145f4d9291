"""The printed network's step for Warp: the operations of scla_mj/brain/network, in the same order, in threads.

A thread has one neuron, or one motor neuron and the column of synapses onto it, so that each number is written by one
thread and added to in the CPU's order: states are the CPU's to the bit. Read synapses.py for the symbols.

A phase is done for all of a brain's threads before its next begins: `advance`, on a GPU, gives each brain a block of
threads, which wait for each other; elsewhere a phase is a launch.
"""

from __future__ import annotations

from typing import Final

import warp as wp

from benchmarks.gpu.network_arrays import WORDS, Cell, Constants, Memory
from benchmarks.gpu.network_arrays import N as _N
from scla_mj.anatomy import POPULATIONS
from scla_mj.brain.network.synapses import INTO_MOTOR, OUT_OF_SENSOR
from scla_mj.brain.network.synapses import SIDES as _SIDES

N: Final = wp.constant(_N)
SIDES: Final = wp.constant(_SIDES)
SENSORY: Final = wp.constant(_SIDES * _N)
"""The first motor neuron; as many neurons are motor neurons."""
EXCITATORY: Final = wp.constant(2 * _SIDES * _N)
PER_WORD: Final = wp.constant(WORDS)
PER_STEP: Final = wp.constant(_SIDES * WORDS)
GROUPS: Final = wp.constant(len(POPULATIONS))
INHIBITORY_PER_SIDE: Final = wp.constant(_N // 2)
CONNECTIONS: Final = wp.constant(2)
OUT: Final = wp.constant(wp.types.matrix(shape=OUT_OF_SENSOR.shape, dtype=wp.int32)(OUT_OF_SENSOR.tolist()))
INTO: Final = wp.constant(wp.types.matrix(shape=INTO_MOTOR.shape, dtype=wp.int32)(INTO_MOTOR.tolist()))
SCRAMBLER: Final = wp.constant(wp.uint32(0x9E3779BB))


@wp.func(inline=True)
def sensor_of(k: int) -> int:
    """`SENSOR_OF`."""
    return k // CONNECTIONS


@wp.func(inline=True)
def _raised(m: Memory, c: Constants, b: int, side: int, step: int) -> float:
    return c.potentiation / (c.fading[step] * wp.float32(m.decays[b, step, side]))


@wp.func(inline=True)
def after_sensory_spike(m: Memory, c: Constants, b: int, neuron: int, step: int) -> None:
    """What a sensory spike changes in its neuron, once all its synapses have been updated."""
    side = neuron // N
    m.reach[b, neuron] = m.reach[b, neuron] + _raised(m, c, b, side, step)
    m.since[b, neuron] = step
    m.trace[b, neuron] = m.trace[b, neuron] + 1.0
    for connection in range(CONNECTIONS):
        k = OUT[side, connection]
        m.gathered_at[b, k, neuron % N] = m.gathers[b, step, k]


@wp.func(inline=True)
def _noise(m: Memory, b: int, i: int) -> int:
    """`next_noise`: xoroshiro64*."""
    s0 = m.noise_low[b, i]
    s1 = m.noise_high[b, i] ^ s0
    m.noise_low[b, i] = ((s0 << wp.uint32(26)) | (s0 >> wp.uint32(6))) ^ s1 ^ (s1 << wp.uint32(9))
    m.noise_high[b, i] = (s1 << wp.uint32(13)) | (s1 >> wp.uint32(19))
    return wp.int32(s0 * SCRAMBLER)


@wp.func(inline=True)
def _slope(v: float, u: float, current: float, cell: Cell) -> float:
    return cell.half_step * (cell.quadratic * v * v + cell.linear * v + cell.offset - u + current)


@wp.func(inline=True)
def neurons(m: Memory, c: Constants, b: int, i: int, step: int) -> None:
    """Per neuron: traces decay, noise, current, equations 1 and 2, spike and reset."""
    if step > 1 and i < SENSORY and m.fired[b, i] != wp.uint8(0):
        after_sensory_spike(m, c, b, i, step - 1)
    cell = c.inhibitory
    if i < EXCITATORY:
        m.trace[b, i] = m.trace[b, i] * c.trace_decay
        cell = c.excitatory
    population = c.population_of[i]
    drive = wp.where(population == m.driven[b], m.current[b], 0.0)
    noise = c.noise_amplitude[i] * (c.noise_unit * wp.float32(_noise(m, b, i)))
    current = drive + cell.pulse * m.synaptic[b, i] + noise
    m.synaptic[b, i] = 0.0
    v = m.v[b, i]
    u = m.u[b, i]
    v = v + _slope(v, u, current, cell)
    v = wp.min(wp.max(v, -cell.limit), cell.limit)
    v = v + _slope(v, u, current, cell)
    u = u + cell.rate * (cell.sensitivity * v - u)
    over = v >= cell.peak
    m.v[b, i] = wp.where(over, cell.reset_v, v)
    m.u[b, i] = wp.where(over, u + cell.reset_u, u)
    m.fired[b, i] = wp.where(over, wp.uint8(1), wp.uint8(0))
    if over:
        wp.atomic_add(m.counted, b, step * GROUPS + population, 1)
        if i < SENSORY:
            row = i % N
            word = step * PER_STEP + population * PER_WORD + row // 32
            wp.atomic_or(m.spikes, b, word, wp.uint32(1) << wp.uint32(row % 32))


@wp.func(inline=True)
def is_still(m: Memory, b: int, k: int, row: int, step: int) -> bool:
    """`_is_still`."""
    gathered = m.gathers[b, step, k]
    return gathered == m.gathered_at[b, k, row] and gathered == m.gathers[b, 0, k]


@wp.func(inline=True)
def _replayed(m: Memory, c: Constants, b: int, k: int, row: int, motor: int, step: int) -> tuple[float, float]:
    """`_replay_doubts` of one synapse: its weight and Z, motor spike by motor spike."""
    neuron = sensor_of(k) * N + row
    opening = m.gathers[b, 0, k]
    zero = wp.float64(0.0)
    highest = wp.float64(c.weight_max)
    reach = m.reach[b, neuron]
    w = wp.float64(m.weight[b, k, row, motor % N])
    z = m.scaled[b, k, row, motor % N]
    gathered = m.gathered_at[b, k, row] - opening
    at = wp.int32(m.next_spike[b, 0, motor])
    while at != 0:
        gain = reach * c.fading[at]
        then = m.gathers[b, at, k] - opening
        if at < m.since[b, neuron]:  # what is stored is smaller by this
            w = w + wp.float64(gain) * (gathered - then)
        else:
            w = wp.min(wp.max(w + wp.float64(z) * (then - gathered), zero), highest)
            gathered = then
        z = z + gain
        at = wp.int32(m.next_spike[b, at, motor])
    w = wp.min(wp.max(w + wp.float64(z) * ((m.gathers[b, step, k] - opening) - gathered), zero), highest)
    return wp.float32(w), z


@wp.func(inline=True)
def caught_up(m: Memory, c: Constants, b: int, k: int, row: int, motor: int, step: int) -> tuple[float, float]:
    """`catch_up` of one synapse: its weight and Z."""
    w = m.weight[b, k, row, motor % N]
    z = m.scaled[b, k, row, motor % N]
    reach = m.reach[b, sensor_of(k) * N + row]
    post = m.post[b, motor]
    moved = wp.float32(m.gathers[b, step, k] - m.gathered_at[b, k, row])
    since = wp.float32(m.gathers[b, step, k] - m.gathers[b, 0, k])
    lowest = wp.where(moved > 0.0, 0.0, -wp.inf)
    highest = wp.where(moved < 0.0, c.weight_max, wp.inf)
    now = z + reach * post
    ended = w + (z * moved + reach * (since * post - m.post_gathered[b, k, motor % N]))
    turned = ended - now * moved
    margin = wp.max(wp.max(z, -now), wp.min(turned - lowest, highest - turned))
    if margin < 0.0:
        return _replayed(m, c, b, k, row, motor, step)
    return wp.min(wp.max(ended, 0.0), c.weight_max), now


@wp.func(inline=True)
def _after_motor_spike(m: Memory, c: Constants, b: int, motor: int, step: int) -> None:
    left = c.fading[step]
    m.post[b, motor] = m.post[b, motor] + left
    m.next_spike[b, m.last_spike[b, motor], motor] = wp.uint8(step)
    m.next_spike[b, step, motor] = wp.uint8(0)
    m.last_spike[b, motor] = step
    for connection in range(CONNECTIONS):
        k = INTO[motor // N, connection]
        gain = left * wp.float32(m.gathers[b, step, k] - m.gathers[b, 0, k])
        m.post_gathered[b, k, motor % N] = m.post_gathered[b, k, motor % N] + gain
    m.trace[b, SENSORY + motor] = m.trace[b, SENSORY + motor] + 1.0


@wp.func(inline=True)
def _delivered(m: Memory, c: Constants, b: int, k: int, row: int, motor: int, step: int) -> float:
    """`sensory_spike` for one of its synapses: update it, and return the weight that arrives."""
    sensor = sensor_of(k)
    j = motor % N
    post = m.post[b, motor]
    depression = c.depression / wp.float32(m.decays[b, step, sensor]) * m.trace[b, SENSORY + motor]
    raised = _raised(m, c, b, sensor, step)
    if is_still(m, b, k, row, step):
        m.scaled[b, k, row, j] = m.scaled[b, k, row, j] - (depression + raised * post)
        return m.weight[b, k, row, j]
    w, z = caught_up(m, c, b, k, row, motor, step)
    reach = m.reach[b, sensor * N + row] + raised
    since = wp.float32(m.gathers[b, step, k] - m.gathers[b, 0, k])
    m.scaled[b, k, row, j] = z - (depression + reach * post)
    m.weight[b, k, row, j] = w - reach * (since * post - m.post_gathered[b, k, j])
    return w


@wp.func(inline=True)
def route(m: Memory, c: Constants, b: int, i: int, step: int) -> None:
    """Per motor and inhibitory neuron: what this step's spikes bring it, and what its own changes."""
    if i >= SENSORY:
        own = m.counted[b, step * GROUPS + SIDES + (i - SENSORY) // INHIBITORY_PER_SIDE]
        m.synaptic[b, SENSORY + i] = c.motor_to_inhibitory * wp.float32(own)
        return
    side = i // N
    current = wp.float32(0.0)
    for connection in range(CONNECTIONS):
        k = INTO[side, connection]
        for word in range(PER_WORD):
            bits = m.spikes[b, step * PER_STEP + sensor_of(k) * PER_WORD + word]
            row = word * 32
            while bits != wp.uint32(0):
                if (bits & wp.uint32(1)) != wp.uint32(0):
                    current += _delivered(m, c, b, k, row, i, step)
                bits = bits >> wp.uint32(1)
                row += 1
    if m.fired[b, SENSORY + i] != wp.uint8(0):
        _after_motor_spike(m, c, b, i, step)
    others = wp.int32(0)
    for other in range(SIDES):
        others += wp.where(other == side, 0, m.counted[b, step * GROUPS + 2 * SIDES + other])
    m.synaptic[b, SENSORY + i] = current + c.inhibitory_to_motor * wp.float32(others)
