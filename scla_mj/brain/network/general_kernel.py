"""The compiled step of any network that a description gives (description.py), for any rule (rules.py).

The order of the work inside one step is the one of docs/model.md:
1. `_integrate`: what arrives now, the drive and the noise make the current; equations of the neurons; reset.
2. `_decay`: traces and modulators decay; a modulator's course goes on, from which weights follow when next touched.
3. `presynaptic` for each spike: deliver weights to the step in which they arrive, `on_pre`, then raise x.
4. `postsynaptic` for each spike: `on_post`, then raise y.
5. `_uniform`: fixed projections that are equal for whole populations. Modulators that are fed by spikes rise.
6. `_watch`: monitors read what they ask for, and change nothing.

Synapses are updated lazily (general_synapses.py). `m` is the network's memory (wiring.py).
"""

# No `from __future__ import annotations`: numba reads nothing from annotations, readers do.
from collections.abc import Callable
from typing import Any, Final

from scla_mj.brain.network import general_synapses, neurons, prefetch, rows
from scla_mj.brain.network.general_synapses import (
    NOW,
    STEP,
    TRACES_OF,
    fetch_into,
    fetch_out,
    postsynaptic,
    presynaptic,
    settle,
    state_of,
)
from scla_mj.brain.network.neurons import (
    NOT_FINITE,
    constants_of,
    gather_current,
    is_finite,
    list_spikes,
    next_state,
)
from scla_mj.brain.network.rows import fill
from scla_mj.compiled import cached_njit, leaf_njit

IZHIKEVICH: Final = 0
LIF: Final = 1
V: Final = 0
U: Final = 1
PRE_TRACE: Final = 2
POST_TRACE: Final = 3
ELIGIBILITY: Final = 4
WEIGHT: Final = 5


@leaf_njit()
def _izhikevich(v: Any, u: Any, current: Any, fired: Any, cell: Any) -> None:
    """Equations 1 and 2."""
    constants = constants_of(cell)
    for i in range(v.shape[0]):
        v[i], u[i], fired[i] = next_state(v[i], u[i], current[i], constants)


@leaf_njit()
def _leaky(v: Any, u: Any, current: Any, fired: Any, cell: Any) -> None:
    """Leaky integrate-and-fire, exact for a current constant over the step; u counts refractory steps."""
    zero, one = v.dtype.type(0), v.dtype.type(1)
    rest, keep, gain, peak, reset, refractory = cell.rest, cell.keep, cell.gain, cell.peak, cell.reset_v, cell.reset_u
    for i in range(v.shape[0]):
        free = u[i] <= zero
        then = rest + (v[i] - rest) * keep + gain * current[i]
        over = free and then >= peak
        v[i] = reset if over or not free else then
        u[i] = refractory if over else max(u[i] - one, zero)
        fired[i] = over


@leaf_njit(inline="always")
def _integrate(m: Any) -> None:
    """Advance all neurons by one step, and empty the slot of currents that arrived in it."""
    slot = m.clock[STEP] % m.arriving.shape[0]
    zero = m.v.dtype.type(0)
    for k in range(m.populations.shape[0]):
        cell = m.populations[k]
        start, stop = cell.start, cell.stop
        current = m.arriving[slot, start:stop]
        if cell.lasting != zero:
            lasting = m.lasting[start:stop]
            for i in range(lasting.shape[0]):
                lasting[i] = current[i] = cell.lasting * lasting[i] + current[i]
        low, high = m.noise_low[start:stop], m.noise_high[start:stop]
        drive, amplitude = m.drive[start:stop], m.noise_amplitude[start:stop]
        gather_current(current, drive, low, high, amplitude, cell.noise_unit, cell.pulse)
        if cell.kind == IZHIKEVICH:
            _izhikevich(m.v[start:stop], m.u[start:stop], current, m.fired[start:stop], cell)
        else:
            _leaky(m.v[start:stop], m.u[start:stop], current, m.fired[start:stop], cell)
        fill(current, zero)


@leaf_njit()
def _fade(traces: Any, decays: Any, lower_bound: Any) -> None:
    """Let traces decay; negligible ones become zero, as subnormal numbers are slow."""
    zero = traces.dtype.type(0)
    for t in range(traces.shape[0]):
        decay, row = decays[t], traces[t]
        for i in range(row.shape[0]):
            left = row[i] * decay
            row[i] = left if left >= lower_bound else zero


@leaf_njit(inline="always")
def _decay(m: Any, follow: Any) -> None:
    """Let traces, modulators and eligibility decay, and the sums of eligibility times modulator grow."""
    _fade(m.pre_traces, m.pre_decay, m.trace_bound)
    _fade(m.post_traces, m.post_decay, m.trace_bound)
    for k in range(m.modulators.shape[0]):
        modulator = m.modulators[k]
        above = (modulator.level - modulator.baseline) * modulator.decay
        modulator.level = modulator.baseline + (above if abs(above) >= modulator.lower_bound else 0.0)
    if m.clock[NOW] == m.gathered.shape[1] - 1:
        for k in range(m.courses.shape[0]):
            settle(m, k, m.clock[NOW], m.courses[k].decayed, True, follow)
            m.courses[k].decayed = 1.0
            m.gathered[k, 0] = 0.0
        m.clock[NOW] = 0
    now = m.clock[NOW]
    for k in range(m.courses.shape[0]):
        course = m.courses[k]
        level = m.modulators[course.modulator].level
        if level * course.sign < 0.0:
            settle(m, k, now, course.decayed, False, follow)
        if level != 0.0:
            course.sign = level
        course.decayed *= course.decay
        m.gathered[k, now + 1] = m.gathered[k, now] + level * course.decayed
    m.clock[NOW] = now + 1


@leaf_njit(inline="always")
def _uniform(m: Any) -> None:
    """Deliver the spikes of fixed projections that are equal for whole populations; modulators rise with spikes."""
    for k in range(m.projections.shape[0]):
        projection = m.projections[k]
        count = m.step_counts[projection.source]
        if projection.uniform and count:
            target = m.populations[projection.target]
            slot = (m.clock[STEP] + projection.delay) % m.arriving.shape[0]
            arriving = m.arriving[slot, target.start : target.stop]
            current = projection.weight * type(projection.weight)(count)
            for i in range(arriving.shape[0]):
                arriving[i] += current
    for k in range(m.modulators.shape[0]):
        modulator = m.modulators[k]
        if modulator.source >= 0:
            modulator.level += modulator.per_spike * m.step_counts[modulator.source]


@leaf_njit(inline="always")
def _watch(m: Any, monitors: Any, watched: Any, seen: Any, follow: Any) -> None:
    """Write what the monitors ask for after this step into `seen`."""
    for k in range(monitors.shape[0]):
        monitor = monitors[k]
        if m.clock[STEP] % monitor.every:
            continue
        for place in range(monitor.first, monitor.last):
            seen[monitor.at] = _value(m, monitor.variable, monitor.part, watched[place], follow)
            monitor.at += 1


@leaf_njit()
def _value(m: Any, variable: int, part: int, index: int, follow: Any) -> float:
    if variable == V:
        return float(m.v[index])
    if variable == U:
        return float(m.u[index])
    if variable == PRE_TRACE:
        return float(m.pre_traces[part, index])
    if variable == POST_TRACE:
        return float(m.post_traces[part, index])
    synapse, projection = m.synapses[index], m.projections[part]
    if projection.course < 0:
        return float(synapse.weight) if variable == WEIGHT else 0.0
    limits, p, k = m.limits[projection.rule], m.parameters[projection.rule], projection.course
    decayed = m.v.dtype.type(m.courses[k].decayed)
    w, c = state_of(synapse, m.gathered[k], m.clock[NOW], decayed, limits.low, limits.high, p, follow)
    return float(w) if variable == WEIGHT else float(c)


def build(functions: tuple[Callable[..., Any], ...], traces: tuple[int, int], code: str) -> tuple[Any, Any]:
    """Return `run` and `read` for a rule's functions and numbers of traces; `code` tells it from others."""
    on_pre, on_post, follow = functions
    pre_of, post_of = (TRACES_OF[number - 1] for number in traces)

    def run(
        m: Any, steps: int, spike_step: Any, spike_neuron: Any, filled: int, counts: Any, first_step: int, watch: Any
    ) -> int:
        """Advance by `steps` as kernel.run does; `watch` has the monitors, whom they watch, and room for it."""
        total = filled
        for step in range(first_step, first_step + steps):
            _integrate(m)
            _decay(m, follow)
            count = list_spikes(m.fired, m.fired_octets, spike_neuron[total:])
            spiked = spike_neuron[total : total + count]
            fill(m.step_counts, 0)
            for spike in range(count):
                neuron = spiked[spike]
                if spike + 1 < count:
                    fetch_out(m, spiked[spike + 1])
                m.step_counts[m.population_of[neuron]] += 1
                presynaptic(m, neuron, on_pre, follow, pre_of, post_of)
            for spike in range(count):
                neuron = spiked[spike]
                if spike + 1 < count:
                    fetch_into(m, spiked[spike + 1])
                postsynaptic(m, neuron, on_post, follow, pre_of, post_of)
            _uniform(m)
            for population in range(counts.shape[0]):
                counts[population] += m.step_counts[population]
            for spike in range(total, total + count):
                spike_step[spike] = step
            total += count
            m.clock[STEP] += 1
            _watch(m, watch[0], watch[1], watch[2], follow)
        return total if is_finite(m.v) and is_finite(m.u) else NOT_FINITE

    def read(m: Any, variable: int, part: int, first: int, values: Any) -> None:
        """Write the weights or eligibilities of a projection's synapses, from its `first` on, into `values`."""
        for i in range(values.shape[0]):
            values[i] = _value(m, variable, part, first + i, follow)

    compiled = cached_njit(general_synapses, neurons, prefetch, rows, code=code, nogil=True)
    return compiled(run), compiled(read)
