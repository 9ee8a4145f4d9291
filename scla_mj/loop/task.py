"""What is asked of the robot, without a brain: sense, carry out an action on real wheels, respawn where it hits."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from scla_mj.errors import SclaError
from scla_mj.grid import Action, Cell, Grid, StartProtocol
from scla_mj.loop.action_noise import ActionNoise
from scla_mj.loop.drive import Driver
from scla_mj.loop.localiser import Localiser
from scla_mj.randomness import Consumer, generator, require_seed
from scla_mj.restoring import restore_whole
from scla_mj.sense.target_sensor import TargetSensor
from scla_mj.signals import Feedback, Localised, Move, Outcome, Percept
from scla_mj.validation import shown
from scla_mj.world.domain_randomisation import DomainRandomisation
from scla_mj.world.world import World

QUARTER_TURN_RAD: Final = math.pi / 2
HELPLESS_MOVES: Final = 3
"""After that many failed moves in a row a robot is stuck or lost, and is put down elsewhere: one may be bad luck."""


class Step(NamedTuple):
    """What came of one action.

    `feedback` is what a brain may learn from; `move` is the truth about the body; `started_s` is the run's time when
    the decision window opened; `localised` says how wrong the robot was about its place then. `driven` is the direction
    that the body was sent in: `feedback.executed`, or with crossed wheels its opposite.
    """

    feedback: Feedback
    move: Move
    started_s: float
    localised: Localised | None
    driven: Action


class Task:
    """A robot in its arena, one action at a time; the run's time continues over respawns.

    Args:
        grid: the arena, with its target.
        protocol: where a hit respawns the robot.
        decision_window: control periods for which the robot stands before each move, while a brain thinks.
        streams: the generators of all that is drawn here, by consumer; `reseed` sets them anew.
        sensors: what else is read from the world for every percept, by name.
        crossed: whether the wheels are crossed from the start.

    Attributes:
        crossed: left drives right, up drives down, and the reverse; what a brain is told is in its own directions. Can
            be assigned between two actions.
    """

    def __init__(
        self,
        *,
        grid: Grid,
        protocol: StartProtocol,
        decision_window: int,
        world: World,
        driver: Driver,
        noise: ActionNoise,
        randomisation: DomainRandomisation,
        localiser: Localiser,
        streams: Mapping[Consumer, np.random.Generator],
        sensors: Mapping[str, Callable[[World], Any]],
        crossed: bool = False,
    ) -> None:
        if not isinstance(sensors, Mapping) or not all(isinstance(k, str) and callable(v) for k, v in sensors.items()):
            raise SclaError(f"sensors is {shown(sensors)}: it must be a dict of functions of the world, by name")
        self.crossed = crossed
        self.world = world
        self.grid = grid
        self._decision_window = decision_window
        self._protocol = protocol
        self._starts = grid.start_cells(protocol)
        self._sensor = TargetSensor(grid)
        self._driver = driver
        self._noise = noise
        self._randomisation = randomisation
        self._localiser = localiser
        self._streams = streams
        self._sensors = sensors
        self._spawn = streams[Consumer.SPAWN]
        self._failures = 0
        self._percept: Percept | None = None
        self._localised: Localised | None = None
        self.respawn()

    @property
    def time_s(self) -> float:
        """The run's time so far."""
        return self._driver.time_s

    @property
    def percept(self) -> Percept:
        """What the robot senses now."""
        if self._percept is None:
            self._percept = self._sense()
        return self._percept

    def act(self, action: Action, *, observe: bool = True, respawn: bool = True) -> Step:
        """Stand through the decision window, then carry out one action; after a hit or a fall the robot respawns.

        Without `observe` the move's trajectory is left empty: copies take time. Without `respawn` the robot stays where
        a hit or a fall has left it: the caller respawns it before the next action.

        Raises:
            SclaError: `action` is not an `Action`; or MuJoCo warned or reset itself, so that what it computed
                cannot be trusted.
        """
        if not isinstance(action, Action):
            raise SclaError(f"the action is {action!r}: it must be an Action, such as Action.UP")
        before, localised, started_s = self.percept, self._localised, self.time_s
        executed = self._noise.execute(action)
        driven = executed.opposite if self.crossed else executed
        move = self._driver.drive(driven, before.cell, standing=self._decision_window, observe=observe)
        hit = not move.fallen and move.after in self.grid.targets
        move = self._given_up(move, hit)
        after = self._percept = self._sense_after(move, before)
        if respawn and (hit or move.fallen):
            self.respawn()
        feedback = Feedback(before, action, executed, move.outcome, after, hit, move.crossed_s)
        return Step(feedback, move, started_s, localised, driven)

    def command(self, left_rad_s: float, right_rad_s: float, controls: int = 1) -> int:
        """Turn the wheels for some control periods, without a decision; a robot with range rays then looks around.

        Nothing respawns the robot.

        Returns:
            Which bumpers touched: FRONT, REAR, both or 0.

        Raises:
            SclaError: as `act`.
        """
        touched, self._percept = self._driver.command(left_rad_s, right_rad_s, controls), None
        if self.world.can_drive():
            self._refuse_faults()
            if self._driver.is_level():
                self._localiser.look()
        return touched

    def place(self) -> tuple[float, float, float]:
        """Return where the robot believes to be: x and y in metres, and its heading in radians."""
        return self._localiser.place()

    def move_target(self, grid: Grid) -> None:
        """Put the targets where `grid` has them; a robot that stands on one respawns."""
        self.grid, self._percept = grid, None
        self._starts = grid.start_cells(self._protocol)
        self._sensor = TargetSensor(grid)
        self.world.move_target(grid)
        pose = self.world.pose()
        if grid.cell_at(pose.x_m, pose.y_m) in grid.targets:
            self.respawn()

    def respawn(self) -> Percept:
        """Put the robot into a start cell, facing one of the four directions, and return what it senses there.

        This is the one teleport there is.
        """
        cell = self._starts[self._spawn.integers(len(self._starts))]
        heading_rad = QUARTER_TURN_RAD * int(self._spawn.integers(4))
        self._randomisation.renew()
        self.world.spawn(cell, heading_rad, derive=False)
        self._localiser.set_to_truth()
        self._driver.careful = False
        self._failures = 0
        self._percept = self._sense(cell)
        return self._percept

    def reseed(self, seed: int) -> Percept:
        """Start again at time 0 with a new seed: bit-identical to a fresh task of that seed, target and wheels.

        Returns:
            What the robot senses in its first start cell.

        Raises:
            SclaError: `seed` is not one that a run can have.
        """
        require_seed(seed)
        for consumer, stream in self._streams.items():
            stream.bit_generator.state = generator(seed, consumer).bit_generator.state
        self._driver.restart()
        self._localiser.power_on()
        return self.respawn()

    def state(self) -> dict[str, Any]:
        """Return all that changes between actions, but for the target's place."""
        return {
            "world": self.world.state(),
            "driver": self._driver.state(),
            "noise": self._noise.state(),
            "randomisation": self._randomisation.state(),
            "localiser": self._localiser.state(),
            "spawn": self._spawn.bit_generator.state,
            "failures": self._failures,
            "crossed": self.crossed,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a `state`, bit for bit, once the target is where it was (see `move_target`).

        Raises:
            SclaError: it is not the state of such a task; nothing is changed then.
        """
        restore_whole(state, self.state(), self._put_back, name="the task's state", free=("rows",))

    def _put_back(self, state: dict[str, Any]) -> None:
        self._randomisation.restore(state["randomisation"])  # before the world's state, which is one of that model
        self.world.restore(state["world"])
        self._driver.restore(state["driver"])
        self._noise.restore(state["noise"])
        self._localiser.restore(state["localiser"])
        self._spawn.bit_generator.state = state["spawn"]
        self._failures, self.crossed, self._percept = state["failures"], state["crossed"], None

    def _sense(self, cell: Cell | None = None) -> Percept:
        """Return what the robot senses, which stands in `cell` if that is known."""
        if cell is None:
            pose = self.world.pose()
            cell = self.grid.cell_at(pose.x_m, pose.y_m)
        self._localised = self._localiser.error()
        believed = cell if self._localiser.odometer is None else self.grid.cell_at(*self._localiser.position_m())
        percept = self._sensor.sense(cell, believed)
        if self._sensors:
            percept = percept._replace(readings={name: read(self.world) for name, read in self._sensors.items()})
        return percept

    def _sense_after(self, move: Move, before: Percept) -> Percept:
        """Return what the robot senses after a move; one that is to be put down elsewhere knows no more than before."""
        if not move.fallen or self.world.can_drive():
            self._refuse_faults()
        return before if move.fallen else self._sense(move.after)

    def _given_up(self, move: Move, hit: bool) -> Move:
        """Count failures in a row, and take a robot that does nothing but fail for one that cannot drive on."""
        self._failures = self._failures + 1 if move.outcome is Outcome.FAILED and not hit else 0
        return move._replace(fallen=True) if self._failures >= HELPLESS_MOVES else move

    def _refuse_faults(self) -> None:
        if self.world.has_misbehaved():
            faults = "; ".join(self.world.faults())
            raise SclaError(f"the physics went wrong at {self.time_s:.2f} s: {faults}; use a smaller physics step")
