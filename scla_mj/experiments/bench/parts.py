"""Where a network ms goes: the kernel's parts one by one, beside the floor that is 1000 neurons and their noise."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from numba import njit

from scla_mj.anatomy import MOTOR, POPULATIONS, SENSORY
from scla_mj.brain.network import kernel
from scla_mj.brain.network.network import Network
from scla_mj.brain.network.state import NetworkState
from scla_mj.config import RunConfig
from scla_mj.experiments.bench.sheet import FLOOR_ABOVE, Sheet, against, doubted
from scla_mj.experiments.bench.timing import Contender, Watch, median_cpu_s
from scla_mj.experiments.bench.workload import CHUNK_MS, CHUNKS_A_SECOND, Workload, build_network, rewarded, run_chunks

_TARGET: Final = 3.5
"""At most this many times the floor, all in all."""
_SECONDS: Final = 5
_CALLS: Final = 5000


class Parts(NamedTuple):
    """Microseconds a network ms, or a spike for `sensory` and `motor`.

    `floor`: 1000 bare neuron updates with noise, one fused loop. `settle` is called once a stretch and counted by the
    ms. `whole`: the compiled kernel alone; `chunked`: the same through `Network.run`, as the brain calls it.
    `sensory_spikes`, `motor_spikes`: how many of them a network ms holds.
    """

    floor: float
    neurons: float
    decay: float
    settle: float
    sensory: float
    motor: float
    whole: float
    chunked: float
    sensory_spikes: float
    motor_spikes: float

    @property
    def shares(self) -> dict[str, float]:
        """Microseconds a network ms of every part; the rest is the difference, and together they are the whole."""
        known = {
            "neurons and noise": self.neurons,
            "decay": self.decay,
            "sensory spikes": self.sensory * self.sensory_spikes,
            "motor spikes": self.motor * self.motor_spikes,
            "settle": self.settle,
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
    counts = run_chunks(network, work)
    steps = len(work.drives) * CHUNK_MS
    seconds = median_cpu_s(contenders, repetitions=repetitions, watch=watch)
    calls = {"sensory": _CALLS, "motor": _CALLS, "settle": _CALLS * CHUNK_MS, "whole": steps, "chunked": steps}
    return Parts(
        **{name: 1e6 * cpu_s / calls.get(name, _CALLS) for name, cpu_s in seconds.items()},
        sensory_spikes=int(counts[: len(SENSORY)].sum()) / steps,
        motor_spikes=int(counts[len(SENSORY) : len(SENSORY) + len(MOTOR)].sum()) / steps,
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
        f"{parts.sensory_spikes:.2f} sensory spikes a ms at {parts.sensory:.3f} us each, {parts.motor_spikes:.2f} "
        f"motor spikes at {parts.motor:.3f} us. Rest: what the kernel takes beyond these (spike lists, inhibition). "
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
    parameters, silence, saved = network.parameters, np.zeros_like(network.state.v), network.saved()
    excitatory = parameters.excitatory
    drives = work.drives.astype(silence.dtype)

    def part(function: Any, *arguments: Any) -> Contender:
        return Contender(lambda: _stirred(network), lambda state: function(state, parameters, *arguments))

    return {
        "floor": Contender(
            lambda: _copy(network.state),
            lambda s: bare_neurons(s, excitatory, parameters.inhibitory, parameters.noise_amplitude, _CALLS),
        ),
        "neurons": part(_repeat_integrate, silence, _CALLS),
        "decay": part(_repeat_decay, _CALLS),
        "settle": part(_repeat_settle, _CALLS),
        "sensory": part(_repeat_sensory, _CALLS),
        "motor": part(_repeat_motor, _CALLS),
        "whole": Contender(lambda: network.restore(saved), lambda _: _run_kernel(network, drives, work.releases)),
        "chunked": Contender(lambda: network.restore(saved), lambda _: run_chunks(network, work)),
    }


def _copy(state: NetworkState) -> NetworkState:
    fired = state.fired.copy()
    arrays: dict[str, Any] = {name: values.copy() for name, values in state._asdict().items()}
    return NetworkState(**arrays)._replace(fired=fired, fired_octets=fired.view(np.uint64))


def _stirred(network: Network) -> NetworkState:
    """A copy of the network's state with dopamine everywhere, so that a spike costs what it costs with reward."""
    state = _copy(network.state)
    state.dopamine[:] = 0.1
    state.gathered[:] = 1e-3
    return state


def _run_kernel(network: Network, drives: Any, releases: Any) -> None:
    room = CHUNK_MS * len(network.state.v)
    spike_step, spike_neuron = np.empty(room, np.int32), np.empty(room, np.int32)
    counts = np.zeros(len(POPULATIONS), np.int64)
    for drive, release in zip(drives, releases, strict=True):
        network.state.dopamine[:] += release
        kernel.run(network.state, network.parameters, drive, CHUNK_MS, 0, spike_step, spike_neuron, counts)


@njit
def bare_neurons(state: Any, excitatory: Any, inhibitory: Any, amplitude: Any, steps: int) -> None:
    """Equations 1 and 2 and nothing else: each neuron's noise and its update in one pass, no input, no synapses."""
    split = state.trace.shape[0]
    for _ in range(steps):
        _advance_noisy(state, amplitude, 0, split, excitatory)
        _advance_noisy(state, amplitude, split, state.v.shape[0], inhibitory)


@njit(inline="always")
def _advance_noisy(state: Any, amplitude: Any, start: int, stop: int, cell: Any) -> None:
    v, u, fired = state.v[start:stop], state.u[start:stop], state.fired[start:stop]
    low, high, half_width = state.noise_low[start:stop], state.noise_high[start:stop], amplitude[start:stop]
    real = v.dtype.type
    unit = real(2.0**-31)
    for i in range(v.shape[0]):
        current = half_width[i] * (unit * real(kernel.next_noise(low, high, i)))
        vi, ui = v[i], u[i]
        vi += cell.half_step * (cell.quadratic * vi * vi + cell.linear * vi + cell.offset - ui + current)
        vi += cell.half_step * (cell.quadratic * vi * vi + cell.linear * vi + cell.offset - ui + current)
        ui += cell.rate * (cell.sensitivity * vi - ui)
        over = vi >= cell.peak
        fired[i] = over
        v[i] = cell.reset_v if over else vi
        u[i] = ui + cell.reset_u if over else ui


@njit
def _repeat_integrate(state: Any, parameters: Any, drive: Any, calls: int) -> None:
    for _ in range(calls):
        kernel._integrate(state, parameters, drive)


@njit
def _repeat_decay(state: Any, parameters: Any, calls: int) -> None:
    for _ in range(calls):
        kernel._decay(state, parameters)


@njit
def _repeat_settle(state: Any, parameters: Any, calls: int) -> None:
    for _ in range(calls):
        state.gathered[:] = 1e-6
        kernel.settle(state, parameters)


@njit
def _repeat_sensory(state: Any, parameters: Any, calls: int) -> None:
    first, count = parameters.population_start[0], parameters.population_start[len(SENSORY)]
    for call in range(calls):
        neuron = first + call * 7 % count  # not one row after another, as spikes come
        kernel._sensory_spike(state, parameters, neuron, parameters.population_of[neuron])


@njit
def _repeat_motor(state: Any, parameters: Any, calls: int) -> None:
    first = parameters.population_start[len(SENSORY)]
    count = parameters.population_start[len(SENSORY) + len(MOTOR)] - first
    for call in range(calls):
        neuron = first + call * 7 % count
        kernel._motor_spike(state, parameters, neuron, parameters.population_of[neuron])
