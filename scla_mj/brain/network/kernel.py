"""The compiled step of the network: neurons, then dopamine and eligibility, then spikes.

The order of the work inside one step is fixed and named (docs/model.md):
1. `_integrate`: the step's current, equations 1 and 2, threshold at the step's end, reset.
2. `_decay`: STDP traces, dopamine and eligibility; weights gather eligibility times dopamine.
3. `_sensory_spike` for each: deliver weights to the next step, depress eligibility, raise the presynaptic trace.
4. `_motor_spike` for each: potentiate eligibility, raise the postsynaptic trace.
5. `_inhibit`: the fixed wiring, alike for whole populations.

Eligibility c and weight w of 80,000 synapses are kept lazily. With E = `decayed` = exp(-t / tau_c) and G = `gathered`
= the sum of rate E d since the last `settle`, a synapse without spikes keeps Z = `scaled` = c / E and A = `anchor` =
w - Z G constant, so c = Z E and w = clip(A + Z G) need no work at all. This is exact while Z and d keep their signs:
a spike re-anchors its synapses, and dopamine is released only right after `settle`. E, G and d, a few numbers for
80,000 synapses, are float64 always: a thousand float32 products would lose six digits of a weight's change.

The parts are inlined into `run` by numba itself: compiled one by one they take twice as long and run a fifth slower.
"""

# No `from __future__ import annotations`: numba reads nothing from annotations, readers do.
from typing import Any, Final

import numpy as np
from numba import njit

from scla_mj.anatomy import NEURONS_PER_SIDE, PROJECTIONS
from scla_mj.brain.network.parameters import NeuronConstants, Parameters
from scla_mj.brain.network.state import NetworkState
from scla_mj.compiled import cached_njit
from scla_mj.grid import Action

_SIDES: Final = len(Action)
# A population is made of blocks of this size; a projection connects block with block, all to all.
_BLOCK: Final = NEURONS_PER_SIDE

NOT_FINITE: Final = -1
"""What `run` returns, instead of a number of spikes, where a membrane potential is no longer finite."""
_MOTOR_OF: Final = np.array([int(p.motor) for p in PROJECTIONS])
_SENSOR_OF: Final = np.array([int(p.sensor) for p in PROJECTIONS])
_OUT_OF_SENSOR: Final = np.array([[k for k, p in enumerate(PROJECTIONS) if p.sensor == side] for side in Action])
_INTO_MOTOR: Final = np.array([[k for k, p in enumerate(PROJECTIONS) if p.motor == side] for side in Action])


@njit(inline="always")
def next_noise(low: Any, high: Any, i: int) -> Any:
    """Return lane i's next 32 random bits (xoroshiro64*, Blackman and Vigna 2018), as a signed integer.

    Every result is cast back to 32 bits: numba computes with 64, and the bits shifted out would come back.
    """
    s0 = low[i]
    s1 = np.uint32(high[i] ^ s0)
    low[i] = np.uint32(np.uint32((s0 << np.uint32(26)) | (s0 >> np.uint32(6))) ^ s1) ^ np.uint32(s1 << np.uint32(9))
    high[i] = np.uint32((s1 << np.uint32(13)) | (s1 >> np.uint32(19)))
    return np.int32(np.uint32(s0 * np.uint32(0x9E3779BB)))


@njit(inline="always")
def _gather_current(state: NetworkState, parameters: Parameters, drive: Any) -> None:
    """Add up this step's current: drive, the last step's spikes, noise."""
    real = state.synaptic.dtype.type
    pulse, unit, amplitude = parameters.excitatory.pulse, parameters.noise_unit, parameters.noise_amplitude
    for i in range(drive.shape[0]):
        bits = next_noise(state.noise_low, state.noise_high, i)
        state.synaptic[i] = drive[i] + pulse * state.synaptic[i] + amplitude[i] * (unit * real(bits))


@njit(inline="always")
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


@njit(inline="always")
def _integrate(state: NetworkState, parameters: Parameters, drive: Any) -> None:
    _gather_current(state, parameters, drive)
    v, u, current, fired = state.v, state.u, state.synaptic, state.fired
    # Slices that start at 0, because a loop from a start of unknown sign is not vectorised.
    split = state.trace.shape[0]
    _advance(v[:split], u[:split], current[:split], fired[:split], parameters.excitatory)
    _advance(v[split:], u[split:], current[split:], fired[split:], parameters.inhibitory)
    for i in range(current.shape[0]):
        current[i] = parameters.plasticity.zero


@njit(inline="always")
def _decay(state: NetworkState, parameters: Parameters) -> None:
    p = parameters.plasticity
    for i in range(state.trace.shape[0]):
        trace = state.trace[i] * p.trace_decay
        state.trace[i] = trace if trace >= p.trace_floor else p.zero
    state.decayed[0] *= p.eligibility_decay
    for k in range(state.dopamine.shape[0]):
        dopamine = state.dopamine[k] * p.dopamine_decay
        state.dopamine[k] = dopamine if abs(dopamine) >= p.floor else 0.0
        state.gathered[k] += p.learning_rate * state.dopamine[k] * state.decayed[0]


@njit(inline="always")
def _sensory_spike(state: NetworkState, parameters: Parameters, neuron: int, population: int) -> None:
    """Deliver both columns of weights; depress their eligibility by the postsynaptic traces."""
    p = parameters.plasticity
    block, column = divmod(neuron - parameters.population_start[population], _BLOCK)
    real = state.anchor.dtype.type
    depression = p.depression / real(state.decayed[0])
    for connection in range(_OUT_OF_SENSOR.shape[1]):
        k = _OUT_OF_SENSOR[population, connection]
        first = parameters.population_start[_SIDES + _MOTOR_OF[k]] + block * _BLOCK
        current = state.synaptic[first : first + _BLOCK]
        trace = state.trace[first : first + _BLOCK]
        first = block * _BLOCK
        anchor, scaled = state.anchor[k, first : first + _BLOCK], state.scaled[k, first : first + _BLOCK]
        gathered = real(state.gathered[k])
        if gathered == p.zero:
            for j in range(_BLOCK):
                current[j] += anchor[j, column]
                scaled[j, column] -= depression * trace[j]
            continue
        for j in range(_BLOCK):
            weight = min(max(anchor[j, column] + scaled[j, column] * gathered, p.zero), p.weight_max)
            current[j] += weight
            scaled[j, column] -= depression * trace[j]
            anchor[j, column] = weight - scaled[j, column] * gathered
    state.trace[neuron] += 1


@njit(inline="always")
def _motor_spike(state: NetworkState, parameters: Parameters, neuron: int, population: int) -> None:
    """Potentiate both rows of eligibility by the presynaptic traces, this step's sensory spikes included."""
    p = parameters.plasticity
    row = neuron - parameters.population_start[population]
    real = state.anchor.dtype.type
    potentiation = p.potentiation / real(state.decayed[0])
    for connection in range(_INTO_MOTOR.shape[1]):
        k = _INTO_MOTOR[population - _SIDES, connection]
        first = parameters.population_start[_SENSOR_OF[k]] + row // _BLOCK * _BLOCK
        trace = state.trace[first : first + _BLOCK]
        anchor, scaled, gathered = state.anchor[k, row], state.scaled[k, row], real(state.gathered[k])
        if gathered == p.zero:
            for i in range(_BLOCK):
                scaled[i] += potentiation * trace[i]
            continue
        for i in range(_BLOCK):
            weight = min(max(anchor[i] + scaled[i] * gathered, p.zero), p.weight_max)
            scaled[i] += potentiation * trace[i]
            anchor[i] = weight - scaled[i] * gathered
    state.trace[neuron] += 1


@njit(inline="always")
def _add_current(synaptic: Any, population_start: Any, population: int, current: Any) -> None:
    target = synaptic[population_start[population] : population_start[population + 1]]
    for i in range(target.shape[0]):
        target[i] += current


@njit(inline="always")
def _inhibit(synaptic: Any, counts: Any, parameters: Parameters) -> None:
    """Motor populations excite their own inhibitory population, which inhibits the three other motor populations."""
    real = synaptic.dtype.type
    starts = parameters.population_start
    inhibition = 0
    for side in range(_SIDES):
        inhibition += counts[2 * _SIDES + side]
    for side in range(_SIDES):
        others = inhibition - counts[2 * _SIDES + side]
        if others:
            _add_current(synaptic, starts, _SIDES + side, parameters.inhibitory_to_motor * real(others))
        own = counts[_SIDES + side]
        if own:
            _add_current(synaptic, starts, 2 * _SIDES + side, parameters.motor_to_inhibitory * real(own))


@njit(inline="always")
def _route_spikes(state: NetworkState, parameters: Parameters, neurons: Any, counts: Any) -> None:
    """Pass on this step's spikes, `neurons` in ascending order, and add them to the (12,) `counts`."""
    for population in range(counts.shape[0]):
        state.step_counts[population] = 0
    for spike in range(neurons.shape[0]):
        neuron = neurons[spike]
        population = parameters.population_of[neuron]
        if population < _SIDES:
            _sensory_spike(state, parameters, neuron, population)
        elif population < 2 * _SIDES:
            _motor_spike(state, parameters, neuron, population)
        state.step_counts[population] += 1
    _inhibit(state.synaptic, state.step_counts, parameters)
    for population in range(counts.shape[0]):
        counts[population] += state.step_counts[population]


@njit(inline="always")
def _list_spikes(fired: Any, fired_octets: Any, neurons: Any) -> int:
    """Write the indices of the neurons that fired, looking at eight at a time; return how many."""
    count = 0
    for octet in range(fired_octets.shape[0]):
        if fired_octets[octet]:
            for neuron in range(8 * octet, 8 * octet + 8):
                if fired[neuron]:
                    neurons[count] = neuron
                    count += 1
    return count


@njit(inline="always")
def _is_finite(values: Any) -> bool:
    finite = True
    for i in range(values.shape[0]):
        finite &= np.isfinite(values[i])
    return finite


@njit(inline="always")
def settle(state: NetworkState, parameters: Parameters) -> None:
    """Write the lazy weights and eligibilities out: afterwards `anchor` is w and `scaled` is c."""
    p = parameters.plasticity
    real = state.anchor.dtype.type
    decayed = real(state.decayed[0])
    for k in range(state.gathered.shape[0]):
        gathered = real(state.gathered[k])
        anchor, scaled = state.anchor[k], state.scaled[k]
        for i in range(anchor.shape[0]):
            if gathered != p.zero:
                for j in range(anchor.shape[1]):
                    anchor[i, j] = min(max(anchor[i, j] + scaled[i, j] * gathered, p.zero), p.weight_max)
            for j in range(anchor.shape[1]):
                eligibility = scaled[i, j] * decayed
                scaled[i, j] = eligibility if abs(eligibility) >= p.floor else p.zero
        state.gathered[k] = 0.0
    state.decayed[0] = 1.0


@cached_njit(nogil=True)
def run(
    state: NetworkState,
    parameters: Parameters,
    drive: Any,
    steps: int,
    first_step: int,
    spike_step: Any,
    spike_neuron: Any,
    counts: Any,
) -> int:
    """Advance the network by `steps` steps under a constant `drive`, (N,), one current a neuron; then settle.

    Writes every spike (its step, counted from `first_step`, and its neuron) to `spike_step` and `spike_neuron`, which
    must hold N a step; adds the spikes of each population to `counts`, (12,) int64. Returns the number of spikes, or
    `NOT_FINITE` where a membrane potential no longer is.
    """
    total = 0
    for step in range(first_step, first_step + steps):
        _integrate(state, parameters, drive)
        _decay(state, parameters)
        count = _list_spikes(state.fired, state.fired_octets, spike_neuron[total:])
        for spike in range(total, total + count):
            spike_step[spike] = step
        _route_spikes(state, parameters, spike_neuron[total : total + count], counts)
        total += count
    settle(state, parameters)
    return total if _is_finite(state.v) and _is_finite(state.u) else NOT_FINITE


@cached_njit()
def mean_weights(anchor: Any, columns: Any, means: Any) -> None:
    """Write the mean of each projection's settled weights into `means`, (8,) float64.

    Sums by column, in the scratch array `columns`, (100,) float64: unlike one running sum, that vectorises.
    """
    for k in range(anchor.shape[0]):
        for j in range(_BLOCK):
            columns[j] = 0.0
        for i in range(anchor.shape[1]):
            for j in range(_BLOCK):
                columns[j] += anchor[k, i, j]
        total = 0.0
        for j in range(_BLOCK):
            total += columns[j]
        means[k] = total / (anchor.shape[1] * _BLOCK)
