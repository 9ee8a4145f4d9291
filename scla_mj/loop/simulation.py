"""One decision in arrow order: sense, think, decide, command, step physics, learn, record."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from scla_mj.errors import SclaError
from scla_mj.sense.target_sensor import TargetSensor
from scla_mj.signals import DecisionRecord, Feedback, Outcome, Percept

if TYPE_CHECKING:
    from scla_mj.brain.base import Brain
    from scla_mj.clock import Clock
    from scla_mj.grid import Cell, Grid, StartProtocol
    from scla_mj.loop.action_noise import ActionNoise
    from scla_mj.loop.drive import Driver
    from scla_mj.loop.localiser import Localiser
    from scla_mj.signals import Move
    from scla_mj.world.disturbance import Disturbance
    from scla_mj.world.world import World

_QUARTER_TURN_RAD: Final = math.pi / 2
_HELPLESS_MOVES: Final = 3
"""After that many failed moves in a row a robot is stuck or lost, and is put down elsewhere: one may be bad luck."""


class Simulation:
    """A robot with a brain on a floor, one decision at a time; the run's time goes on over re-spawns."""

    def __init__(
        self,
        *,
        grid: Grid,
        clock: Clock,
        protocol: StartProtocol,
        world: World,
        brain: Brain,
        driver: Driver,
        noise: ActionNoise,
        disturbance: Disturbance,
        localiser: Localiser,
        spawn: np.random.Generator,
    ) -> None:
        self.world = world
        self.brain = brain
        self._grid = grid
        self._thinking_controls = clock.thinking_controls
        self._protocol = protocol
        self._starts = grid.start_cells(protocol)
        self._sensor = TargetSensor(grid)
        self._driver = driver
        self._noise = noise
        self._disturbance = disturbance
        self._localiser = localiser
        self._spawn = spawn
        self._failures = 0
        self._percept: Percept | None = None
        self._respawn()

    @property
    def time_s(self) -> float:
        """The run's time so far."""
        return self._driver.time_s

    def step(self, *, epoch: int, decision: int, observe: bool = True) -> DecisionRecord:
        """Let the robot make one decision and drive it; `epoch` and `decision` are the record's numbers.

        The record has the brain's activity and the move's trajectory if it is to `observe` them: copies take time.
        """
        started_s = self.time_s
        percept, localised = self._percept or self._sense(), self._localiser.error()
        chosen = self.brain.decide(percept)
        executed = self._noise.execute(chosen.action)
        move = self._driver.drive(executed, percept.cell, standing=self._thinking_controls, observe=observe)
        self.brain.elapse(move.duration_s)
        hit = not move.fallen and move.after == self._grid.target
        move = self._given_up(move, hit)
        now = self._percept = self._sense_after(move, percept)
        self.brain.learn(Feedback(percept, chosen.action, executed, move.outcome, now, hit))
        activity = self.brain.activity() if observe else None
        if hit or move.fallen:
            self._respawn()
        return DecisionRecord(epoch, decision, started_s, percept, chosen, executed, move, hit, activity, localised)

    def move_target(self, grid: Grid) -> None:
        """Put the target where `grid` has it; the brain is not told. A robot that stands there starts anew."""
        self._grid, self._percept = grid, None
        self._starts = grid.start_cells(self._protocol)
        self._sensor = TargetSensor(grid)
        self.world.move_target(grid.target)
        pose = self.world.pose()
        if grid.cell_at(pose.x_m, pose.y_m) == grid.target:
            self._respawn()

    def state(self) -> dict[str, Any]:
        """Return all that changes between decisions but the target's place; "brain" is None if that one cannot tell."""
        return {
            "world": self.world.state(),
            "driver": self._driver.state(),
            "noise": self._noise.state(),
            "disturbance": self._disturbance.state(),
            "localiser": self._localiser.state(),
            "spawn": self._spawn.bit_generator.state,
            "failures": self._failures,
            "brain": self.brain.state(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a `state`, to the bit, once the target is where it was (see `move_target`)."""
        self._disturbance.restore(state["disturbance"])  # before the world's state, which is one of that model
        self.world.restore(state["world"])
        self._driver.restore(state["driver"])
        self._noise.restore(state["noise"])
        self._localiser.restore(state["localiser"])
        self._spawn.bit_generator.state = state["spawn"]
        self._failures, self._percept = state["failures"], None
        self.brain.restore(state["brain"])

    def _sense(self, cell: Cell | None = None) -> Percept:
        """Return what the robot senses, which stands in `cell` if that is known."""
        if cell is None:
            pose = self.world.pose()
            cell = self._grid.cell_at(pose.x_m, pose.y_m)
        believed = cell if self._localiser.odometer is None else self._grid.cell_at(*self._localiser.position_m())
        return self._sensor.sense(cell, believed)

    def _sense_after(self, move: Move, before: Percept) -> Percept:
        """Return what the robot senses after a move; one that is to be put down elsewhere knows no more than before."""
        if not move.fallen or self.world.can_drive():
            self._refuse_faults()
        return before if move.fallen else self._sense(move.after)

    def _given_up(self, move: Move, hit: bool) -> Move:
        """Count failures in a row, and take a robot that does nothing but fail for one that cannot drive on."""
        self._failures = self._failures + 1 if move.outcome is Outcome.FAILED and not hit else 0
        return move._replace(fallen=True) if self._failures >= _HELPLESS_MOVES else move

    def _refuse_faults(self) -> None:
        """Stop at once where MuJoCo warned or reset itself: what it computed since then is not to be trusted."""
        if self.world.has_misbehaved():
            faults = "; ".join(self.world.faults())
            raise SclaError(f"the physics went wrong at {self.time_s:.2f} s: {faults}; use a smaller physics step")

    def _respawn(self) -> None:
        """Put the robot into a start cell, facing one of the four directions: the one teleport there is."""
        cell = self._starts[self._spawn.integers(len(self._starts))]
        heading_rad = _QUARTER_TURN_RAD * int(self._spawn.integers(4))
        self._disturbance.renew()
        self.world.spawn(cell, heading_rad, derive=False)
        self._localiser.told()
        self._driver.careful = False
        self._failures, self._percept = 0, self._sense(cell)
