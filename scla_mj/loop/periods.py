"""The compiled loop: command, perturb, step physics, sense motion, one control period after another."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Final, NamedTuple

import llvmlite.binding
import mujoco
import numpy as np
from numba import types
from numba.np.unsafe.ndarray import to_fixed_tuple
from numpy.typing import NDArray

from scla_mj.compiled import cached_njit, leaf_njit
from scla_mj.control import caution, controller, motion, profile
from scla_mj.control.controller import begin, tick
from scla_mj.control.motion import DRIVING, FRONT, REAR, STAND_STILL, STARTING, Gains, Goal, Motion, State
from scla_mj.sense import odometry
from scla_mj.sense.odometry import Odometer, advance
from scla_mj.world import perturbation, robot
from scla_mj.world.perturbation import Perturbation, perturb, within_reach
from scla_mj.world.robot import Addresses
from scla_mj.world.world import UPRIGHT_COSINE

FAULT: Final = 3
"""In addition to the controller's outcomes: the robot fell, or its state or a command was not finite."""


def _mujoco_library() -> str:
    """Return the path of MuJoCo's own library, next to its Python package."""
    folder = Path(mujoco.__file__).parent
    return str(next(path for pattern in ("libmujoco*", "mujoco.dll") for path in sorted(folder.glob(pattern))))


# The compiled loop calls MuJoCo's C function directly; llvmlite must know the library before numba loads its cache.
llvmlite.binding.load_library_permanently(_mujoco_library())
mj_step: Final = types.ExternalFunction("mj_step", types.void(types.intp, types.intp))


class Body(NamedTuple):
    """The robot as the compiled loop reaches it: addresses for `mj_step`, where its parts are in the views of its data,
    and room for an `Ending`."""

    model_address: int
    data_address: int
    steps_per_period: int
    at: Addresses
    qpos: NDArray[np.float64]
    qvel: NDArray[np.float64]
    ctrl: NDArray[np.float64]
    sensordata: NDArray[np.float64]
    ending: NDArray[np.float64]


class Ending(NamedTuple):
    """Where a robot is after its control periods: the fields of a `Pose`, whether its whole state is finite, and the
    period in which the axle crossed into the next cell (`crossed_in`; of no meaning in a move to no other cell)."""

    x_m: float
    y_m: float
    heading_rad: float
    upright: float
    finite: float
    crossed: float


_ADDRESSES: Final = len(Addresses._fields)
_GAINS: Final = len(Gains._fields)


@leaf_njit(inline="always")
def _sense_motion(body: Body, touched: int) -> Motion:
    """Read the pose and the body's speeds, and how upright it is (not a number if the state is not)."""
    qpos, qvel, root, dof = body.qpos, body.qvel, body.at.root_qpos, body.at.root_dof
    w, x, y, z = qpos[root + 3], qpos[root + 4], qpos[root + 5], qpos[root + 6]
    heading = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    speed = qvel[dof] * math.cos(heading) + qvel[dof + 1] * math.sin(heading)
    upright = 1.0 - 2.0 * (x * x + y * y)
    pitch = 2.0 * (w * y - x * z)
    return Motion(qpos[root], qpos[root + 1], heading, speed, qvel[dof + 5], touched, upright, pitch, qvel[dof + 4])


@leaf_njit(inline="always")
def _believed_motion(odometer: Odometer, true: Motion) -> Motion:
    """Pose and speeds as the odometer estimates them; touch and lean are the true ones."""
    estimate = odometer.estimate
    x_m, y_m, heading_rad, speed_m_s, turn_rate_rad_s = estimate[0], estimate[1], estimate[2], estimate[3], estimate[4]
    return Motion(x_m, y_m, heading_rad, speed_m_s, turn_rate_rad_s, *true[5:])


@leaf_njit(inline="always")
def _touch_of(body: Body) -> int:
    """Return which bumpers touch after the latest step, as bits of `Motion.touched`."""
    at, force = body.at, body.sensordata
    return (FRONT if force[at.front_touch] > 0.0 else 0) | (REAR if force[at.rear_touch] > 0.0 else 0)


@leaf_njit(inline="always")
def _write_row(row: NDArray[np.float64], time_s: float, body: Body) -> None:
    """Fill a trajectory's row: the time, the pose with both wheels' angles, the wheel speeds as commanded."""
    at, qpos, ctrl = body.at, body.qpos, body.ctrl
    row[0] = time_s
    for i in range(7):
        row[1 + i] = qpos[at.root_qpos + i]
    row[8], row[9] = qpos[at.left_qpos], qpos[at.right_qpos]
    row[10], row[11] = ctrl[at.left_motor], ctrl[at.right_motor]


@leaf_njit(inline="always")
def _step(
    body: Body,
    left: float,
    right: float,
    step_s: float,
    perturbation: Perturbation | None,
    odometer: Odometer | None,
) -> int:
    """Step the physics through a control period under these commands; return which bumpers touched in it."""
    at, qpos, qvel = body.at, body.qpos, body.qvel
    body.ctrl[at.left_motor], body.ctrl[at.right_motor] = left, right
    touched, turned = 0, 0.0
    for _ in range(body.steps_per_period):
        if perturbation is not None:
            body.ctrl[at.left_motor] = within_reach(perturbation, left, qvel[at.left_dof])
            body.ctrl[at.right_motor] = within_reach(perturbation, right, qvel[at.right_dof])
        mj_step(body.model_address, body.data_address)
        touched |= _touch_of(body)
        turned += body.qvel[at.root_dof + 5] * step_s
    if odometer is not None:
        advance(odometer, qpos[at.left_qpos], qpos[at.right_qpos], turned)
    return touched


@leaf_njit(inline="always")
def write_ending(body: Body) -> None:
    """Fill in the body's `Ending`."""
    motion = _sense_motion(body, 0)
    total = 0.0
    for i in range(body.qpos.shape[0]):
        total += body.qpos[i]
    for i in range(body.qvel.shape[0]):
        total += body.qvel[i]
    body.ending[0], body.ending[1] = motion.x_m, motion.y_m
    body.ending[2], body.ending[3] = motion.heading_rad, motion.upright
    body.ending[4] = 1.0 if math.isfinite(total) else 0.0


@leaf_njit(inline="always")
def crossed_in(rows: NDArray[np.float64], standing: int, stepped: int, goal: Goal) -> int:
    """Return the period of the drive, from 1, at whose end the axle had crossed the border half-way to the goal's cell.

    Rows from `standing` to `stepped` are the drive's. In one without a crossing it is the last.
    """
    along_x, along_y = goal.target_x_m - goal.start_x_m, goal.target_y_m - goal.start_y_m
    border = along_x * (goal.start_x_m + 0.5 * along_x) + along_y * (goal.start_y_m + 0.5 * along_y)
    period = standing
    while period < stepped - 1 and along_x * rows[period, 1] + along_y * rows[period, 2] < border:
        period += 1
    return period - standing + 1


def robot_of(body: Body, gains: Gains) -> tuple[Any, ...]:
    """Return the robot as arrays, its integers in one and its gains in another: numba unpacks tuples and single numbers
    more slowly."""
    numbers = np.array([body.model_address, body.data_address, body.steps_per_period, *body.at], np.int64)
    return body.qpos, body.qvel, body.ctrl, body.sensordata, body.ending, numbers, np.array(gains, np.float64)


@leaf_njit(inline="always")
def drive(
    standing: int,
    limit: int,
    careful: bool,
    goal: Goal,
    gains: Gains,
    body: Body,
    perturbation: Perturbation | None,
    odometer: Odometer | None,
    rows: NDArray[np.float64],
    elapsed: int,
) -> tuple[int, int]:
    """Run the control periods of `run_periods`; callers are compiled."""
    state, touched, step_s = STAND_STILL, 0, gains.period_s / body.steps_per_period
    for period in range(standing + limit):
        if period == standing:
            state, touched = State(STARTING, 0.0, 1.0, 0, 0.0, 0.0, careful), 0
        motion = _sense_motion(body, touched)
        if not motion.upright >= UPRIGHT_COSINE:
            return period, FAULT
        if odometer is not None:
            motion = _believed_motion(odometer, motion)
        if state.phase == STARTING:
            state = begin(goal, motion.heading_rad, state.careful)
        state, left, right, status = tick(state, motion, goal, gains)
        if not (math.isfinite(left) and math.isfinite(right)):
            return period, FAULT
        if status != DRIVING:
            return period, status
        if perturbation is not None:
            left, right = perturb(perturbation, left, right)
        touched = _step(body, left, right, step_s, perturbation, odometer)
        _write_row(rows[period], (elapsed + period + 1) * gains.period_s, body)
    return standing + limit, DRIVING


@cached_njit(caution, controller, motion, profile, perturbation, robot, odometry, nogil=True)
def run_periods(
    standing: int,
    limit: int,
    careful: bool,
    start_x_m: float,
    start_y_m: float,
    target_x_m: float,
    target_y_m: float,
    perturbation: Perturbation | None,
    odometer: Odometer | None,
    rows: NDArray[np.float64],
    filled: int,
    elapsed: int,
    *robot: Any,
) -> tuple[int, int]:
    """Run control periods: first standing still, then driving until the move ends or `limit` periods have passed.

    Args:
        standing, limit: control periods of standing still, and the most of driving.
        careful: whether the robot drives as on slippery ground.
        start_x_m, start_y_m, target_x_m, target_y_m: the move's `Goal`.
        perturbation, odometer: what perturbs the drive, and what the robot steers by instead of the truth; for None
            numba compiles a loop without it.
        rows, filled: the trajectory, to which one row per period is written after the `filled` ones.
        elapsed: control periods since the run's start.
        robot: what `robot_of` returns.

    Returns:
        The number of periods, and ARRIVED, RETURNED, FAULT, or DRIVING if the limit was reached; `ending` is filled.
    """
    qpos, qvel, ctrl, sensordata, ending, whole, real = robot
    at, gains = Addresses(*to_fixed_tuple(whole[3:], _ADDRESSES)), Gains(*to_fixed_tuple(real, _GAINS))
    body = Body(whole[0], whole[1], whole[2], at, qpos, qvel, ctrl, sensordata, ending)
    goal, rows = Goal(start_x_m, start_y_m, target_x_m, target_y_m), rows[filled:]
    periods, status = drive(standing, limit, careful, goal, gains, body, perturbation, odometer, rows, elapsed)
    write_ending(body)
    ending[5] = crossed_in(rows, standing, periods, goal)
    return periods, status


@cached_njit(motion, perturbation, robot, odometry, nogil=True)
def run_command(
    left: float, right: float, limit: int, perturbation: Perturbation | None, odometer: Odometer | None, *robot: Any
) -> tuple[int, int]:
    """Run at most `limit` control periods under one command of both wheels, in rad/s; a robot that lies stops.

    Returns:
        The number of periods, and which bumpers touched in them; `ending` is filled.
    """
    qpos, qvel, ctrl, sensordata, ending, whole, real = robot
    at, gains = Addresses(*to_fixed_tuple(whole[3:], _ADDRESSES)), Gains(*to_fixed_tuple(real, _GAINS))
    body = Body(whole[0], whole[1], whole[2], at, qpos, qvel, ctrl, sensordata, ending)
    touched, periods, step_s = 0, 0, gains.period_s / body.steps_per_period
    while periods < limit and _sense_motion(body, 0).upright >= UPRIGHT_COSINE:
        left_now, right_now = left, right
        if perturbation is not None:
            left_now, right_now = perturb(perturbation, left, right)
        touched |= _step(body, left_now, right_now, step_s, perturbation, odometer)
        periods += 1
    write_ending(body)
    return periods, touched
