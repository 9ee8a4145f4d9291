"""The compiled step of any network that a description gives (description.py), for any rule (rules.py).

The order of the work inside one step is the one of docs/model.md:
1. `_integrate`: what arrives now, the drive and the noise make the current; equations of the neurons; reset.
2. `_decay`: traces and modulators decay; a modulator's course goes on, from which weights follow when next touched.
3. `_presynaptic` for each spike: deliver weights to the step in which they arrive, `on_pre`, then raise x.
4. `_postsynaptic` for each spike: `on_post`, then raise y.
5. `_uniform`: fixed projections that are equal for whole populations. Modulators that are fed by spikes rise.
6. `_watch`: monitors read what they ask for, and change nothing.

A plastic synapse is touched only when one of its neurons fires. Until then its eligibility c decays, and its weight
follows the dose, the sum of c m over the steps, m the modulator. With E = `decayed` = exp(-t / tau_c) since the last
`_rebase`, Z = `scaled` = c / E does not change between two spikes, so that the dose is Z (G - G then), where G =
`gathered` = the sum of E m. As c and m keep their sign between two updates (`_settle` sees to that), a weight moves one
way only, and clipping it at the end equals clipping it in every step. E and G are float64 always.

`m` is the network's memory (wiring.py).
"""

# No `from __future__ import annotations`: numba reads nothing from annotations, readers do.
from collections.abc import Callable
from typing import Any, Final

from scla_mj.brain.network import neurons, rows
from scla_mj.brain.network.neurons import constants_of, gather_current, is_finite, list_spikes, next_state
from scla_mj.brain.network.prefetch import prefetch
from scla_mj.brain.network.rows import fill
from scla_mj.compiled import cached_njit, leaf_njit

_AHEAD: Final = 16
"""Synapses onto a neuron lie apart: in a large network each would be waited for."""
NOT_FINITE: Final = -1
"""What `run` returns instead of a number of spikes if a membrane potential is no longer finite."""
IZHIKEVICH: Final = 0
LIF: Final = 1
STEP: Final = 0
NOW: Final = 1
"""Places in `clock`: the steps since the network began, and since the last `_rebase`."""
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


@leaf_njit()
def _state_of(synapse: Any, gathered: Any, now: int, decayed: Any, low: Any, high: Any, p: Any, follow: Any) -> Any:
    """Return a synapse's weight and eligibility now; nothing is changed."""
    scaled = synapse.scaled
    dose = scaled * type(scaled)(gathered[now] - gathered[synapse.at])
    return min(max(type(scaled)(follow(synapse.weight, dose, p)), low), high), scaled * decayed


@leaf_njit()
def _keep(synapse: Any, w: Any, c: Any, now: int, grown: Any, low: Any, high: Any) -> None:
    """Store a synapse's weight, clipped, and eligibility as those of now; `grown` is 1 / E."""
    synapse.weight = min(max(type(synapse.weight)(w), low), high)
    synapse.scaled = type(synapse.scaled)(c) * grown
    synapse.at = now


@leaf_njit()
def _settle(m: Any, course: int, then: int, decayed: float, restart: bool, follow: Any) -> None:
    """Bring all synapses of a course to step `then`, when E was `decayed`; with `restart` E is 1 from now on."""
    real, gathered = m.v.dtype.type, m.gathered[course]
    grown, now = (real(1.0), 0) if restart else (real(1.0 / decayed), then)
    for k in range(m.projections.shape[0]):
        projection = m.projections[k]
        if projection.course != course:
            continue
        limits, p = m.limits[projection.rule], m.parameters[projection.rule]
        for s in range(projection.first_synapse, projection.last_synapse):
            synapse = m.synapses[s]
            w, c = _state_of(synapse, gathered, then, real(decayed), limits.low, limits.high, p, follow)
            _keep(synapse, w, c if abs(c) >= limits.lower_bound else real(0), now, grown, limits.low, limits.high)


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
            _settle(m, k, m.clock[NOW], m.courses[k].decayed, True, follow)
            m.courses[k].decayed = 1.0
            m.gathered[k, 0] = 0.0
        m.clock[NOW] = 0
    now = m.clock[NOW]
    for k in range(m.courses.shape[0]):
        course = m.courses[k]
        level = m.modulators[course.modulator].level
        if level * course.sign < 0.0:
            _settle(m, k, now, course.decayed, False, follow)
        if level != 0.0:
            course.sign = level
        course.decayed *= course.decay
        m.gathered[k, now + 1] = m.gathered[k, now] + level * course.decayed
    m.clock[NOW] = now + 1


@leaf_njit()
def _one(traces: Any, t: int, i: int) -> Any:
    return (traces[t, i],)


@leaf_njit()
def _two(traces: Any, t: int, i: int) -> Any:
    return traces[t, i], traces[t + 1, i]


@leaf_njit()
def _three(traces: Any, t: int, i: int) -> Any:
    return traces[t, i], traces[t + 1, i], traces[t + 2, i]


_TRACES_OF: Final = (_one, _two, _three)
"""By their number less one: what returns the traces of neuron i from row t on."""


@leaf_njit(inline="always")
def _raise(traces: Any, first: int, last: int, neuron: int, kept: Any) -> None:
    for t in range(first, last):
        traces[t, neuron] = kept * traces[t, neuron] + traces.dtype.type(1)


@leaf_njit()
def _fetch(rows: Any, items: Any, row: int) -> None:
    first, last = rows[row], rows[row + 1]
    for item in range(first, min(last, first + 2 * _AHEAD), 4):
        prefetch(items, item)


@leaf_njit(inline="always")
def _fetch_out(m: Any, neuron: int) -> None:
    population = m.populations[m.population_of[neuron]]
    for o in range(population.first_out, population.last_out):
        _fetch(m.rows, m.synapses, m.projections[m.out[o]].first_row + neuron - population.start)


@leaf_njit(inline="always")
def _fetch_into(m: Any, neuron: int) -> None:
    population = m.populations[m.population_of[neuron]]
    for o in range(population.first_in, population.last_in):
        _fetch(m.columns, m.onto, m.projections[m.into[o]].first_column + neuron - population.start)


@leaf_njit(inline="always")
def _presynaptic(m: Any, neuron: int, on_pre: Any, follow: Any, pre_of: Any, post_of: Any) -> None:
    """Deliver a neuron's weights and let `on_pre` change its plastic synapses; then raise its traces."""
    population = m.populations[m.population_of[neuron]]
    real, now = m.v.dtype.type, m.clock[NOW]
    for o in range(population.first_out, population.last_out):
        projection = m.projections[m.out[o]]
        arriving = m.arriving[(m.clock[STEP] + projection.delay) % m.arriving.shape[0]]
        row = projection.first_row + neuron - population.start
        first, last = m.rows[row], m.rows[row + 1]
        if projection.course < 0:
            for s in range(first, last):
                arriving[m.synapses[s].target] += m.synapses[s].weight
            continue
        limits, p, course = m.limits[projection.rule], m.parameters[projection.rule], m.courses[projection.course]
        gathered, decayed, grown = m.gathered[projection.course], real(course.decayed), real(1.0 / course.decayed)
        low, high, first_x, first_y = limits.low, limits.high, limits.first_x, limits.first_y
        x = pre_of(m.pre_traces, first_x, neuron)
        for s in range(first, last):
            prefetch(m.synapses, s + 2 * _AHEAD)
            synapse = m.synapses[s]
            w, c = _state_of(synapse, gathered, now, decayed, low, high, p, follow)
            arriving[synapse.target] += w
            w, c = on_pre(w, c, x, post_of(m.post_traces, first_y, synapse.target), p)
            _keep(synapse, w, c, now, grown, low, high)
    for limits in m.limits:
        _raise(m.pre_traces, limits.first_x, limits.last_x, neuron, limits.kept)


@leaf_njit(inline="always")
def _postsynaptic(m: Any, neuron: int, on_post: Any, follow: Any, pre_of: Any, post_of: Any) -> None:
    """Let `on_post` change the plastic synapses onto a neuron; then raise its traces."""
    population = m.populations[m.population_of[neuron]]
    real, now = m.v.dtype.type, m.clock[NOW]
    for o in range(population.first_in, population.last_in):
        projection = m.projections[m.into[o]]
        column = projection.first_column + neuron - population.start
        limits, p, course = m.limits[projection.rule], m.parameters[projection.rule], m.courses[projection.course]
        gathered, decayed, grown = m.gathered[projection.course], real(course.decayed), real(1.0 / course.decayed)
        low, high, first_x, first_y = limits.low, limits.high, limits.first_x, limits.first_y
        y = post_of(m.post_traces, first_y, neuron)
        last = m.columns[column + 1]
        for entry in range(m.columns[column], last):
            prefetch(m.synapses, m.onto[min(entry + _AHEAD, last - 1)].synapse)
            synapse = m.synapses[m.onto[entry].synapse]
            w, c = _state_of(synapse, gathered, now, decayed, low, high, p, follow)
            w, c = on_post(w, c, pre_of(m.pre_traces, first_x, m.onto[entry].source), y, p)
            _keep(synapse, w, c, now, grown, low, high)
    for limits in m.limits:
        _raise(m.post_traces, limits.first_y, limits.last_y, neuron, limits.kept)


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
    w, c = _state_of(synapse, m.gathered[k], m.clock[NOW], decayed, limits.low, limits.high, p, follow)
    return float(w) if variable == WEIGHT else float(c)


def build(functions: tuple[Callable[..., Any], ...], traces: tuple[int, int], code: str) -> tuple[Any, Any]:
    """Return `run` and `read` for a rule's functions and numbers of traces; `code` tells it from others."""
    on_pre, on_post, follow = functions
    pre_of, post_of = (_TRACES_OF[number - 1] for number in traces)

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
                    _fetch_out(m, spiked[spike + 1])
                m.step_counts[m.population_of[neuron]] += 1
                _presynaptic(m, neuron, on_pre, follow, pre_of, post_of)
            for spike in range(count):
                neuron = spiked[spike]
                if spike + 1 < count:
                    _fetch_into(m, spiked[spike + 1])
                _postsynaptic(m, neuron, on_post, follow, pre_of, post_of)
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

    compiled = cached_njit(neurons, rows, code=code, nogil=True)
    return compiled(run), compiled(read)
