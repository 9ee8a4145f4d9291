"""The network in Brian2 (Cython), in its best form for a loop: ONE `run`, and a network operation for input and output.

Calling `run(50 ms)` in a loop costs twenty times as much. Eligibility and weights of all synapses are updated by numpy
in a network operation on Brian2's own arrays: that costs less than half of what `run_regularly` does. The order of the
work inside a step is that of docs/model.md: `run_regularly` in the slots `groups` and `synapses`, synaptic delays of
zero, resets after the synapses.
"""

from __future__ import annotations

from typing import Any

import brian2
import numpy as np
from brian2 import ms

_NEURONS = """
v : 1
u : 1
current : 1
drive : 1
trace : 1
a : 1 (constant)
reset_u : 1 (constant)
noise : 1 (constant)
"""
_INTEGRATE = """
I = drive + current{noise}
v += 0.5 * (0.04 * v * v + 5 * v + 140 - u + I)
v += 0.5 * (0.04 * v * v + 5 * v + 140 - u + I)
u += a * (0.2 * v - u)
current = 0
trace *= trace_decay
trace *= int(trace >= trace_lower_bound)
"""


def simulate(job: Any, exchange: Any) -> Any:
    """Run the job; see worker.py."""
    _set_preferences(exact=job.record)
    neurons = _neurons(job)
    synapses = _plastic(job, neurons)
    monitor = brian2.SpikeMonitor(neurons, record=job.record)
    seen = np.zeros(int(job.populations[-1]), np.int64)
    dopamine = np.zeros((len(job.projections), 1))

    def chunk() -> None:
        total = np.asarray(monitor.count)
        stretch = exchange(np.add.reduceat(total - seen, job.populations[:-1]))
        seen[:] = total
        if stretch is None:
            brian2.stop()
            return
        neurons.drive = stretch[0]
        dopamine[:, 0] += stretch[1]

    operations = [brian2.NetworkOperation(chunk, dt=job.chunk_ms * ms, when="start")]
    if job.plastic:
        learn = _learning(job, synapses, dopamine)
        operations.append(brian2.NetworkOperation(learn, dt=1 * ms, when="groups", order=1))
    network = brian2.Network(neurons, synapses, _fixed(job, neurons), monitor, *operations)
    # Far longer than any bench: the exchange stops it.
    duration = len(job.drives) * job.chunk_ms if job.record else 10_000_000
    network.run(duration * ms, namespace=dict(job.constants))
    return _spikes(job, monitor, synapses) if job.record else None


def _learning(job: Any, synapses: Any, dopamine: Any) -> Any:
    """Return one step of equations 3 and 4, in place on Brian2's arrays, one row per projection."""
    rows = len(job.projections)
    weights = synapses.variables["w"].get_value().reshape(rows, -1)
    eligibility = synapses.variables["c"].get_value().reshape(rows, -1)
    change, constants, real = np.empty_like(weights), job.constants, weights.dtype.type

    def learn() -> None:
        np.multiply(dopamine, constants["dopamine_decay"], out=dopamine)
        np.multiply(eligibility, real(constants["eligibility_decay"]), out=eligibility)
        np.multiply(eligibility, (constants["learning_rate"] * dopamine).astype(real), out=change)
        np.add(weights, change, out=weights)
        np.clip(weights, 0, real(constants["weight_max"]), out=weights)

    return learn


def _set_preferences(*, exact: bool) -> None:
    brian2.prefs.codegen.target = "cython"
    brian2.defaultclock.dt = 1 * ms
    if exact:  # neither Brian2 nor the compiler may reorder or contract, or the last bit is their own
        brian2.prefs.codegen.loop_invariant_optimisations = False
        brian2.prefs.codegen.cpp.extra_compile_args_gcc = ["-w", "-O2", "-ffp-contract=off", "-std=c++11"]
    else:
        brian2.prefs.core.default_float_dtype = np.float32


def _neurons(job: Any) -> Any:
    noisy = bool(job.noise_half_width.any())
    group = brian2.NeuronGroup(
        int(job.populations[-1]), _NEURONS, threshold="v >= 30", reset="v = -65; u += reset_u", name="neurons"
    )
    group.run_regularly(_INTEGRATE.format(noise=" + noise * (2 * rand() - 1)" if noisy else ""), when="groups", order=0)
    # Between the presynaptic pathways, which read the motors' old traces, and the postsynaptic ones.
    group.run_regularly("trace += int(v >= 30)", when="synapses", order=0)
    excitatory = np.arange(len(group)) < job.populations[8]
    group.v, group.u = -65, -13
    group.a, group.reset_u = np.where(excitatory, 0.02, 0.1), np.where(excitatory, 8, 2)
    group.noise = job.noise_half_width
    return group


def _plastic(job: Any, neurons: Any) -> Any:
    """All 80,000 plastic synapses in the order of the job's weights."""
    learns = job.plastic
    synapses = brian2.Synapses(
        neurons,
        neurons,
        "w : 1\nc : 1",
        on_pre="current_post += w" + ("\nc -= depression * trace_post" if learns else ""),
        on_post="c += potentiation * trace_pre" if learns else None,
        name="plastic",
    )
    size = job.weights.shape[1]
    i = np.concatenate([np.repeat(np.arange(size), size) + job.populations[sensor] for sensor, _ in job.projections])
    j = np.concatenate([np.tile(np.arange(size), size) + job.populations[motor] for _, motor in job.projections])
    synapses.connect(i=i, j=j)
    synapses.w = job.weights.ravel()
    synapses.pre.order = -1
    if learns:
        synapses.post.order = 1
    return synapses


def _fixed(job: Any, neurons: Any) -> Any:
    """Motors to their own inhibitory population, which inhibits the three other motors: all to all, constant."""
    synapses = brian2.Synapses(neurons, neurons, "w : 1 (constant)", on_pre="current_post += w", name="fixed")
    ranges = [np.arange(start, stop) for start, stop in zip(job.populations, job.populations[1:], strict=False)]
    pairs = [(4 + side, 8 + side, job.constants["motor_to_inhibitory"]) for side in range(4)]
    pairs += [(8 + s, 4 + o, job.constants["inhibitory_to_motor"]) for s in range(4) for o in range(4) if o != s]
    i = np.concatenate([np.repeat(ranges[source], len(ranges[target])) for source, target, _ in pairs])
    j = np.concatenate([np.tile(ranges[target], len(ranges[source])) for source, target, _ in pairs])
    w = np.concatenate([np.full(len(ranges[s]) * len(ranges[t]), weight) for s, t, weight in pairs])
    synapses.connect(i=i, j=j)
    synapses.w = w
    return synapses


def _spikes(job: Any, monitor: Any, synapses: Any) -> dict[str, Any]:
    weights = np.asarray(synapses.w).reshape(job.weights.shape)
    step = np.rint(monitor.t / ms).astype(np.int64)
    return {"step": step, "neuron": np.asarray(monitor.i), "weights": weights}
