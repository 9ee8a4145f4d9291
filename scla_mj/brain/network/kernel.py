"""The compiled step of the network: neurons, then dopamine and eligibility, then spikes.

The order of the work inside one step is fixed and named (docs/model.md):
1. `gather_current`, `integrate`: the step's current, equations 1 and 2, threshold at the step's end, reset.
2. `decay`: STDP traces, dopamine and eligibility; weights gather eligibility times dopamine.
3. `sensory_spike` for each: deliver weights to the next step, depress eligibility, raise the presynaptic trace.
4. `motor_spike` for each: potentiate eligibility, raise the postsynaptic trace.
5. `_inhibit`: the fixed wiring, alike for whole populations.

Synapses are kept lazily, and looked at when their sensory neuron fires or dopamine is released: see synapses.py. The
steps of a call fall into stretches for that.

The parts are inlined into `run` by numba itself: compiled one by one they take twice as long and run a fifth slower.
"""

# No `from __future__ import annotations`: numba reads nothing from annotations, readers do.
from typing import Any, Final

import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple

from scla_mj.brain.network import rows, synapses
from scla_mj.brain.network.parameters import NeuronConstants, Parameters, PlasticityConstants, Rates, Wiring
from scla_mj.brain.network.rows import BLOCK
from scla_mj.brain.network.state import NetworkState, Neurons, Stretch, Synapses, neurons_of, synapses_of
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

_NEURON_CONSTANTS: Final = len(NeuronConstants._fields)
_PLASTICITY_CONSTANTS: Final = len(PlasticityConstants._fields)
_WIRING: Final = len(Wiring._fields)
_RATES: Final = len(Rates._fields)
_STATE: Final = len(NetworkState._fields)
_CHANGING: Final = _STATE + len(Stretch._fields)
NOT_FINITE: Final = -1
"""What `run` returns, instead of a number of spikes, where a membrane potential is no longer finite."""


@leaf_njit(inline="always")
def next_noise(low: Any, high: Any, i: int) -> Any:
    """Return lane i's next 32 random bits (xoroshiro64*, Blackman and Vigna 2018), as a signed integer.

    Every result is cast back to 32 bits: numba computes with 64, and the bits shifted out would come back.
    """
    s0 = low[i]
    s1 = np.uint32(high[i] ^ s0)
    low[i] = np.uint32(np.uint32((s0 << np.uint32(26)) | (s0 >> np.uint32(6))) ^ s1) ^ np.uint32(s1 << np.uint32(9))
    high[i] = np.uint32((s1 << np.uint32(13)) | (s1 >> np.uint32(19)))
    return np.int32(np.uint32(s0 * np.uint32(0x9E3779BB)))


@leaf_njit(inline="always")
def gather_current(neurons: Neurons, amplitude: Any, unit: Any, pulse: Any) -> None:
    """Add up this step's current: drive, the last step's spikes, noise."""
    real = neurons.synaptic.dtype.type
    for i in range(neurons.synaptic.shape[0]):
        bits = next_noise(neurons.noise_low, neurons.noise_high, i)
        neurons.synaptic[i] = neurons.drive[i] + pulse * neurons.synaptic[i] + amplitude[i] * (unit * real(bits))


@leaf_njit(inline="always")
def _advance(v: Any, u: Any, current: Any, fired: Any, cell: NeuronConstants) -> None:
    """Equations 1 and 2 for neurons of one kind: v in two half steps with the old u, then u from the new v."""
    for i in range(v.shape[0]):
        vi, ui, ci = v[i], u[i], current[i]
        vi += cell.half_step * (cell.quadratic * vi * vi + cell.linear * vi + cell.offset - ui + ci)
        vi += cell.half_step * (cell.quadratic * vi * vi + cell.linear * vi + cell.offset - ui + ci)
        ui += cell.rate * (cell.sensitivity * vi - ui)
        over = vi >= cell.peak
        fired[i] = over
        v[i] = cell.reset_v if over else vi
        u[i] = ui + cell.reset_u if over else ui


@leaf_njit(inline="always")
def integrate(neurons: Neurons, excitatory: NeuronConstants, inhibitory: NeuronConstants, split: int) -> None:
    """Equations 1 and 2 for all neurons, of which the first `split` are excitatory; leave no current behind."""
    v, u, current, fired = neurons.v, neurons.u, neurons.synaptic, neurons.fired
    # Slices that start at 0, because a loop from a start of unknown sign is not vectorised.
    _advance(v[:split], u[:split], current[:split], fired[:split], excitatory)
    _advance(v[split:], u[split:], current[split:], fired[split:], inhibitory)
    zero = current.dtype.type(0)
    for i in range(current.shape[0]):
        current[i] = zero


@leaf_njit(inline="always")
def decay(s: Synapses, p: PlasticityConstants, rates: Rates, step: int) -> None:
    """Let STDP traces, eligibility and dopamine decay; weights gather eligibility times dopamine."""
    for i in range(s.trace.shape[0]):
        s.trace[i] *= p.trace_decay
    for side in range(SIDES):
        s.decayed[side] *= rates.eligibility_decay
    for k in range(s.dopamine.shape[0]):
        if s.dopamine[k] != 0.0:
            dopamine = s.dopamine[k] * rates.dopamine_decay
            s.dopamine[k] = dopamine if abs(dopamine) >= p.floor else 0.0
            s.gathered[k] += rates.learning_rate * s.dopamine[k] * s.decayed[SENSOR_OF[k]]
            s.dosed[k] += 1
        s.course[k, step] = s.gathered[k] - s.opening[k]


@leaf_njit(inline="always")
def _add_current(synaptic: Any, population_start: Any, population: int, current: Any) -> None:
    target = synaptic[population_start[population] : population_start[population + 1]]
    for i in range(target.shape[0]):
        target[i] += current


@leaf_njit(inline="always")
def _inhibit(synaptic: Any, counts: Any, starts: Any, wiring: Wiring) -> None:
    """Motor populations excite their own inhibitory population, which inhibits the three other motor populations."""
    real = synaptic.dtype.type
    inhibition = 0
    for side in range(SIDES):
        inhibition += counts[2 * SIDES + side]
    for side in range(SIDES):
        others = inhibition - counts[2 * SIDES + side]
        if others:
            _add_current(synaptic, starts, SIDES + side, wiring.inhibitory_to_motor * real(others))
        own = counts[SIDES + side]
        if own:
            _add_current(synaptic, starts, 2 * SIDES + side, wiring.motor_to_inhibitory * real(own))


@leaf_njit(inline="always")
def _route_spikes(
    s: Synapses,
    synaptic: Any,
    p: PlasticityConstants,
    fading: Any,
    neurons: Any,
    of: Any,
    starts: Any,
    step: int,
    step_counts: Any,
) -> None:
    """Pass on this step's spikes, `neurons` in ascending order, and count them by population."""
    for population in range(step_counts.shape[0]):
        step_counts[population] = 0
    for spike in range(neurons.shape[0]):
        neuron = neurons[spike]
        population = of[neuron]
        step_counts[population] += 1
        row = neuron - starts[population]
        if population < SIDES:
            sensory_spike(s, synaptic, p, fading, population, row, step)
        elif population < 2 * SIDES:
            motor_spike(s, fading, population - SIDES, row, step)


@leaf_njit(inline="always")
def _list_spikes(fired: Any, fired_octets: Any, neurons: Any) -> int:
    """Write the indices of the neurons that fired, looking at eight at a time; return how many.

    Each of the eight is written, and overwritten by the next unless it fired: a branch on it would be guessed wrong as
    often as a neuron fires. So `neurons` needs room for one more.
    """
    count = 0
    for octet in range(fired_octets.shape[0]):
        if fired_octets[octet]:
            for neuron in range(8 * octet, 8 * octet + 8):
                neurons[count] = neuron
                count += fired[neuron]
    return count


@leaf_njit(inline="always")
def _is_finite(values: Any) -> bool:
    finite = True
    for i in range(values.shape[0]):
        finite &= np.isfinite(values[i])
    return finite


@leaf_njit(inline="always")
def unpacked(packed: Any) -> Parameters:
    """Return the parameters with names for their numbers; see `Parameters.packed`."""
    groups = Parameters(*packed)
    return Parameters(
        NeuronConstants(*to_fixed_tuple(groups.excitatory, _NEURON_CONSTANTS)),
        NeuronConstants(*to_fixed_tuple(groups.inhibitory, _NEURON_CONSTANTS)),
        PlasticityConstants(*to_fixed_tuple(groups.plasticity, _PLASTICITY_CONSTANTS)),
        Wiring(*to_fixed_tuple(groups.wiring, _WIRING)),
        Rates(*to_fixed_tuple(groups.rates, _RATES)),
        groups.population_start,
        groups.population_of,
        groups.noise_amplitude,
        groups.fading,
        groups.stretch_steps,
    )


@leaf_njit(inline="always")
def _release(s: Synapses, p: PlasticityConstants, released: Any) -> None:
    """Add to the dopamine concentrations; a sensor's synapses are settled first, since they count on its sign."""
    for side in range(SIDES):
        for connection in range(CONNECTIONS):
            if released[OUT_OF_SENSOR[side, connection]] != 0.0:
                settle(s.weight, s.scaled, s.decayed, s.gathered, s.gathered_at, p, side)
                break
    for k in range(released.shape[0]):
        s.dopamine[k] += released[k]


@cached_njit(rows, synapses, nogil=True)
def run(
    released: Any, steps: int, first_step: int, spike_step: Any, spike_neuron: Any, counts: Any, *memory: Any
) -> int:
    """Release dopamine, (8,), then advance the network by `steps` under the constant currents of its stretch's `drive`.

    Writes every spike (its step, counted from `first_step`, and its neuron) to `spike_step` and `spike_neuron`, which
    must hold N a step, and one more; adds the spikes of each population to `counts`, (12,) int64. `memory` is what
    `memory_of` returns. Returns the number of spikes, or `NOT_FINITE` where a membrane potential no longer is.
    """
    state, stretch = NetworkState(*memory[:_STATE]), Stretch(*memory[_STATE:_CHANGING])
    parameters = unpacked(memory[_CHANGING:])
    neurons, s = neurons_of(state, stretch), synapses_of(state, stretch)
    p, wiring, fading, starts = parameters.plasticity, parameters.wiring, parameters.fading, parameters.population_start
    _release(s, p, released)
    total = done = 0
    while done < steps:
        length = min(parameters.stretch_steps, steps - done)
        start = first_step + done - 1
        open_stretch(s, p, parameters.rates)
        for step in range(1, length + 1):
            gather_current(neurons, parameters.noise_amplitude, wiring.noise_unit, parameters.excitatory.pulse)
            integrate(neurons, parameters.excitatory, parameters.inhibitory, s.trace.shape[0])
            decay(s, p, parameters.rates, step)
            count = _list_spikes(state.fired, state.fired_octets, spike_neuron[total:])
            for spike in range(total, total + count):
                spike_step[spike] = start + step
            spiked = spike_neuron[total : total + count]
            _route_spikes(
                s, state.synaptic, p, fading, spiked, parameters.population_of, starts, step, state.step_counts
            )
            _inhibit(state.synaptic, state.step_counts, starts, wiring)
            for population in range(counts.shape[0]):
                counts[population] += state.step_counts[population]
            total += count
        close_stretch(s, p, fading, length)
        done += length
    return total if _is_finite(state.v) and _is_finite(state.u) else NOT_FINITE


def memory_of(state: NetworkState, stretch: Stretch, parameters: Parameters) -> tuple[Any, ...]:
    """Return what a call of the compiled loop works on, one array after another: numba takes tuples more slowly."""
    return (*state, *stretch, *parameters.packed())


@cached_njit()
def read_weights(weight: Any, scaled: Any, gathered: Any, gathered_at: Any, bounds: Any, now: Any) -> None:
    """Write the weights of now into `now`, (8, n, 100), and change nothing; `bounds`, (2,), clip them."""
    real, low, high = now.dtype.type, bounds[0], bounds[1]
    for k in range(now.shape[0]):
        for row in range(now.shape[1]):
            moved = real(gathered[k] - gathered_at[k, row])
            for j in range(BLOCK):
                now[k, row, j] = min(max(weight[k, row, j] + scaled[k, row, j] * moved, low), high)


@cached_njit()
def mean_weights(
    weight: Any,
    scaled: Any,
    gathered: Any,
    gathered_at: Any,
    bounds: Any,
    dosed: Any,
    columns: Any,
    at: Any,
    means: Any,
) -> None:
    """Write each projection's mean weight into `means`, (8,) float64, where dopamine has changed it since.

    `at`, (8,) int64, is what `dosed` was when those that are there were made. Sums by column, in the scratch array
    `columns`, (100,) float64: unlike one running sum, that vectorises.
    """
    real, low, high = weight.dtype.type, bounds[0], bounds[1]
    for k in range(means.shape[0]):
        if at[k] == dosed[k]:
            continue
        at[k] = dosed[k]
        for j in range(BLOCK):
            columns[j] = 0.0
        for row in range(weight.shape[1]):
            moved = real(gathered[k] - gathered_at[k, row])
            for j in range(BLOCK):
                columns[j] += min(max(weight[k, row, j] + scaled[k, row, j] * moved, low), high)
        total = 0.0
        for j in range(BLOCK):
            total += columns[j]
        means[k] = total / (weight.shape[1] * BLOCK)
