"""Where a network ms goes: the kernel's parts one by one, beside the floor that is 1000 neurons and their noise."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from scla_mj.anatomy import MOTOR, POPULATIONS, SENSORY
from scla_mj.brain.network import kernel, neurons, synapses
from scla_mj.brain.network.network import Network
from scla_mj.brain.network.state import NetworkState, neurons_of, settled_in, synapses_of
from scla_mj.compiled import leaf_njit
from scla_mj.config import RunConfig
from scla_mj.experiments.bench.sheet import FLOOR_ABOVE, Sheet, against, doubted
from scla_mj.experiments.bench.timing import Contender, Watch, median_cpu_s
from scla_mj.experiments.bench.workload import CHUNK_MS, CHUNKS_A_SECOND, Workload, build_network, rewarded, run_chunks

_TARGET: Final = 3.5
"""At most this many times the floor, all in all."""
_SECONDS: Final = 20
_CALLS: Final = 20_000
"""Enough for a turn of some 20 ms at least: shorter ones are at the mercy of whatever else the machine does."""


class Parts(NamedTuple):
    """Microseconds a network ms, or a spike for `sensory`, `dosed` and `motor`.

    `floor`: 1000 bare neuron updates with noise, one fused loop. `stretch` is opened and closed once in 50 ms and
    counted by the ms. `sensory` is a spike without dopamine, `dosed` one with it. `whole`: the compiled kernel alone;
    `chunked`: the same through `Network.run`, as the brain calls it. `sensory_spikes`, `motor_spikes`: how many of them
    a network ms holds; `share`: of the former, how many meet dopamine.
    """

    floor: float
    neurons: float
    decay: float
    stretch: float
    sensory: float
    dosed: float
    motor: float
    whole: float
    chunked: float
    sensory_spikes: float
    motor_spikes: float
    share: float

    @property
    def shares(self) -> dict[str, float]:
        """Microseconds a network ms of every part; the rest is the difference, and together they are the whole."""
        known = {
            "neurons and noise": self.neurons,
            "decay": self.decay,
            "sensory spikes": (self.share * self.dosed + (1.0 - self.share) * self.sensory) * self.sensory_spikes,
            "motor spikes": self.motor * self.motor_spikes,
            "stretches": self.stretch,
        }
        return {**known, "rest": self.whole - sum(known.values())}

    @property
    def over_floor(self) -> float:
        """What a chunked network ms costs, in floors."""
        return self.chunked / self.floor


def measure(config: RunConfig, *, repetitions: int, watch: Watch) -> Parts:
    """Time the parts on a network that has run, rewarded, for some seconds."""
    network, work = _warm(config)
    contenders = _contenders(network, work)
    steps, dosed = len(work.drives) * CHUNK_MS, network.state.dosed.copy()
    counts = run_chunks(network, work)
    share = float((network.state.dosed - dosed).mean()) / steps
    seconds = median_cpu_s(contenders, repetitions=repetitions, watch=watch)
    calls = {"stretch": _CALLS * CHUNK_MS, "whole": steps, "chunked": steps}
    return Parts(
        **{name: 1e6 * cpu_s / calls.get(name, _CALLS) for name, cpu_s in seconds.items()},
        sensory_spikes=int(counts[: len(SENSORY)].sum()) / steps,
        motor_spikes=int(counts[len(SENSORY) : len(SENSORY) + len(MOTOR)].sum()) / steps,
        share=share,
    )


def sheet(parts: Parts) -> Sheet:
    """Return the table."""
    rows = [("floor: 1000 bare neurons, noise", f"{parts.floor:.2f}", "1.00", "")]
    for name, cost in parts.shares.items():
        rows.append((name, f"{cost:.2f}", f"{cost / parts.floor:.2f}", ""))
    rows.append(("kernel", f"{parts.whole:.2f}", f"{parts.whole / parts.floor:.2f}", ""))
    target = against(parts.over_floor, _TARGET)
    rows.append(("network, 50 ms at a time", f"{parts.chunked:.2f}", f"{parts.over_floor:.2f}", target))
    table = Sheet(
        "network",
        "CPU time of a network ms",
        ("what", "us a network ms", "over the floor", "target"),
        tuple(rows),
        f"{parts.sensory_spikes:.2f} sensory spikes a ms at {parts.sensory:.3f} us each, or {parts.dosed:.3f} with "
        f"dopamine, as {100 * parts.share:.0f} % of the time; {parts.motor_spikes:.2f} motor spikes at "
        f"{parts.motor:.3f} us. Rest: what the kernel takes beyond these (spike lists, inhibition). "
        "One sensory population is driven, dopamine comes once a second, input and read-out every 50 ms.",
        {**parts._asdict(), "over_floor": parts.over_floor},
    )
    contain_it = (parts.neurons, parts.whole, parts.chunked)
    return doubted(table, FLOOR_ABOVE) if parts.floor > min(contain_it) else table


def _warm(config: RunConfig) -> tuple[Network, Workload]:
    rng = np.random.Generator(np.random.PCG64(config.seed))
    network = build_network(config.network, config.plasticity, seed=config.seed)
    release = config.plasticity.dopamine_release
    work = rewarded(_SECONDS * CHUNKS_A_SECOND, drive=config.network.sensory_drive, release=release, rng=rng)
    run_chunks(network, work)
    return network, work


def _contenders(network: Network, work: Workload) -> dict[str, Contender]:
    parameters, saved = network.parameters, network.saved()
    excitatory = parameters.excitatory
    drives = work.drives.astype(network.state.v.dtype)

    stretch = network.stretch._replace(drive=np.zeros_like(network.stretch.drive))

    def part(function: Any, *arguments: Any) -> Contender:
        return Contender(lambda: copied(network.state), lambda state: function(state, stretch, parameters, *arguments))

    return {
        "floor": Contender(
            lambda: copied(network.state),
            lambda s: bare_neurons(s, excitatory, parameters.inhibitory, parameters.noise_amplitude, _CALLS),
        ),
        "neurons": part(_repeat_integrate, _CALLS),
        "decay": part(_repeat_decay, _CALLS),
        "stretch": part(_repeat_stretch, _CALLS),
        "sensory": part(_repeat_sensory, 0.0, _CALLS),
        "dosed": part(_repeat_sensory, 1e-9, _CALLS),
        "motor": part(_repeat_motor, _CALLS),
        "whole": Contender(lambda: network.restore(saved), lambda _: _run_kernel(network, drives, work.releases)),
        "chunked": Contender(lambda: network.restore(saved), lambda _: run_chunks(network, work)),
    }


def copied(state: NetworkState) -> NetworkState:
    """Return a copy that shares no memory with the state."""
    arrays = state._asdict()
    del arrays["fired_octets"]
    return settled_in(**arrays)


def _run_kernel(network: Network, drives: Any, releases: Any) -> None:
    room = CHUNK_MS * len(network.state.v) + 1
    spike_step, spike_neuron = np.empty(room, np.int32), np.empty(room, np.int32)
    counts = np.zeros(len(POPULATIONS), np.int64)
    for drive, released in zip(drives, releases, strict=True):
        network.stretch.drive[:] = drive
        kernel.run(released, CHUNK_MS, 0, spike_step, spike_neuron, counts, *network.memory)


@leaf_njit(from_python=True)
def bare_neurons(state: Any, excitatory: Any, inhibitory: Any, amplitude: Any, steps: int) -> None:
    """Equations 1 and 2 and nothing else: each neuron's noise and its update in one pass, no input, no synapses."""
    split = state.trace.shape[0]
    for _ in range(steps):
        _advance_noisy(state, amplitude, 0, split, excitatory)
        _advance_noisy(state, amplitude, split, state.v.shape[0], inhibitory)


@leaf_njit(inline="always")
def _advance_noisy(state: Any, amplitude: Any, start: int, stop: int, cell: Any) -> None:
    v, u, fired = state.v[start:stop], state.u[start:stop], state.fired[start:stop]
    low, high, half_width = state.noise_low[start:stop], state.noise_high[start:stop], amplitude[start:stop]
    real = v.dtype.type
    unit = real(2.0**-31)
    for i in range(v.shape[0]):
        current = half_width[i] * (unit * real(neurons.next_noise(low, high, i)))
        vi, ui = v[i], u[i]
        vi += cell.half_step * (cell.quadratic * vi * vi + cell.linear * vi + cell.offset - ui + current)
        vi += cell.half_step * (cell.quadratic * vi * vi + cell.linear * vi + cell.offset - ui + current)
        ui += cell.rate * (cell.sensitivity * vi - ui)
        over = vi >= cell.peak
        fired[i] = over
        v[i] = cell.reset_v if over else vi
        u[i] = ui + cell.reset_u if over else ui


@leaf_njit(from_python=True)
def _repeat_integrate(state: Any, stretch: Any, parameters: Any, calls: int) -> None:
    cells, noise, unit = neurons_of(state, stretch), parameters.noise_amplitude, parameters.wiring.noise_unit
    for _ in range(calls):
        neurons.integrate(cells, noise, unit, parameters.excitatory, parameters.inhibitory, state.trace.shape[0])


@leaf_njit(from_python=True)
def _repeat_decay(state: Any, stretch: Any, parameters: Any, calls: int) -> None:
    for _ in range(calls):
        kernel.decay(synapses_of(state, stretch), parameters.plasticity, parameters.rates, 1)


@leaf_njit(from_python=True)
def _repeat_stretch(state: Any, stretch: Any, parameters: Any, calls: int) -> None:
    s, p = synapses_of(state, stretch), parameters.plasticity
    for _ in range(calls):
        synapses.open_stretch(s, p, parameters.rates)
        synapses.close_stretch(s, p, parameters.fading, CHUNK_MS)


@leaf_njit(from_python=True)
def _repeat_sensory(state: Any, stretch: Any, parameters: Any, gain: float, calls: int) -> None:
    s, p = synapses_of(state, stretch), parameters.plasticity
    synapses.open_stretch(s, p, parameters.rates)
    for call in range(calls):
        for k in range(s.gathered.shape[0]):
            s.gathered[k] += gain
        side, row = call % len(SENSORY), call * 7 % s.weight.shape[1]  # not one row after another, as spikes come
        synapses.sensory_spike(s, state.synaptic, p, parameters.fading, side, row, 1)


@leaf_njit(from_python=True)
def _repeat_motor(state: Any, stretch: Any, parameters: Any, calls: int) -> None:
    s = synapses_of(state, stretch)
    for call in range(calls):
        synapses.motor_spike(s, parameters.fading, call % len(MOTOR), call * 7 % s.weight.shape[1], 1)
