"""The compiled step of the network: neurons, then dopamine and eligibility, then spikes.

The order of the work inside one step is fixed and named (docs/model.md):
1. `integrate`: the step's current, equations 1 and 2, threshold at the step's end, reset.
2. `decay`: STDP traces, dopamine and eligibility; weights gather eligibility times dopamine.
3. `sensory_spike` for each spike: deliver weights to the next step, depress eligibility, raise the presynaptic trace.
4. `motor_spike` for each spike: potentiate eligibility, raise the postsynaptic trace.
5. `_inhibit`: the fixed wiring, equal for whole populations.

Synapses are updated lazily, when their sensory neuron fires or dopamine is released (synapses.py); for that the steps
of a call are divided into stretches.

`m` is the network's memory, one record (memory.py).
"""

# No `from __future__ import annotations`: numba reads nothing from annotations, readers do.
from typing import Any

from scla_mj.brain.network import neurons, rows, synapses
from scla_mj.brain.network.neurons import NOT_FINITE, integrate, is_finite, list_spikes
from scla_mj.brain.network.synapses import (
    CONNECTIONS,
    OUT_OF_SENSOR,
    SENSOR_OF,
    SIDES,
    close_stretch,
    motor_spike,
    open_stretch,
    sensory_spike,
    settle,
)
from scla_mj.compiled import cached_njit, leaf_njit


@leaf_njit(inline="always")
def decay(m: Any, step: int) -> None:
    """Let STDP traces, eligibility and dopamine decay; weights gather eligibility times dopamine."""
    trace_decay, lower_bound = m.plasticity.trace_decay, m.plasticity.lower_bound
    for i in range(m.trace.shape[0]):
        m.trace[i] *= trace_decay
    for side in range(SIDES):
        m.decayed[side] *= m.rates.eligibility_decay
    for k in range(m.dopamine.shape[0]):
        if m.dopamine[k] != 0.0:
            dopamine = m.dopamine[k] * m.rates.dopamine_decay
            m.dopamine[k] = dopamine if abs(dopamine) >= lower_bound else 0.0
            m.gathered[k] += m.rates.learning_rate * m.dopamine[k] * m.decayed[SENSOR_OF[k]]
            m.dosed[k] += 1
        m.course[k, step] = m.gathered[k] - m.opening[k]


@leaf_njit(inline="always")
def _add_current(m: Any, population: int, current: Any) -> None:
    target = m.synaptic[m.population_start[population] : m.population_start[population + 1]]
    for i in range(target.shape[0]):
        target[i] += current


@leaf_njit(inline="always")
def _inhibit(m: Any) -> None:
    """Motor populations excite their own inhibitory population, which inhibits the three other motor populations."""
    real, counts = m.synaptic.dtype.type, m.step_counts
    inhibition = 0
    for side in range(SIDES):
        inhibition += counts[2 * SIDES + side]
    for side in range(SIDES):
        others = inhibition - counts[2 * SIDES + side]
        if others:
            _add_current(m, SIDES + side, m.wiring.inhibitory_to_motor * real(others))
        own = counts[SIDES + side]
        if own:
            _add_current(m, 2 * SIDES + side, m.wiring.motor_to_inhibitory * real(own))


@leaf_njit(inline="always")
def _route_spikes(m: Any, spiked: Any, step: int) -> None:
    """Deliver this step's spikes, the neurons `spiked` in ascending order, and count them per population."""
    for population in range(m.step_counts.shape[0]):
        m.step_counts[population] = 0
    for spike in range(spiked.shape[0]):
        neuron = spiked[spike]
        population = int(m.population_of[neuron])
        m.step_counts[population] += 1
        row = neuron - m.population_start[population]
        if population < SIDES:
            sensory_spike(m, population, row, step)
        elif population < 2 * SIDES:
            motor_spike(m, population - SIDES, row, step)


@leaf_njit(inline="always")
def _watch(m: Any, step: int) -> None:
    """Keep the watched neurons' potentials after a step of the window, from 0: the peak where one fired."""
    if step < m.potentials.shape[0]:
        for i in range(m.watched.shape[0]):
            neuron = m.watched[i]
            m.potentials[step, i] = m.excitatory.peak if m.fired[neuron] else m.v[neuron]


@leaf_njit(inline="always")
def _release(m: Any, released: Any) -> None:
    """Add to the dopamine concentrations; a sensor's synapses are settled first, since they rely on its sign."""
    for side in range(SIDES):
        for connection in range(CONNECTIONS):
            if released[OUT_OF_SENSOR[side, connection]] != 0.0:
                settle(m, side)
                break
    for k in range(released.shape[0]):
        m.dopamine[k] += released[k]


@cached_njit(neurons, rows, synapses, nogil=True)
def run(
    memory: Any,
    drive: Any,
    released: Any,
    steps: int,
    first_step: int,
    spike_step: Any,
    spike_neuron: Any,
    filled: int,
    counts: Any,
) -> int:
    """Release dopamine, (8,), then advance the network by `steps` under constant currents, (N,).

    Writes every spike (its step, counted from `first_step`, and its neuron) to `spike_step` and `spike_neuron`, after
    the first `filled`: there must be room for N per step, and one more. Adds the spikes of each population to `counts`,
    (12,) int64. Returns how many are filled then, or `NOT_FINITE` if a membrane potential is no longer finite.
    """
    m = memory[0]
    for i in range(m.drive.shape[0]):
        m.drive[i] = drive[i]
    _release(m, released)
    total, done = filled, 0
    while done < steps:
        length = min(m.stretch_steps, steps - done)
        start = first_step + done - 1
        open_stretch(m)
        for step in range(1, length + 1):
            integrate(m)
            _watch(m, start + step)
            decay(m, step)
            count = list_spikes(m.fired, m.fired_octets, spike_neuron[total:])
            for spike in range(total, total + count):
                spike_step[spike] = start + step
            _route_spikes(m, spike_neuron[total : total + count], step)
            _inhibit(m)
            for population in range(counts.shape[0]):
                counts[population] += m.step_counts[population]
            total += count
        close_stretch(m, length)
        done += length
    return total if is_finite(m.v) and is_finite(m.u) else NOT_FINITE
