"""A decision carried out: whole moves of the robot, judged by where it truly ends up."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from scla_mj.clock import Clock
from scla_mj.config import ControllerConfig
from scla_mj.control.motion import (
    ARRIVED,
    DRIVING,
    RETURNED,
    Gains,
    Goal,
    make_gains,
)
from scla_mj.grid import Action, Cell
from scla_mj.loop.periods import FAULT, Body, Ending, crossed_in, robot_of, run_command, run_periods
from scla_mj.sense.odometry import Odometer
from scla_mj.signals import TRAJECTORY_COLUMNS, Move, Outcome
from scla_mj.world.perturbation import Perturbation
from scla_mj.world.world import Pose, World

_LEVEL_COSINE: Final = math.cos(math.radians(3.0))
"""Wheels that differ by 5 % either way lean a robot at rest by 1.2 degrees; at 3 degrees a ray rises by 5 cm per metre,
which is more than the walls reach above it."""

NO_ROWS: Final = np.empty((0, len(TRAJECTORY_COLUMNS)))
"""The trajectory of a move that nobody observes."""


def gains_of(world: World, clock: Clock, config: ControllerConfig) -> Gains:
    """Return the controller's gains for the world's robot."""
    return make_gains(config, world.dimensions, period_s=clock.control_period_s, cell_size_m=world.grid.cell_size_m)


class Driver:
    """Drives the world's robot, and keeps the run's time as a count of control periods that spawns do not reset.

    Args:
        perturbation: what perturbs the drives, None for nothing.
        odometer: what the controller steers by, None for the truth.
        look: corrects the odometer's estimate where the robot stands, and returns the correction in metres.
        before_first_drive: called once, for example to wait for code that another process compiles.

    Attributes:
        careful: whether it drives as on slippery ground: from a large correction by `look` to the next spawn.
    """

    def __init__(
        self,
        world: World,
        clock: Clock,
        config: ControllerConfig,
        *,
        perturbation: Perturbation | None = None,
        odometer: Odometer | None = None,
        look: Callable[[], float] | None = None,
        before_first_drive: Callable[[], None] | None = None,
    ) -> None:
        self._world = world
        self._clock = clock
        self._gains = gains_of(world, clock, config)
        data = world.data
        body = Body(
            world.model._address,
            data._address,
            clock.physics_steps_per_control,
            world.at,
            data.qpos,
            data.qvel,
            data.ctrl,
            data.sensordata,
            np.empty(len(Ending._fields)),
        )
        self._ending = body.ending
        self._robot = robot_of(body, self._gains)
        self._perturbation, self._odometer, self._look = perturbation, odometer, look
        self._before_first_drive = before_first_drive
        self._timeout_periods = math.ceil(config.timeout_s / clock.control_period_s)
        self._leg_periods = max(1, self._timeout_periods // 2)
        self._rows = np.empty((clock.thinking_controls + self._timeout_periods, len(TRAJECTORY_COLUMNS)))
        self._ways: dict[tuple[Cell, Action], tuple[Cell, Goal]] = {}
        self._filled = 0
        self.periods = 0
        self.careful = False

    @property
    def time_s(self) -> float:
        """The run's time."""
        return self.periods * self._clock.control_period_s

    def hold(self, controls: int) -> None:
        """Run control periods with the wheels commanded to rest."""
        self._run(Goal(0.0, 0.0, 0.0, 0.0), 0, standing=controls)

    def command(self, left_rad_s: float, right_rad_s: float, controls: int = 1) -> int:
        """Run control periods under one command of the wheels, and return which bumpers touched, FRONT and REAR.

        No trajectory is kept. A robot that has fallen is driven no further, but the time passes.
        """
        periods, touched = run_command(
            left_rad_s, right_rad_s, controls, self._perturbation, self._odometer, *self._robot
        )
        self.periods += controls
        self._world.steps += periods * self._clock.physics_steps_per_control
        return int(touched)

    def is_level(self) -> bool:
        """Return whether the robot stands, and leans so little that range rays meet the walls."""
        pose = self._standing()
        return pose is not None and pose.upright >= _LEVEL_COSINE

    def drive(self, action: Action, start_cell: Cell, *, standing: int = 0, observe: bool = True) -> Move:
        """Carry out one action from a cell to its end: the next cell, back from a wall, or a failure.

        The robot first stands for `standing` control periods, as in `hold`. The trajectory starts with these and with
        the periods of `hold` since the last move; without `observe` it is empty.
        """
        beyond, goal = self._ways.get((start_cell, action)) or self._way(start_cell, action)
        if self._odometer is not None:  # it must know where it stands before it starts
            self.hold(standing)
            standing = 0
        before = start_cell if self._odometer is None else self._true_cell(start_cell)
        first_row = self._filled + standing
        blind = self._odometer is None or self._look is None
        longest = self._timeout_periods if blind else self._leg_periods
        periods, status = self._run(goal, longest, standing=standing)
        crossed = int(self._ending[-1])
        if self._odometer is not None and self._look is not None and self._standing() is not None:
            periods, status = self._look_and_come_closer(self._odometer, self._look, goal, periods, status)
            crossed = crossed_in.py_func(self._rows, first_row, self._filled, goal)  # in the first leg or a later one
        trajectory = self._rows[: self._filled].copy() if observe else NO_ROWS
        self._filled = 0
        duration_s = periods * self._clock.control_period_s
        pose = self._standing()
        if pose is None:
            return Move(Outcome.FAILED, before, before, duration_s, math.nan, math.nan, True, trajectory)
        after, outcome, off_m, off_rad = self._judge(start_cell, beyond, status, pose)
        crossed_s = crossed * self._clock.control_period_s if outcome is Outcome.MOVED else None
        return Move(outcome, before, after, duration_s, off_m, off_rad, False, trajectory, crossed_s)

    def restart(self) -> None:
        """Start again at time 0."""
        self.periods, self.careful, self._filled = 0, False, 0

    def state(self) -> dict[str, Any]:
        """Return the run's time, and the trajectory rows that belong to no move yet."""
        return {"periods": self.periods, "careful": self.careful, "rows": self._rows[: self._filled].copy()}

    def restore(self, state: dict[str, Any]) -> None:
        """Resume from a `state`; the world restores the robot itself."""
        self.periods, self.careful, self._filled = state["periods"], state["careful"], 0
        self._reserve(len(state["rows"]))
        self._filled = len(state["rows"])
        self._rows[: self._filled] = state["rows"]

    def _run(self, goal: Goal, limit: int, *, standing: int = 0) -> tuple[int, int]:
        """Stand, then drive for at most `limit` control periods; return how many it drove, and the status."""
        self._reserve(standing + limit)
        if self._before_first_drive is not None:
            self._before_first_drive()
            self._before_first_drive = None
        periods, status = run_periods(
            standing,
            limit,
            self.careful,
            *goal,
            self._perturbation,
            self._odometer,
            self._rows,
            self._filled,
            self.periods,
            *self._robot,
        )
        self._filled += periods
        self.periods += max(periods, standing)  # one that lies is stepped no further, but the brain's window passes
        self._world.steps += periods * self._clock.physics_steps_per_control
        return max(0, periods - standing), status

    def _look_and_come_closer(
        self, odometer: Odometer, look: Callable[[], float], goal: Goal, periods: int, status: int
    ) -> tuple[int, int]:
        """Correct the estimate, and drive again as long as the robot is not where the drive should have ended.

        Returns:
            The periods of the whole move, and how its drive ended, unless the robot fell on a later one.
        """
        while True:
            periods += self._stand_level(self._timeout_periods - periods)
            if self._standing() is None:
                return periods, FAULT
            shift_m = look()
            astray = shift_m > self._gains.reaim_distance_m
            self.careful |= astray
            if status == RETURNED and astray:  # it may have touched another wall than the one in its way
                status = DRIVING
            if periods >= self._timeout_periods:
                break
            x_m, y_m = float(odometer.estimate[0]), float(odometer.estimate[1])
            end = (goal.target_x_m, goal.target_y_m) if status == ARRIVED else (goal.start_x_m, goal.start_y_m)
            if status == DRIVING:  # it tries again from its corrected place
                more, status = self._run(goal, self._timeout_periods - periods)
            elif math.hypot(end[0] - x_m, end[1] - y_m) > self._gains.reaim_distance_m:
                more, _ = self._run(Goal(x_m, y_m, *end), self._timeout_periods - periods)
            else:
                break
            periods += more
            if more == 0:  # it takes itself to be there
                break
        return periods, status

    def _stand_level(self, limit: int) -> int:
        """Stand for at most `limit` control periods until the robot leans no more, and return how many that took.

        The rays of a robot that leans meet the floor, or pass above the walls.
        """
        stood = 0
        while stood < limit:
            pose = self._standing()
            if pose is None or pose.upright >= _LEVEL_COSINE:
                break
            self.hold(1)
            stood += 1
        return stood

    def _way(self, start: Cell, action: Action) -> tuple[Cell, Goal]:
        """Return the cell that an action leads to, on the grid or not, and the way there; both are kept."""
        grid, beyond = self._world.grid, start.after(action)
        way = self._ways[start, action] = beyond, Goal(*grid.centre_m(start), *grid.centre_m(beyond))
        return way

    def _true_cell(self, believed: Cell) -> Cell:
        """Return the cell that the robot stands in, or the believed one where it does not stand."""
        pose = self._world.pose()
        return self._world.grid.cell_at(pose.x_m, pose.y_m) if pose.can_drive() else believed

    def _standing(self) -> Pose | None:
        """Return where the robot is, or None if it cannot continue: it has fallen, or its estimate is not finite."""
        x_m, y_m, heading_rad, upright, finite, _ = self._ending.tolist()
        pose = Pose(x_m, y_m, heading_rad, upright)
        lost = self._odometer is not None and not np.isfinite(self._odometer.estimate).all()
        return pose if finite and pose.can_drive() and not lost else None

    def _judge(self, start: Cell, beyond: Cell, status: int, pose: Pose) -> tuple[Cell, Outcome, float, float]:
        """Return, from the true pose alone, the cell, the outcome, and the distance and angle off the cell's centre."""
        grid = self._world.grid
        after = grid.cell_at(pose.x_m, pose.y_m)
        outcome = Outcome.FAILED
        if status == ARRIVED and after == beyond:
            outcome = Outcome.MOVED
        elif status == RETURNED and after == start and not grid.is_open(beyond):
            outcome = Outcome.BLOCKED
        x_m, y_m = grid.centre_m(after)
        off_m = math.hypot(pose.x_m - x_m, pose.y_m - y_m)
        quarter_turns = round(pose.heading_rad / (math.pi / 2))
        return after, outcome, off_m, pose.heading_rad - quarter_turns * math.pi / 2

    def _reserve(self, periods: int) -> None:
        """Make room for more rows; only a long series of holds needs it."""
        short = self._filled + periods - len(self._rows)
        if short > 0:
            self._rows = np.vstack([self._rows, np.empty((short, self._rows.shape[1]))])
