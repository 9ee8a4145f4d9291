"""The network in NEST: `izhikevich`, `stdp_dopamine_synapse`, a volume transmitter for every projection's dopamine.

NEST's dopamine is a count of spikes and cannot be negative: a projection whose dopamine is negative has the signs of A+
and A- turned round instead, which is the same process. One dopamine spike raises NEST's concentration by 1 / tau_n, so
A+ and A- carry the rest of rate x release. Spikes arrive a step later than they are sent, as in every other peer here;
the delay of 1 ms also shifts NEST's STDP pairing by one step, which is why plastic spike trains are not compared.
"""

from __future__ import annotations

from typing import Any

import nest
import numpy as np

_DELAY_MS = 1.0


def simulate(job: Any, exchange: Any) -> Any:
    """Run the job; see worker.py."""
    nest.verbosity = nest.VerbosityLevel.ERROR
    nest.ResetKernel()
    nest.resolution, nest.local_num_threads = 1.0, 1
    populations = _neurons(job)
    everyone = populations[0]
    for population in populations[1:]:
        everyone += population
    dopamine = _plastic(job, populations)
    _fixed(job, populations)
    _noise(job, populations)
    recorder = nest.Create("spike_recorder")
    nest.Connect(everyone, recorder)
    if job.record:
        return _record(job, exchange, everyone, recorder)
    set_drive = _drive(job, populations)
    first = everyone[0].global_id
    counts = np.zeros(len(populations), np.int64)
    while (stretch := exchange(counts)) is not None:
        set_drive(stretch[0])
        _release(dopamine, stretch[1])
        nest.Simulate(job.chunk_ms)
        events = recorder.events
        counts = np.histogram(events["senders"] - first, job.populations)[0]
        recorder.n_events = 0  # a full recorder slows the run down; it cannot be emptied within one long `Run`
    return None


def _record(job: Any, exchange: Any, everyone: Any, recorder: Any) -> Any:
    """Run the job and keep every spike, the input added up as the other peers do: with the spikes, before the rest.

    NEST adds `I_e` and the synaptic current to the equation's right side one after the other, which rounds otherwise.
    So the input comes as a spike a millisecond with the input as its weight; it is sent a step before it acts, and so
    the network is a millisecond late.
    """
    clock = nest.Create("spike_generator", params={"spike_times": np.arange(1.0, len(job.drives) * job.chunk_ms + 1.0)})
    nest.Connect(clock, everyone, syn_spec={"delay": _DELAY_MS})
    inputs = nest.GetConnections(clock)
    order = np.argsort(inputs.get("target"))
    counts = np.zeros(len(job.populations) - 1, np.int64)
    late_ms = 1
    while (stretch := exchange(counts)) is not None:
        weights = np.empty(len(order))
        weights[order] = stretch[0]
        inputs.set(weight=weights.tolist())
        if late_ms:
            nest.Simulate(late_ms)
            everyone.set(V_m=-65.0, U_m=-13.0)
        nest.Simulate(job.chunk_ms - late_ms)
        late_ms = 0
    nest.Simulate(1)
    events = recorder.events
    step = np.rint(events["times"]).astype(np.int64) - 2  # a spike is stamped at the end of its step
    neuron = events["senders"] - everyone[0].global_id
    order = np.lexsort((neuron, step))
    order = order[step[order] >= 0]
    return {"step": step[order], "neuron": neuron[order], "weights": job.weights}


def _neurons(job: Any) -> list[Any]:
    kinds: Any = ({"a": 0.02, "d": 8.0}, {"a": 0.1, "d": 2.0})
    common = {"b": 0.2, "c": -65.0, "V_m": -65.0, "U_m": -13.0, "consistent_integration": False}
    common["tau_minus"] = job.constants["trace_tau_ms"]
    sizes = np.diff(job.populations)
    return [
        nest.Create("izhikevich", int(size), params={**common, **kinds[index >= 8]}) for index, size in enumerate(sizes)
    ]


def _plastic(job: Any, populations: list[Any]) -> list[Any]:
    """Connect the 8 projections; return what releases the dopamine of each."""
    sources = []
    for k, (sensor, motor) in enumerate(job.projections):
        syn: dict[str, Any] = {"synapse_model": "static_synapse"}
        if job.plastic:
            transmitter = nest.Create("volume_transmitter", params={"deliver_interval": job.chunk_ms})
            source, relay = nest.Create("spike_generator"), nest.Create("parrot_neuron")
            nest.Connect(source, relay, syn_spec={"delay": _DELAY_MS})
            nest.Connect(relay, transmitter, syn_spec={"delay": _DELAY_MS})  # which takes no generator's spikes
            sources.append(source)
            nest.CopyModel("stdp_dopamine_synapse", f"projection_{k}", _rule(job, k, transmitter))
            syn = {"synapse_model": f"projection_{k}"}
        # NEST wants (targets, sources).
        syn |= {"weight": np.ascontiguousarray(job.weights[k].T), "delay": _DELAY_MS}
        nest.Connect(populations[sensor], populations[motor], "all_to_all", syn)
    return sources


def _rule(job: Any, k: int, transmitter: Any) -> dict[str, Any]:
    constants = job.constants
    gain = constants["learning_rate"] * constants["dopamine_release"] * constants["dopamine_tau_ms"]
    gain *= float(job.signs[k])
    return {
        "volume_transmitter": transmitter,
        "A_plus": gain * constants["potentiation"],
        "A_minus": gain * constants["depression"],
        "tau_plus": constants["trace_tau_ms"],
        "tau_c": constants["eligibility_tau_ms"],
        "tau_n": constants["dopamine_tau_ms"],
        "b": 0.0,
        "Wmin": 0.0,
        "Wmax": constants["weight_max"],
    }


def _fixed(job: Any, populations: list[Any]) -> None:
    for side in range(4):
        syn = {"weight": job.constants["motor_to_inhibitory"], "delay": _DELAY_MS}
        nest.Connect(populations[4 + side], populations[8 + side], "all_to_all", syn)
        for other in range(4):
            if other != side:
                syn = {"weight": job.constants["inhibitory_to_motor"], "delay": _DELAY_MS}
                nest.Connect(populations[8 + side], populations[4 + other], "all_to_all", syn)


def _noise(job: Any, populations: list[Any]) -> None:
    """Gaussian, which is what NEST has, with the uniform noise's standard deviation."""
    for population, start in zip(populations, job.populations, strict=False):
        deviation = float(job.noise_half_width[start]) / 3.0**0.5
        if deviation:
            source = nest.Create("noise_generator", params={"mean": 0.0, "std": deviation, "dt": 1.0})
            nest.Connect(source, population, syn_spec={"delay": _DELAY_MS})


def _drive(job: Any, populations: list[Any]) -> Any:
    """Return what sets the input: one generator per population, which is faster than setting `I_e` of every neuron."""
    sources = [nest.Create("dc_generator") for _ in populations]
    for source, population in zip(sources, populations, strict=True):
        nest.Connect(source, population, syn_spec={"delay": _DELAY_MS})
    levels = np.zeros(len(sources))

    def set_drive(drive: Any) -> None:
        wanted = drive[job.populations[:-1]]
        for index in np.flatnonzero(wanted != levels):
            sources[index].amplitude = float(wanted[index])
        levels[:] = wanted

    return set_drive


def _release(sources: list[Any], release: Any) -> None:
    now_ms = nest.biological_time
    for source, amount in zip(sources, release, strict=False):
        if amount:
            source.spike_times = [now_ms + 1.0]
