"""The synapses of any described network: what a spike does to those out of and onto its neuron, for any rule.

A plastic synapse is touched only when one of its neurons fires. Until then its eligibility c decays, and its weight
follows the dose, the sum of c m over the steps, m the modulator. With E = `decayed` = exp(-t / tau_c) since the last
restart, Z = `scaled` = c / E does not change between two spikes, so that the dose is Z (G - G then), where G =
`gathered` = the sum of E m. As c and m keep their sign between two updates (`settle` sees to that), a weight moves one
way only, and clipping it at the end equals clipping it in every step. E and G are float64 always.
"""

# No `from __future__ import annotations`: numba reads nothing from annotations, readers do.
from typing import Any, Final

from scla_mj.brain.network.prefetch import prefetch
from scla_mj.compiled import leaf_njit

STEP: Final = 0
NOW: Final = 1
"""Places in `clock`: the steps since the network began, and since the last restart of `settle`."""
_AHEAD: Final = 16
"""Synapses onto a neuron lie apart: in a large network each would be waited for."""


@leaf_njit()
def state_of(synapse: Any, gathered: Any, now: int, decayed: Any, low: Any, high: Any, p: Any, follow: Any) -> Any:
    """Return a synapse's weight and eligibility now; nothing is changed."""
    scaled = synapse.scaled
    dose = scaled * type(scaled)(gathered[now] - gathered[synapse.at])
    return min(max(type(scaled)(follow(synapse.weight, dose, p)), low), high), scaled * decayed


@leaf_njit()
def keep(synapse: Any, w: Any, c: Any, now: int, grown: Any, low: Any, high: Any) -> None:
    """Store a synapse's weight, clipped, and eligibility as those of now; `grown` is 1 / E."""
    synapse.weight = min(max(type(synapse.weight)(w), low), high)
    synapse.scaled = type(synapse.scaled)(c) * grown
    synapse.at = now


@leaf_njit()
def settle(m: Any, course: int, then: int, decayed: float, restart: bool, follow: Any) -> None:
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
            w, c = state_of(synapse, gathered, then, real(decayed), limits.low, limits.high, p, follow)
            keep(synapse, w, c if abs(c) >= limits.lower_bound else real(0), now, grown, limits.low, limits.high)


@leaf_njit()
def _one(traces: Any, t: int, i: int) -> Any:
    return (traces[t, i],)


@leaf_njit()
def _two(traces: Any, t: int, i: int) -> Any:
    return traces[t, i], traces[t + 1, i]


@leaf_njit()
def _three(traces: Any, t: int, i: int) -> Any:
    return traces[t, i], traces[t + 1, i], traces[t + 2, i]


TRACES_OF: Final = (_one, _two, _three)
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
def fetch_out(m: Any, neuron: int) -> None:
    """Fetch what `presynaptic` reads first of a neuron."""
    population = m.populations[m.population_of[neuron]]
    for o in range(population.first_out, population.last_out):
        _fetch(m.rows, m.synapses, m.projections[m.out[o]].first_row + neuron - population.start)


@leaf_njit(inline="always")
def fetch_into(m: Any, neuron: int) -> None:
    """Fetch what `postsynaptic` reads first of a neuron."""
    population = m.populations[m.population_of[neuron]]
    for o in range(population.first_in, population.last_in):
        _fetch(m.columns, m.onto, m.projections[m.into[o]].first_column + neuron - population.start)


@leaf_njit(inline="always")
def presynaptic(m: Any, neuron: int, on_pre: Any, follow: Any, pre_of: Any, post_of: Any) -> None:
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
            w, c = state_of(synapse, gathered, now, decayed, low, high, p, follow)
            arriving[synapse.target] += w
            w, c = on_pre(w, c, x, post_of(m.post_traces, first_y, synapse.target), p)
            keep(synapse, w, c, now, grown, low, high)
    for limits in m.limits:
        _raise(m.pre_traces, limits.first_x, limits.last_x, neuron, limits.kept)


@leaf_njit(inline="always")
def postsynaptic(m: Any, neuron: int, on_post: Any, follow: Any, pre_of: Any, post_of: Any) -> None:
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
            w, c = state_of(synapse, gathered, now, decayed, low, high, p, follow)
            w, c = on_post(w, c, pre_of(m.pre_traces, first_x, m.onto[entry].source), y, p)
            keep(synapse, w, c, now, grown, low, high)
    for limits in m.limits:
        _raise(m.post_traces, limits.first_y, limits.last_y, neuron, limits.kept)
