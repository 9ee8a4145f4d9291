"""Where a simulated ms goes: the kernel's parts one by one, against the lower bound of 1000 neurons and their noise."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from benchmarks.table import BOUND_ABOVE, Sheet, against, doubted
from benchmarks.timing import Contender, Watch, median_cpu_s
from benchmarks.workload import CHUNK_MS, CHUNKS_A_SECOND, Workload, rewarded, run_chunks
from scla_mj.anatomy import MOTOR, POPULATIONS, SENSORY
from scla_mj.brain.network import kernel, neurons, synapses
from scla_mj.brain.network.memory import Memory, copy_of
from scla_mj.brain.network.network import Network
from scla_mj.compiled import leaf_njit
from scla_mj.config import RunConfig

_TARGET: Final = 3.5
"""At most this many times the lower bound, in total."""
_SECONDS: Final = 20
_CALLS: Final = 20_000
"""Enough for turns of at least 20 ms: shorter ones are too noisy."""


class Parts(NamedTuple):
    """Microseconds per simulated ms, or per spike for `sensory`, `dosed` and `motor`.

    `bound`: 1000 bare neuron updates with noise, one fused loop. `stretch` is opened and closed once in 50 ms and
    counted per ms. `sensory` is a spike without dopamine, `dosed` one with it. `whole`: the compiled kernel alone;
    `chunked`: the same through `Network.advance`, as the brain calls it. `sensory_spikes`, `motor_spikes`: spikes per
    simulated ms; `share`: the fraction of the former that meets dopamine.
    """

    bound: float
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
        """Microseconds per simulated ms of every part; the rest is the difference, so that they add up to the whole."""
        known = {
            "neurons and noise": self.neurons,
            "decay": self.decay,
            "sensory spikes": (self.share * self.dosed + (1.0 - self.share) * self.sensory) * self.sensory_spikes,
            "motor spikes": self.motor * self.motor_spikes,
            "stretches": self.stretch,
        }
        return {**known, "rest": self.whole - sum(known.values())}

    @property
    def over_bound(self) -> float:
        """The cost of the chunked network over the lower bound."""
        return self.chunked / self.bound


def measure(config: RunConfig, *, repetitions: int, watch: Watch) -> Parts:
    """Time the parts on a network that has run, rewarded, for some seconds."""
    network, work = _warm(config)
    contenders = _contenders(network, work)
    steps, dosed = len(work.drives) * CHUNK_MS, network.arrays.dosed.copy()
    counts = run_chunks(network, work)
    share = float((network.arrays.dosed - dosed).mean()) / steps
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
    rows = [("lower bound: 1000 bare neurons, noise", f"{parts.bound:.2f}", "1.00", "")]
    for name, cost in parts.shares.items():
        rows.append((name, f"{cost:.2f}", f"{cost / parts.bound:.2f}", ""))
    rows.append(("kernel", f"{parts.whole:.2f}", f"{parts.whole / parts.bound:.2f}", ""))
    target = against(parts.over_bound, _TARGET)
    rows.append(("network, 50 ms at a time", f"{parts.chunked:.2f}", f"{parts.over_bound:.2f}", target))
    table = Sheet(
        "network",
        "CPU time per simulated ms of the network",
        ("what", "µs per simulated ms", "over the lower bound", "target"),
        tuple(rows),
        f"{parts.sensory_spikes:.2f} sensory spikes per ms at {parts.sensory:.3f} µs each, or {parts.dosed:.3f} with "
        f"dopamine, as {100 * parts.share:.0f} % of the time; {parts.motor_spikes:.2f} motor spikes at "
        f"{parts.motor:.3f} µs. Rest: the kernel minus these parts (spike lists, inhibition). "
        "One sensory population is driven, dopamine is released once per second, input and read-out every 50 ms.",
        {**parts._asdict(), "over_bound": parts.over_bound},
    )
    contain_it = (parts.neurons, parts.whole, parts.chunked)
    return doubted(table, BOUND_ABOVE) if parts.bound > min(contain_it) else table


def _warm(config: RunConfig) -> tuple[Network, Workload]:
    rng = np.random.Generator(np.random.PCG64(config.seed))
    network = Network(config.network, config.plasticity, seed=config.seed)
    release = config.plasticity.dopamine_release
    work = rewarded(_SECONDS * CHUNKS_A_SECOND, drive=config.network.sensory_drive, release=release, rng=rng)
    run_chunks(network, work)
    return network, work


def _contenders(network: Network, work: Workload) -> dict[str, Contender]:
    saved, drives = network.state(), work.drives.astype(network.arrays.v.dtype)

    def part(function: Any, *arguments: Any) -> Contender:
        return Contender(lambda: _undriven(network), lambda memory: function(memory, *arguments, _CALLS))

    return {
        "bound": part(bare_neurons),
        "neurons": part(_repeat_integrate),
        "decay": part(_repeat_decay),
        "stretch": part(_repeat_stretch),
        "sensory": part(_repeat_sensory, 0.0),
        "dosed": part(_repeat_sensory, 1e-9),
        "motor": part(_repeat_motor),
        "whole": Contender(lambda: network.restore(saved), lambda _: _run_kernel(network, drives, work.releases)),
        "chunked": Contender(lambda: network.restore(saved), lambda _: run_chunks(network, work)),
    }


def _undriven(network: Network) -> Memory:
    """Return a copy of the network's memory that nothing drives."""
    memory = copy_of(network.memory)
    memory["drive"] = 0.0
    return memory


def _run_kernel(network: Network, drives: Any, releases: Any) -> None:
    room = CHUNK_MS * len(network.arrays.v) + 1
    spike_step, spike_neuron = np.empty(room, np.int32), np.empty(room, np.int32)
    counts = np.zeros(len(POPULATIONS), np.int64)
    for drive, released in zip(drives, releases, strict=True):
        kernel.run(network.memory, drive, released, CHUNK_MS, 0, spike_step, spike_neuron, 0, counts)


@leaf_njit(from_python=True)
def bare_neurons(memory: Any, steps: int) -> None:
    """Equations 1 and 2 and nothing else: each neuron's noise and its update in one pass, no input, no synapses."""
    m = memory[0]
    split = m.trace.shape[0]
    for _ in range(steps):
        _advance_noisy(m, 0, split, m.excitatory)
        _advance_noisy(m, split, m.v.shape[0], m.inhibitory)


@leaf_njit()
def _advance_noisy(m: Any, start: int, stop: int, cell: Any) -> None:
    v, u, fired = m.v[start:stop], m.u[start:stop], m.fired[start:stop]
    low, high, half_width = m.noise_low[start:stop], m.noise_high[start:stop], m.noise_amplitude[start:stop]
    unit, real = m.wiring.noise_unit, v.dtype.type
    constants = neurons.constants_of(cell)
    for i in range(v.shape[0]):
        current = half_width[i] * (unit * real(neurons.next_noise(low, high, i)))
        v[i], u[i], fired[i] = neurons.next_state(v[i], u[i], current, constants)


@leaf_njit(from_python=True)
def _repeat_integrate(memory: Any, calls: int) -> None:
    for _ in range(calls):
        neurons.integrate(memory[0])


@leaf_njit(from_python=True)
def _repeat_decay(memory: Any, calls: int) -> None:
    m = memory[0]
    for call in range(calls):
        if call % CHUNK_MS == 0:
            m.trace[:] = 1.0  # the network clears small ones after so long: subnormal numbers would be slow
        kernel.decay(m, 1)


@leaf_njit(from_python=True)
def _repeat_stretch(memory: Any, calls: int) -> None:
    for _ in range(calls):
        synapses.open_stretch(memory[0])
        synapses.close_stretch(memory[0], CHUNK_MS)


@leaf_njit(from_python=True)
def _repeat_sensory(memory: Any, gain: float, calls: int) -> None:
    m = memory[0]
    synapses.open_stretch(m)
    for call in range(calls):
        for k in range(m.gathered.shape[0]):
            m.gathered[k] += gain
        side, row = call % len(SENSORY), call * 7 % m.synapses.shape[1]  # rows in scattered order, as spikes arrive
        synapses.sensory_spike(m, side, row, 1)


@leaf_njit(from_python=True)
def _repeat_motor(memory: Any, calls: int) -> None:
    m = memory[0]
    for call in range(calls):
        synapses.motor_spike(m, call % len(MOTOR), call * 7 % m.synapses.shape[1], 1)
