"""What a rollout costs beside what it is made of: bare physics and bare neurons, replaying its very inputs."""

from __future__ import annotations

import dataclasses
import statistics
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numba import njit
from numpy.typing import NDArray

from scla_mj.brain.network import kernel
from scla_mj.brain.network.network import Network, Spikes
from scla_mj.brain.scla import SclaBrain
from scla_mj.config import RunConfig, Telemetry
from scla_mj.errors import SclaError
from scla_mj.experiments.assemble import build_trial
from scla_mj.experiments.rollout import rollout
from scla_mj.loop.drive import mj_step
from scla_mj.randomness import Consumer, generator, seed_sequence
from scla_mj.signals import TRAJECTORY_COLUMNS

_COMMANDS = slice(TRAJECTORY_COLUMNS.index("command_left_rad_s"), None)
_STATE = mujoco.mjtState.mjSTATE_INTEGRATION


class NetworkCall(NamedTuple):
    """One stretch of network time: its steps, its drive (1000,) or None, and the dopamine released before it, (8,)."""

    steps: int
    drive: NDArray[np.float64] | None
    released: tuple[NDArray[np.float64], ...]


@dataclass
class Tape:
    """What a rollout fed its parts: per episode MuJoCo's state and the wheel commands, and every network call."""

    episodes: list[tuple[NDArray[np.float64], list[NDArray[np.float64]]]] = field(default_factory=list)
    network: list[NetworkCall] = field(default_factory=list)

    @property
    def network_ms(self) -> int:
        """Neural steps in all."""
        return sum(call.steps for call in self.network)


class Cost(NamedTuple):
    """CPU milliseconds a decision, a median over repetitions, of each contender."""

    physics: float
    network: float
    off: float
    light: float
    full: float
    network_us_per_step: float

    def ratio(self, telemetry: Telemetry) -> float:
        """Return the whole rollout's cost over that of its bare parts."""
        return float(getattr(self, telemetry)) / (self.physics + self.network)


class _TapedNetwork(Network):
    """A network that writes down what it is asked."""

    def __init__(self, tape: Tape, config: RunConfig) -> None:
        super().__init__(
            config.network,
            config.plasticity,
            neural_step_ms=config.clock.neural_step_ms,
            weights=generator(config.seed, Consumer.WEIGHTS),
            noise=seed_sequence(config.seed, Consumer.NOISE),
        )
        self._tape = tape
        self._waiting: list[NDArray[np.float64]] = []

    def run(
        self, steps: int, drive: NDArray[Any] | None = None, *, first_step: int = 0, after: Spikes | None = None
    ) -> Spikes:
        """Run as ever, and keep the call."""
        if steps:
            self._tape.network.append(NetworkCall(steps, drive, tuple(self._waiting)))
            self._waiting.clear()
        return super().run(steps, drive, first_step=first_step, after=after)

    def release_dopamine(self, amount: NDArray[np.float64], *, delay_steps: int = 0) -> None:
        """Release as ever, and keep the amount."""
        self._waiting.append(amount)
        super().release_dopamine(amount, delay_steps=delay_steps)


def measure(config: RunConfig, *, repetitions: int, watch: Callable[[], object]) -> Cost:
    """Interleave bare parts and whole rollouts of the same decisions, in CPU time of this process.

    `watch` is called after each repetition; the first one, which warms caches and compilers up, is not counted.

    Raises:
        SclaError: the configuration has no network to replay.
    """
    if config.brain != "scla":
        raise SclaError(f"--brain {config.brain} has no network to replay: the bench takes scla")
    tape = record(config)
    decisions = config.epochs * config.decisions
    samples: dict[str, list[float]] = {name: [] for name in ("physics", "network", "off", "light", "full")}
    for repetition in range(repetitions + 1):
        for name, work in _contenders(config, tape).items():
            started = time.process_time()
            work()
            if repetition:
                samples[name].append(1000.0 * (time.process_time() - started) / decisions)
        watch()
    medians = {name: statistics.median(values) for name, values in samples.items()}
    return Cost(**medians, network_us_per_step=1000.0 * medians["network"] * decisions / tape.network_ms)


def record(config: RunConfig) -> Tape:
    """Run the decisions once and keep what the physics and the network were fed."""
    trial, tape = build_trial(config), Tape()
    assert isinstance(trial.brain, SclaBrain)
    trial.brain.network = _TapedNetwork(tape, config)
    fresh = True
    for epoch in range(1, config.epochs + 1):
        for decision in range(1, config.decisions + 1):
            if fresh:
                tape.episodes.append((_physics_state(trial.world), []))
            done = trial.step(epoch=epoch, decision=decision)
            tape.episodes[-1][1].append(done.move.trajectory[:, _COMMANDS].copy())
            fresh = done.hit or done.move.fallen
    return tape


def _contenders(config: RunConfig, tape: Tape) -> dict[str, Callable[[], None]]:
    """Return every contender, set up and ready to be timed."""
    bare = build_trial(config)
    assert isinstance(bare.brain, SclaBrain)
    network = bare.brain.network
    return {
        "physics": lambda: _replay_physics(bare.world, tape, config.build_clock().physics_steps_per_control),
        "network": lambda: _replay_network(network, tape),
        "off": lambda: _whole(config, "off"),
        "light": lambda: _whole(config, "light"),
        "full": lambda: _whole(config, "full"),
    }


def _physics_state(world: Any) -> NDArray[np.float64]:
    state = np.empty(mujoco.mj_stateSize(world.model, _STATE))
    mujoco.mj_getState(world.model, world.data, state, _STATE)
    return state


def _replay_physics(world: Any, tape: Tape, steps: int) -> None:
    for state, moves in tape.episodes:
        mujoco.mj_setState(world.model, world.data, state, _STATE)
        for commands in moves:
            _step_through(world.model._address, world.data._address, world.data.ctrl, commands, steps)


@njit(nogil=True)
def _step_through(model: int, data: int, ctrl: Any, commands: Any, steps: int) -> None:
    for period in range(commands.shape[0]):
        ctrl[0], ctrl[1] = commands[period, 0], commands[period, 1]
        for _ in range(steps):
            mj_step(model, data)


def _replay_network(network: Network, tape: Tape) -> None:
    silence = np.zeros_like(network.state.v)
    spike_step, spike_neuron = np.empty(1_000_000, np.int32), np.empty(1_000_000, np.int32)
    counts = np.zeros(12, np.int64)
    for call in tape.network:
        for amount in call.released:
            network.state.dopamine[:] += amount
        drive = silence if call.drive is None else call.drive.astype(silence.dtype)
        for done in range(0, call.steps, 1000):
            steps = min(1000, call.steps - done)
            kernel.run(network.state, network.parameters, drive, steps, 0, spike_step, spike_neuron, counts)


def _whole(config: RunConfig, telemetry: Telemetry) -> None:
    with tempfile.TemporaryDirectory() as folder:
        rollout(dataclasses.replace(config, telemetry=telemetry), Path(folder) / "run", pictures=False)
