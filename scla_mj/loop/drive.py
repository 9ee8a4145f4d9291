"""Command and step physics: a whole move, controller and `mj_step` alike, inside one compiled call."""

from __future__ import annotations

import hashlib
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import llvmlite.binding
import mujoco
import numpy as np
from numba import njit, types

from scla_mj.control import controller, profile
from scla_mj.control.controller import (
    ARRIVED,
    DRIVING,
    RETURNED,
    STAND_STILL,
    START,
    STARTING,
    Goal,
    Motion,
    begin,
    make_gains,
    tick,
)
from scla_mj.grid import Action, Cell
from scla_mj.sense import odometry
from scla_mj.sense.odometry import advance
from scla_mj.signals import TRAJECTORY_COLUMNS, Move, Outcome
from scla_mj.world import interference
from scla_mj.world.interference import interfere
from scla_mj.world.world import UPRIGHT_COSINE

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import ModuleType

    from numpy.typing import NDArray

    from scla_mj.clock import Clock
    from scla_mj.config import ControllerConfig
    from scla_mj.control.controller import Gains, State
    from scla_mj.sense.odometry import Odometer
    from scla_mj.world.interference import Interference
    from scla_mj.world.world import World

FAULT: Final = 3
"""Beside the controller's own outcomes: the robot fell, or its state or a command was not finite."""


def _mujoco_library() -> str:
    """Return the path of MuJoCo's own library, next to its Python package."""
    folder = Path(mujoco.__file__).parent
    return str(next(path for pattern in ("libmujoco*", "mujoco.dll") for path in sorted(folder.glob(pattern))))


# The compiled loop calls MuJoCo's C function directly; llvmlite must know the library before numba loads its cache.
llvmlite.binding.load_library_permanently(_mujoco_library())
mj_step: Final = types.ExternalFunction("mj_step", types.void(types.intp, types.intp))


class Body(NamedTuple):
    """The robot as the compiled loop reaches it: addresses for `mj_step`, and views into its data."""

    model_address: int
    data_address: int
    steps_per_period: int
    qpos: NDArray[np.float64]
    qvel: NDArray[np.float64]
    ctrl: NDArray[np.float64]
    touch: NDArray[np.float64]


@njit(inline="always")
def _sense_motion(body: Body, touched: bool) -> tuple[Motion, float]:
    """Read the pose and the body's speeds, and how upright it is (not a number if the state is not)."""
    w, x, y, z = body.qpos[3], body.qpos[4], body.qpos[5], body.qpos[6]
    heading = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    speed = body.qvel[0] * math.cos(heading) + body.qvel[1] * math.sin(heading)
    return Motion(body.qpos[0], body.qpos[1], heading, speed, body.qvel[5], touched), 1.0 - 2.0 * (x * x + y * y)


@njit(inline="always")
def _believed_motion(odometer: Odometer, touched: bool) -> Motion:
    """What the robot's own sensors make of its pose and speeds."""
    estimate = odometer.estimate
    return Motion(estimate[0], estimate[1], estimate[2], estimate[3], estimate[4], touched)


@njit(inline="always")
def _write_row(row: NDArray[np.float64], time_s: float, body: Body) -> None:
    """Fill a trajectory's row: the time, the pose with both wheels' angles, the wheel speeds as commanded."""
    row[0] = time_s
    for i in range(9):
        row[1 + i] = body.qpos[i]
    row[10], row[11] = body.ctrl[0], body.ctrl[1]


def _compile(source_digest: str) -> Callable[..., tuple[int, int]]:
    """Return the compiled loop.

    numba caches it by this file's date alone, and would go on with an old controller; constants of a closure are part
    of the cache's key too, so the digest of the sources of what it calls is one. Where there is no disturbance or no
    odometry, numba compiles a loop that knows of none.
    """

    @njit(cache=True, nogil=True)
    def run_periods(
        body: Body,
        state: State,
        goal: Goal,
        gains: Gains,
        rows: NDArray[np.float64],
        first_row: int,
        elapsed: int,
        limit: int,
        disturbance: Interference | None,
        odometer: Odometer | None,
    ) -> tuple[int, int]:
        """Run control periods until the move ends or `limit` periods have passed.

        Args:
            rows: the trajectory; a row is written for every period that was run, from `first_row` on.
            first_row: its first free row.
            elapsed: control periods since the run's start.
            limit: the most periods to run.
            disturbance: what comes between the command and the wheels, if anything.
            odometer: what the robot steers by; None if the simulator tells it the truth.

        Returns:
            The periods that were run, and ARRIVED, RETURNED, FAULT, or DRIVING where the limit ended them.
        """
        assert source_digest
        touched = False
        if state.phase == STARTING:
            motion = _sense_motion(body, touched)[0] if odometer is None else _believed_motion(odometer, touched)
            state = begin(goal, motion.heading_rad)
        for period in range(limit):
            motion, upright = _sense_motion(body, touched)
            if odometer is not None:
                motion = _believed_motion(odometer, touched)
            if not upright >= UPRIGHT_COSINE:
                return period, FAULT
            state, left, right, status = tick(state, motion, goal, gains)
            if not (math.isfinite(left) and math.isfinite(right)):
                return period, FAULT
            if status != DRIVING:
                return period, status
            if disturbance is not None:
                left, right = interfere(disturbance, left, right)
            body.ctrl[0], body.ctrl[1] = left, right
            touched, turned = False, 0.0
            for _ in range(body.steps_per_period):
                mj_step(body.model_address, body.data_address)
                touched |= body.touch[0] > 0.0 or body.touch[1] > 0.0
                if odometer is not None:
                    turned += body.qvel[5]
            if odometer is not None:
                turned *= gains.period_s / body.steps_per_period
                advance(odometer, body.qpos[7], body.qpos[8], turned)
            _write_row(rows[first_row + period], (elapsed + period + 1) * gains.period_s, body)
        return limit, DRIVING

    compiled: Callable[..., tuple[int, int]] = run_periods
    return compiled


def _source_digest(*modules: ModuleType) -> str:
    return hashlib.sha256(b"".join(Path(str(module.__file__)).read_bytes() for module in modules)).hexdigest()


run_periods: Final = _compile(_source_digest(controller, profile, interference, odometry))


class Driver:
    """Drives the world's robot, and keeps the run's time as a count of control periods that no spawn sets back.

    `disturbance` comes between the controller and the wheels; `odometer` is what the controller steers by, or None for
    the truth.
    """

    def __init__(
        self,
        world: World,
        clock: Clock,
        config: ControllerConfig,
        *,
        disturbance: Interference | None = None,
        odometer: Odometer | None = None,
    ) -> None:
        self._world = world
        self._clock = clock
        self._gains = make_gains(
            config,
            period_s=clock.control_period_s,
            wheel_radius_m=world.wheel_radius_m,
            track_m=world.track_m,
            top_wheel_speed_rad_s=world.top_wheel_speed_rad_s,
            cell_size_m=world.grid.cell_size_m,
        )
        data = world.data
        self._body = Body(
            world.model._address,
            data._address,
            clock.physics_steps_per_control,
            data.qpos,
            data.qvel,
            data.ctrl,
            world.touch,
        )
        self._disturbance, self._odometer = disturbance, odometer
        self._timeout_periods = math.ceil(config.timeout_s / clock.control_period_s)
        self._rows = np.empty((clock.thinking_controls + self._timeout_periods, len(TRAJECTORY_COLUMNS)))
        self._filled = 0
        self.periods = 0

    @property
    def time_s(self) -> float:
        """The run's time."""
        return self.periods * self._clock.control_period_s

    def hold(self, controls: int) -> None:
        """Let the robot stand for some control periods, its wheels commanded to rest, while the physics goes on."""
        self._reserve(controls)
        self._run(STAND_STILL, Goal(0.0, 0.0, 0.0, 0.0), controls)

    def drive(self, action: Action, start_cell: Cell) -> Move:
        """Carry out one action from a cell, to the end: the next cell, back from a wall, or a failure.

        The move's trajectory opens with the periods of `hold` since the last move.
        """
        grid = self._world.grid
        goal = Goal(*grid.centre_m(start_cell), *grid.centre_m(start_cell.after(action)))
        self._reserve(self._timeout_periods)
        before = start_cell if self._odometer is None else self._true_cell(start_cell)
        periods, status = self._run(START, goal, self._timeout_periods)
        trajectory = self._rows[: self._filled].copy()
        self._filled = 0
        duration_s = periods * self._clock.control_period_s
        if not self._can_go_on():
            return Move(Outcome.FAILED, before, before, duration_s, math.nan, math.nan, True, trajectory)
        return self._judge(action, start_cell, status, before, duration_s, trajectory)

    def state(self) -> dict[str, Any]:
        """Return the run's time, and the rows that no move has taken yet."""
        return {"periods": self.periods, "rows": self._rows[: self._filled].copy()}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a `state`; the robot itself is the world's."""
        self.periods, self._filled = state["periods"], 0
        self._reserve(len(state["rows"]))
        self._filled = len(state["rows"])
        self._rows[: self._filled] = state["rows"]

    def _run(self, state: State, goal: Goal, limit: int) -> tuple[int, int]:
        periods, status = run_periods(
            self._body,
            state,
            goal,
            self._gains,
            self._rows,
            self._filled,
            self.periods,
            limit,
            self._disturbance,
            self._odometer,
        )
        self._filled += periods
        self.periods += periods
        self._world.steps += periods * self._clock.physics_steps_per_control
        return periods, status

    def _true_cell(self, believed: Cell) -> Cell:
        """Return the cell that the robot stands in, or the believed one where it does not stand."""
        pose = self._world.pose()
        return self._world.grid.cell_at(pose.x_m, pose.y_m) if pose.can_drive() else believed

    def _can_go_on(self) -> bool:
        """Tell whether the robot stands, and has a place in mind."""
        return self._world.can_drive() and (self._odometer is None or bool(np.isfinite(self._odometer.estimate).all()))

    def _judge(
        self,
        action: Action,
        start: Cell,
        status: int,
        before: Cell,
        duration_s: float,
        trajectory: NDArray[np.float64],
    ) -> Move:
        """Say how the move of a robot that can go on has ended, from its physical pose alone."""
        grid, pose = self._world.grid, self._world.pose()
        after = grid.cell_at(pose.x_m, pose.y_m)
        outcome = Outcome.FAILED
        if status == ARRIVED and after == start.after(action):
            outcome = Outcome.MOVED
        elif status == RETURNED and after == start:
            outcome = Outcome.BLOCKED
        x_m, y_m = grid.centre_m(after)
        off_m = math.hypot(pose.x_m - x_m, pose.y_m - y_m)
        quarter_turns = round(pose.heading_rad / (math.pi / 2))
        off_rad = pose.heading_rad - quarter_turns * math.pi / 2
        return Move(outcome, before, after, duration_s, off_m, off_rad, False, trajectory)

    def _reserve(self, periods: int) -> None:
        """Make room for more rows (only a long series of holds needs it)."""
        short = self._filled + periods - len(self._rows)
        if short > 0:
            self._rows = np.vstack([self._rows, np.empty((short, self._rows.shape[1]))])
