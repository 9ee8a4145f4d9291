"""The compiled step of the network: neurons, then dopamine and eligibility, then spikes.

The order of the work inside one step is fixed and named (docs/model.md):
1. `integrate`: the step's current, equations 1 and 2, threshold at the step's end, reset.
2. `decay`: STDP traces, dopamine and eligibility; weights gather eligibility times dopamine.
3. `sensory_spike` for each: deliver weights to the next step, depress eligibility, raise the presynaptic trace.
4. `motor_spike` for each: potentiate eligibility, raise the postsynaptic trace.
5. `_inhibit`: the fixed wiring, alike for whole populations.

Synapses are kept lazily, and looked at when their sensory neuron fires or dopamine is released: see synapses.py. The
steps of a call fall into stretches for that.

Parts that take a tuple of arrays are inlined by numba itself, since a call would copy it; those that take a few arrays
are compiled once and left to the compiler. Tuples are kept small: it is they that take time to compile.
"""

# No `from __future__ import annotations`: numba reads nothing from annotations, readers do.
from typing import Any, Final

from numba.np.unsafe.ndarray import to_fixed_tuple

from scla_mj.brain.network import neurons, rows, synapses
from scla_mj.brain.network.neurons import integrate, is_finite, list_spikes
from scla_mj.brain.network.parameters import NeuronConstants, Parameters, PlasticityConstants, Rates, Wiring
from scla_mj.brain.network.state import NetworkState, Stretch, Synapses, neurons_of, synapses_of
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
    spiked: Any,
    of: Any,
    starts: Any,
    step: int,
    step_counts: Any,
) -> None:
    """Pass on this step's spikes, `spiked` in ascending order, and count them by population."""
    for population in range(step_counts.shape[0]):
        step_counts[population] = 0
    for spike in range(spiked.shape[0]):
        neuron = spiked[spike]
        population = of[neuron]
        step_counts[population] += 1
        row = neuron - starts[population]
        if population < SIDES:
            sensory_spike(s, synaptic, p, fading, population, row, step)
        elif population < 2 * SIDES:
            motor_spike(s, fading, population - SIDES, row, step)


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


@cached_njit(neurons, rows, synapses, nogil=True)
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
    n, s = neurons_of(state, stretch), synapses_of(state, stretch)
    excitatory, inhibitory = parameters.excitatory, parameters.inhibitory
    p, wiring, fading, starts = parameters.plasticity, parameters.wiring, parameters.fading, parameters.population_start
    _release(s, p, released)
    total = done = 0
    while done < steps:
        length = min(parameters.stretch_steps, steps - done)
        start = first_step + done - 1
        open_stretch(s, p, parameters.rates)
        for step in range(1, length + 1):
            integrate(n, parameters.noise_amplitude, wiring.noise_unit, excitatory, inhibitory, s.trace.shape[0])
            decay(s, p, parameters.rates, step)
            count = list_spikes(state.fired, state.fired_octets, spike_neuron[total:])
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
    return total if is_finite(state.v) and is_finite(state.u) else NOT_FINITE


def memory_of(state: NetworkState, stretch: Stretch, parameters: Parameters) -> tuple[Any, ...]:
    """Return what a call of the compiled loop works on, one array after another: numba takes tuples more slowly."""
    return (*state, *stretch, *parameters.packed())
