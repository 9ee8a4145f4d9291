"""What a rollout fed its parts, written down once, and the bare parts that replay it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from scla_mj.anatomy import POPULATIONS, PROJECTIONS
from scla_mj.brain.base import Brain
from scla_mj.brain.network import kernel
from scla_mj.brain.network.network import Network
from scla_mj.brain.registry import BRAINS
from scla_mj.brain.scla import SclaBrain
from scla_mj.compiled import leaf_njit
from scla_mj.config import RunConfig
from scla_mj.disturbances import DisturbanceConfig
from scla_mj.engine.build import simulate
from scla_mj.errors import SclaError
from scla_mj.grid import Action, Cell
from scla_mj.loop.drive import Driver
from scla_mj.loop.periods import mj_step
from scla_mj.signals import TRAJECTORY_COLUMNS, Move
from scla_mj.world.world import World

_COMMANDS = slice(TRAJECTORY_COLUMNS.index("command_left_rad_s"), None)
_STATE = mujoco.mjtState.mjSTATE_INTEGRATION


class NetworkCall(NamedTuple):
    """One stretch of network time: its steps, its drive (1000,) or None, and the dopamine released before it, (8,).

    `decides`: whether it is a thinking window, with which a decision begins.
    """

    decides: bool
    steps: int
    drive: NDArray[np.float64] | None
    released: tuple[NDArray[np.float64], ...]


class Attempt(NamedTuple):
    """One decision's way through the physics: what was asked of the body, and the wheel commands by period."""

    action: Action
    cell: Cell
    commands: NDArray[np.float64]


class Episode(NamedTuple):
    """From a spawn to the next: MuJoCo's state after the first, and the attempts in between."""

    state: NDArray[np.float64]
    attempts: list[Attempt]


@dataclass
class Recorded:
    """Everything that the physics and the network of one rollout were fed; `ended`: an episode ended with it."""

    episodes: list[Episode] = field(default_factory=list)
    network: list[NetworkCall] = field(default_factory=list)
    spikes: int = 0
    ended: bool = True

    @property
    def network_ms(self) -> int:
        """Neural steps in all."""
        return sum(call.steps for call in self.network)

    @property
    def periods(self) -> int:
        """Control periods in all."""
        return sum(len(attempt.commands) for episode in self.episodes for attempt in episode.attempts)


class HasPhysics(Protocol):
    """A `World`, or MuJoCo's own model and data alone."""

    @property
    def model(self) -> Any:
        """MuJoCo's model."""

    @property
    def data(self) -> Any:
        """MuJoCo's data."""


class Recorder:
    """Writes down what the physics of a robot are fed: `begin` before every decision, `add` after it."""

    def __init__(self) -> None:
        self.recorded = Recorded()

    def begin(self, world: World) -> None:
        """Keep the state, if an episode begins with the decision."""
        if self.recorded.ended:
            self.recorded.episodes.append(Episode(_physics_state(world), []))

    def add(self, driven: Action, cell: Cell, move: Move, *, ended: bool) -> None:
        """Keep the commands; `ended`: the episode is over."""
        self.recorded.episodes[-1].attempts.append(Attempt(driven, cell, move.trajectory[:, _COMMANDS].copy()))
        self.recorded.ended = ended


class _RecordingNetwork(Network):
    """A network that writes down what it is asked."""

    def __init__(self, recorded: Recorded, config: RunConfig) -> None:
        super().__init__(
            config.network, config.plasticity, neural_step_ms=config.clock.neural_step_ms, seed=config.seed
        )
        self._recorded = recorded
        self._waiting: list[NDArray[np.float64]] = []

    def advance(self, steps: int, drive: ArrayLike | None = None, *, extend: bool = False) -> NDArray[np.int64]:
        """Advance, and keep the call."""
        before = self.spike_count if extend else 0
        counts = super().advance(steps, drive, extend=extend)
        if steps:
            self._recorded.network.append(
                NetworkCall(not extend, steps, None if drive is None else np.asarray(drive), tuple(self._waiting))
            )
            self._waiting.clear()
            self._recorded.spikes += self.spike_count - before
        return counts

    def release_dopamine(self, amount: ArrayLike, *, delay_steps: int = 0) -> None:
        """Release, and keep the amount."""
        self._waiting.append(np.asarray(amount))
        super().release_dopamine(amount, delay_steps=delay_steps)


def record(config: RunConfig) -> Recorded:
    """Run the decisions once and keep what the physics and the network were fed.

    Raises:
        SclaError: the configuration has no network to replay, delays the dopamine, or disturbs the robot.
    """
    require_replayable(config)
    simulation, recorder = simulate(config), Recorder()
    assert isinstance(simulation.brain, SclaBrain)
    simulation.brain.network = _RecordingNetwork(recorder.recorded, config)
    for _ in range(config.epochs * config.decisions):
        recorder.begin(simulation.world)
        done = simulation.step()
        recorder.add(done.executed, done.percept.cell, done.move, ended=done.hit or done.move.fallen)
    return recorder.recorded


def require_replayable(config: RunConfig) -> None:
    """Refuse what the bare parts cannot replay, before anything is run.

    Raises:
        SclaError: the configuration has no network to replay, delays the dopamine, or disturbs the robot.
    """
    if not issubclass(BRAINS.get(config.brain, Brain), SclaBrain):
        raise SclaError(f"--brain {config.brain} has no network to replay: the bench takes scla or scla-printed")
    if config.plasticity.dopamine_delay_s:
        raise SclaError("--plasticity.dopamine-delay-s is not 0: the bench replays dopamine without delay")
    if config.disturbance != DisturbanceConfig() or config.localisation != "truth":
        raise SclaError("the bench replays an undisturbed robot that knows its pose: leave --disturb and the like out")


def _physics_state(world: World) -> NDArray[np.float64]:
    state = np.empty(mujoco.mj_stateSize(world.model, _STATE))
    mujoco.mj_getState(world.model, world.data, state, _STATE)
    return state


def set_physics_state(world: HasPhysics, state: NDArray[np.float64]) -> None:
    """Put the world where a recorded episode began."""
    mujoco.mj_setState(world.model, world.data, state, _STATE)


def replay_physics(world: HasPhysics, recorded: Recorded, steps_a_period: int) -> Iterator[None]:
    """Step the bare physics under the recorded commands, a compiled loop of `mj_step` alone; yields decisions."""
    for state, attempts in recorded.episodes:
        set_physics_state(world, state)
        for attempt in attempts:
            _step_through(world.model._address, world.data._address, world.data.ctrl, attempt.commands, steps_a_period)
            yield


@leaf_njit(from_python=True, nogil=True)
def _step_through(model: int, data: int, ctrl: Any, commands: Any, steps: int) -> None:
    for period in range(commands.shape[0]):
        ctrl[0], ctrl[1] = commands[period, 0], commands[period, 1]
        for _ in range(steps):
            mj_step(model, data)


def replay_moves(world: World, driver: Driver, recorded: Recorded, thinking_controls: int) -> Iterator[None]:
    """Carry out the recorded attempts again, controller and all; yields decisions."""
    for state, attempts in recorded.episodes:
        set_physics_state(world, state)
        for attempt in attempts:
            driver.drive(attempt.action, attempt.cell, standing=thinking_controls)
            yield


def replay_network(network: Network, recorded: Recorded) -> Iterator[None]:
    """Run the bare kernel on the recorded inputs: no copies, no checks, no spikes kept; yields decision windows."""
    longest = max((call.steps for call in recorded.network), default=0)
    room = longest * len(network.arrays.v) + 1
    spike_step, spike_neuron = np.empty(room, np.int32), np.empty(room, np.int32)
    counts, nothing = np.zeros(len(POPULATIONS), np.int64), np.zeros(len(PROJECTIONS))
    undriven = np.zeros_like(network.arrays.v)
    for call in recorded.network:
        if call.decides:
            yield
        released = sum(call.released, start=nothing)
        drive = undriven if call.drive is None else call.drive
        kernel.run(network.memory, drive, released, call.steps, 0, spike_step, spike_neuron, 0, counts)
