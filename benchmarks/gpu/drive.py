"""Whole moves of many robots on one device: the controller as a kernel between the steps of mujoco_warp."""

from __future__ import annotations

import copy
import math
import time
from typing import Any, Final

import mujoco
import mujoco_warp
import numpy as np
import warp as wp
from numpy.typing import NDArray

from benchmarks.gpu.controller import Gains, Goal, Motion, State, begin, tick
from benchmarks.gpu.structs import fields_of, filled, struct
from scla_mj.checked import CheckedConfig
from scla_mj.control import motion
from scla_mj.grid import Cell
from scla_mj.loop import periods
from scla_mj.loop.drive import gains_of
from scla_mj.loop.fleet_kernel import Driven, empty_driven, judge_fleet
from scla_mj.world.robot import Addresses, robot_of
from scla_mj.world.world import UPRIGHT_COSINE, World

_PERIODS_PER_LAUNCH: Final = 8
"""Control periods between two looks whether a robot still drives."""
_ROWS_PER_CONTACT: Final = 3
_INTEGRATION: Final = mujoco.mjtState.mjSTATE_INTEGRATION
_AUTORESET: Final = mujoco.mjtDisableBit.mjDSBL_AUTORESET
"""mujoco_warp refuses the flag, and never resets by itself."""
_WAYS: Final = np.array([(0, 1), (0, -1), (-1, 0), (1, 0)])
"""Up, down, left, right."""

_STATE: Final = ("qpos", "qvel", "qacc_warmstart")

STARTING: Final = wp.constant(motion.STARTING)
DRIVING: Final = wp.constant(motion.DRIVING)
FAULT: Final = wp.constant(periods.FAULT)
UPRIGHT: Final = wp.constant(UPRIGHT_COSINE)
FRONT: Final = wp.constant(motion.FRONT)
REAR: Final = wp.constant(motion.REAR)


Parts: Any = struct("Parts", fields_of(Addresses))
Physics: Any = struct("Physics", dict.fromkeys(_STATE, wp.array2d(dtype=wp.float32)))
"""What MuJoCo integrates of all robots, or where it is kept once a move is over."""
Course: Any = struct(
    "Course",
    {"goal": Goal, "state": State, "over": wp.bool}
    | dict.fromkeys(("period", "touched", "crossed", "status"), wp.int32),
)
"""A robot in its move, in control periods since it began; `crossed` counts from the drive's first."""


@wp.func
def _sense(physics: Physics, i: int, parts: Parts, touched: int) -> Motion:
    """`_sense_motion` of scla_mj/loop/periods.py."""
    root = parts.root_qpos
    dof = parts.root_dof
    w = physics.qpos[i, root + 3]
    x = physics.qpos[i, root + 4]
    y = physics.qpos[i, root + 5]
    z = physics.qpos[i, root + 6]
    heading = wp.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    speed = physics.qvel[i, dof] * wp.cos(heading) + physics.qvel[i, dof + 1] * wp.sin(heading)
    upright = 1.0 - 2.0 * (x * x + y * y)
    pitch = 2.0 * (w * y - x * z)
    return Motion(
        physics.qpos[i, root], physics.qpos[i, root + 1], heading, speed, physics.qvel[i, dof + 5], touched, upright,
        pitch, physics.qvel[i, dof + 4],
    )  # fmt: skip


@wp.func
def _keep(
    physics: Physics, kept: Physics, moving: Motion, crossed: int, i: int, endings: wp.array2d(dtype=wp.float32)
) -> None:
    """Copy the state of a robot whose move is over, and fill in its `Ending`."""
    total = wp.float32(0.0)
    for k in range(physics.qpos.shape[1]):
        kept.qpos[i, k] = physics.qpos[i, k]
        total += physics.qpos[i, k]
    for k in range(physics.qvel.shape[1]):
        kept.qvel[i, k] = physics.qvel[i, k]
        kept.qacc_warmstart[i, k] = physics.qacc_warmstart[i, k]
        total += physics.qvel[i, k]
    endings[i, 0] = moving.x_m
    endings[i, 1] = moving.y_m
    endings[i, 2] = moving.heading_rad
    endings[i, 3] = moving.upright
    endings[i, 4] = wp.where(wp.isfinite(total), 1.0, 0.0)
    endings[i, 5] = float(crossed)


@wp.func
def _has_crossed(goal: Goal, moving: Motion) -> bool:
    along_x = goal.target_x_m - goal.start_x_m
    along_y = goal.target_y_m - goal.start_y_m
    border = along_x * (goal.start_x_m + 0.5 * along_x) + along_y * (goal.start_y_m + 0.5 * along_y)
    return along_x * moving.x_m + along_y * moving.y_m >= border


@wp.kernel
def _command(
    standing: int,
    limit: int,
    gains: Gains,
    parts: Parts,
    physics: Physics,
    kept: Physics,
    courses: wp.array(dtype=Course),
    ctrl: wp.array2d(dtype=wp.float32),
    endings: wp.array2d(dtype=wp.float32),
    driving: wp.array(dtype=wp.int32),
) -> None:
    """A control period before its physics, as in `drive` of scla_mj/loop/periods.py; keep the state at a move's end."""
    i = wp.tid()
    course = courses[i]
    if course.over:
        return
    state = course.state
    moving = _sense(physics, i, parts, course.touched)
    if course.period > standing and course.crossed == 0 and _has_crossed(course.goal, moving):
        course.crossed = course.period - standing
    if course.period == standing:
        state = State(STARTING, 0.0, 1.0, 0, 0.0, 0.0, False)
        moving.touched = 0
    left = wp.float32(0.0)
    right = wp.float32(0.0)
    status = wp.int32(FAULT)
    if course.period == standing + limit:
        status = DRIVING
    elif moving.upright >= UPRIGHT:
        if state.phase == STARTING:
            state = begin(course.goal, moving.heading_rad, state.careful)
        state, left, right, status = tick(state, moving, course.goal, gains)
        if not (wp.isfinite(left) and wp.isfinite(right)):
            status = FAULT
    if status != DRIVING or course.period == standing + limit:
        course.over = True
        crossed = wp.where(course.crossed > 0, course.crossed, course.period - standing)
        _keep(physics, kept, moving, crossed, i, endings)
        wp.atomic_add(driving, 0, -1)
    else:
        course.period += 1
        ctrl[i, parts.left_motor] = left
        ctrl[i, parts.right_motor] = right
    course.touched = 0
    course.status = status
    course.state = state
    courses[i] = course


@wp.kernel
def _feel(parts: Parts, sensors: wp.array2d(dtype=wp.float32), courses: wp.array(dtype=Course)) -> None:
    """Note which bumpers touch after a physics step."""
    i = wp.tid()
    if sensors[i, parts.front_touch] > 0.0:
        courses[i].touched = courses[i].touched | FRONT
    if sensors[i, parts.rear_touch] > 0.0:
        courses[i].touched = courses[i].touched | REAR


class WarpBodies:
    """The bodies of a `Fleet` on a Warp device: `Fleet(checked, 1024, body=WarpBodies)`.

    The physics are mujoco_warp's and the controller its own source, in float32; moves are judged where the CPU's are.

    Attributes:
        took_s: seconds in moves so far.
    """

    def __init__(self, checked: CheckedConfig, number: int) -> None:
        grid, clock, config = checked.grid(), checked.clock, checked.config.controller
        self._world = World(grid, clock, robot_of(checked))
        self._scratch = mujoco.MjData(self._world.model)
        model = copy.copy(self._world.model)
        model.opt.disableflags &= ~int(_AUTORESET)
        contacts = model.npair
        self._model = mujoco_warp.put_model(model)
        self._data = mujoco_warp.make_data(
            model, nworld=number, nconmax=contacts, njmax=_ROWS_PER_CONTACT * contacts, nccdmax=contacts
        )
        self._steps = clock.physics_steps_per_control
        self._standing = clock.thinking_controls
        self._limit = math.ceil(config.timeout_s / clock.control_period_s)
        self._gains = filled(Gains(), gains_of(self._world, clock, config)._asdict())
        self._parts = filled(Parts(), self._world.at._asdict())
        open_cells = np.array([[grid.is_open(Cell(x + 1, y + 1)) for y in range(grid.cells[1])]
                               for x in range(grid.cells[0])])  # fmt: skip
        self._judged_by = (self._standing, open_cells, grid.cell_size_m)
        self._half, self._size_m = (np.array(grid.cells) + 1) / 2, grid.cell_size_m
        self._driven = empty_driven(number)
        self._hold(number)
        self.took_s = 0.0

    def _hold(self, number: int) -> None:
        """Make the arrays of both sides."""
        device = {name: getattr(self._data, name) for name in _STATE}
        self._physics = filled(Physics(), device)
        self._kept = filled(Physics(), {name: wp.empty_like(array) for name, array in device.items()})
        self._state = {name: np.zeros(array.shape, np.float32) for name, array in device.items()}
        self._start = np.zeros(number, Course.numpy_dtype())
        self._courses = wp.zeros(number, dtype=Course)
        self._endings = wp.zeros((number, 6), dtype=wp.float32)
        self._driving = wp.zeros(1, dtype=wp.int32)
        self._graph: Any = None

    def spawn(self, robot: int, cell: Cell, heading_rad: float) -> None:
        """Put a robot where `World.spawn` would."""
        mujoco.mj_setState(self._world.model, self._scratch, self._world.spawned(cell, heading_rad), _INTEGRATION)
        for name, values in self._state.items():
            values[robot] = getattr(self._scratch, name)

    def qpos(self, robot: int) -> NDArray[np.float64]:
        """Return MuJoCo's positions of one robot; a copy."""
        qpos: NDArray[np.float64] = self._state["qpos"][robot].astype(np.float64)
        return qpos

    def drive(self, cells: NDArray[np.int64], directions: NDArray[np.int64]) -> Driven:
        """Let every robot stand through the decision window and drive one cell."""
        started_s = time.perf_counter()
        to = cells + _WAYS[directions]
        goals = self._start["goal"]
        goals["start_x_m"], goals["start_y_m"] = ((cells - self._half) * self._size_m).T
        goals["target_x_m"], goals["target_y_m"] = ((to - self._half) * self._size_m).T
        self._start["state"]["direction"] = 1.0
        self._courses.assign(self._start)
        self._driving.fill_(len(cells))
        for name, values in self._state.items():
            getattr(self._physics, name).assign(values)
        self._run()
        for name, values in self._state.items():
            values[:] = getattr(self._kept, name).numpy()
        courses = self._courses.numpy()
        stepped, status = courses["period"].astype(np.int64), courses["status"].astype(np.int64)
        endings = self._endings.numpy().astype(np.float64)
        judge_fleet(cells, directions, endings, stepped, status, *self._judged_by, self._driven)
        self.took_s += time.perf_counter() - started_s
        return self._driven

    def _run(self) -> None:
        """Run control periods until no robot drives any more."""
        most = self._standing + self._limit + 1
        for _ in range(0, most, _PERIODS_PER_LAUNCH):
            if self._graph is not None:
                wp.capture_launch(self._graph)
            else:
                self._some_periods()
            if not self._driving.numpy()[0]:
                break
        if self._graph is None and wp.get_device().is_cuda:  # the first move has loaded every kernel
            with wp.ScopedCapture() as capture:
                self._some_periods()
            self._graph = capture.graph

    def _some_periods(self) -> None:
        data, parts, number = self._data, self._parts, self._data.nworld
        fixed = [self._standing, self._limit, self._gains, parts, self._physics, self._kept]
        for _ in range(_PERIODS_PER_LAUNCH):
            wp.launch(_command, number, [*fixed, self._courses, data.ctrl, self._endings, self._driving])
            for _ in range(self._steps):
                mujoco_warp.step(self._model, data)
                wp.launch(_feel, number, [parts, data.sensordata, self._courses])
