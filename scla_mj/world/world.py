"""One arena with one robot: its raw MuJoCo model and data, spawns, poses, and faults that MuJoCo does not report."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from scla_mj.clock import Clock
from scla_mj.errors import SclaError
from scla_mj.grid import Cell, Grid
from scla_mj.world.arena import compose
from scla_mj.world.robot import BURGER, Robot, locate, measure, one_line

UPRIGHT_COSINE: Final = 0.9
"""A chassis whose up axis leans further than this (26 degrees) has fallen: the wheels no longer carry it."""
_INTEGRATION: Final = mujoco.mjtState.mjSTATE_INTEGRATION
_SETTLING_S: Final = 2.0
"""Simulated time before the resting height of a new robot is read; it comes to rest within 0.3 s."""
_SPAWNS_KEPT: Final = 4096
"""States of half a kilobyte: enough for four headings in every cell of 32 x 32."""
_DROP_M: Final = 0.005
"""Height above the nominal one from which a randomised robot settles: more than its wheels can have grown."""

_CLEARANCE_M: Final = 0.004
"""What a cell must be wider than the circle that the robot sweeps as it turns."""


class Pose(NamedTuple):
    """Where the robot is: the axle's midpoint, its heading from +x towards +y, and how upright it is (1: fully)."""

    x_m: float
    y_m: float
    heading_rad: float
    upright: float

    def can_drive(self) -> bool:
        """Return whether the robot stands upright at a finite place; otherwise it must be spawned again."""
        return math.isfinite(self.x_m + self.y_m + self.heading_rad) and self.upright >= UPRIGHT_COSINE


class World:
    """The compiled arena of one grid with one robot; a `lean` one steps a sixth faster and cannot be drawn.

    Attributes:
        grid: the cells, with the target where it is now.
        robot, at, dimensions: the robot, its parts' addresses, and its measures in the compiled model.
        model, data: raw MuJoCo.
        steps: physics steps since the spawn, counted by whoever steps `data`; `faults` compares them with its time.
        rolling_radius_m: on which the loaded tyres roll: less by half of how deep they are pressed in.
        root_qpos: a view of the robot's position and quaternion, shape (7,).

    Raises:
        SclaError: the robot's file cannot be read or compiled, or lacks a part that a robot must have, or
            the robot is too large for the cells.
    """

    def __init__(self, grid: Grid, clock: Clock, robot: Robot = BURGER, *, lean: bool = True) -> None:
        _silence_warning_log()
        self.grid, self.robot = grid, robot
        self._clock = clock
        self.model: Any = self._compile(lean=lean)
        self.data: Any = mujoco.MjData(self.model)
        self.at, self.dimensions = locate(self.model, robot), measure(self.model, robot)
        self._refuse_narrow_cells()
        # Views, taken once: an attribute of MjData costs as much as a move's arithmetic.
        self._qpos, self._qvel, self._warnings = self.data.qpos, self.data.qvel, self.data.warning.number
        self._root = slice(self.at.root_qpos, self.at.root_qpos + 7)
        self.root_qpos: NDArray[np.float64] = self._qpos[self._root]
        self._timestep = float(self.model.opt.timestep)
        self.steps = 0
        self._resting_qpos = self._settle()
        radius_m, axle_m = self.dimensions.wheel_radius_m, float(self._resting_qpos[self._root][2])
        self.rolling_radius_m = round((radius_m + axle_m) / 2 / radius_m, 3) * radius_m
        self._spawned: dict[tuple[Cell, float], NDArray[np.float64]] = {}
        self.spawn(grid.target, 0.0)

    def _refuse_narrow_cells(self) -> None:
        needed_m = 2 * self.dimensions.turning_radius_m + _CLEARANCE_M
        if needed_m > self.grid.cell_size_m:
            raise SclaError(
                f"--cell-size-m is {self.grid.cell_size_m:g}: the robot of {self.robot.file.name} needs cells of at "
                f"least {math.ceil(1000 * needed_m) / 1000:g} m to turn in"
            )

    def drawable_model(self) -> Any:
        """Return a compiled model with everything that is only for looks; it takes the states of this world's model."""
        return self._compile(lean=False)

    def _compile(self, *, lean: bool) -> Any:
        try:
            return compose(self.grid, self._clock, self.robot, lean=lean).compile()
        except ValueError as error:
            raise SclaError(f"cannot compile {self.robot.file}: {one_line(error)}") from error

    def spawn(self, cell: Cell, heading_rad: float, *, derive: bool = True) -> None:
        """Reset the whole state, with the robot at rest on a cell's centre at its own resting height, and time 0.

        `derive` also updates what MuJoCo derives from the state, such as positions of geoms; stepping does not need it.

        Raises:
            SclaError: the cell is closed or outside the arena.
        """
        if any(self._warnings.tolist()):
            mujoco.mj_resetData(self.model, self.data)
        spawned = self.spawned(cell, heading_rad)
        if derive:
            self._set(spawned)
        else:
            mujoco.mj_setState(self.model, self.data, spawned, _INTEGRATION)
        self.steps = 0

    def spawned(self, cell: Cell, heading_rad: float) -> NDArray[np.float64]:
        """Return the integrated state that `spawn` sets, for other data of this model; it may change `data`.

        Raises:
            SclaError: the cell is closed or outside the arena.
        """
        spawned = self._spawned.get((cell, heading_rad))
        if spawned is None:
            spawned = self._spawned_anew(cell, heading_rad)
            if len(self._spawned) < _SPAWNS_KEPT:
                self._spawned[cell, heading_rad] = spawned
        return spawned

    def _spawned_anew(self, cell: Cell, heading_rad: float) -> NDArray[np.float64]:
        """Spawn from MuJoCo's own reset, and return the integrated state: setting that is faster."""
        if not self.grid.is_open(cell):
            raise SclaError(
                f"cannot spawn at ({cell.x}, {cell.y}): it is closed or outside the arena; choose an open cell"
            )
        mujoco.mj_resetData(self.model, self.data)
        self._qpos[:] = self._resting_qpos
        self.root_qpos[:2] = self.grid.centre_m(cell)
        turn = np.array([math.cos(heading_rad / 2), 0.0, 0.0, math.sin(heading_rad / 2)])
        mujoco.mju_mulQuat(self.root_qpos[3:], turn, self._resting_qpos[self._root][3:])
        mujoco.mj_forward(self.model, self.data)
        return self._integrated()

    def move_target(self, grid: Grid) -> None:
        """Put the targets where `grid` has them; they are marks on the floor that touch nothing."""
        self.grid = grid

    def state(self) -> dict[str, Any]:
        """Return the state that MuJoCo integrates, as one array, and the count of steps."""
        return {"physics": self._integrated(), "steps": self.steps}

    def restore(self, state: dict[str, Any]) -> None:
        """Resume from a `state`, bit-identically.

        While the robot drives, what MuJoCo derives from the state, such as positions of geoms, is that of the start of
        the latest step; after this call it is that of the restored state.
        """
        self._set(state["physics"])
        self.steps = state["steps"]

    def _set(self, state: NDArray[np.float64]) -> None:
        mujoco.mj_setState(self.model, self.data, state, _INTEGRATION)
        mujoco.mj_forward(self.model, self.data)
        mujoco.mj_setState(self.model, self.data, state, _INTEGRATION)  # the solver's warm start too

    def _integrated(self) -> NDArray[np.float64]:
        state = np.empty(mujoco.mj_stateSize(self.model, _INTEGRATION))
        mujoco.mj_getState(self.model, self.data, state, _INTEGRATION)
        return state

    def pose(self) -> Pose:
        """Return the robot's physical pose."""
        x, y, _, qw, qx, qy, qz = self.root_qpos.tolist()
        heading = math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
        return Pose(x, y, heading, 1 - 2 * (qx * qx + qy * qy))

    def wheel_angles_rad(self) -> NDArray[np.float64]:
        """Return how far the left and the right wheel have turned, shape (2,)."""
        return np.array([self._qpos[self.at.left_qpos], self._qpos[self.at.right_qpos]])

    def can_drive(self) -> bool:
        """Return whether the robot can continue from where it is: upright, and its whole state finite."""
        return self.pose().can_drive() and self._is_finite()

    def faults(self) -> list[str]:
        """Return one sentence per fault since the spawn."""
        found = []
        if not self._is_finite():
            found.append("the robot's state is not finite")
        elif not self.can_drive():
            found.append("the robot has fallen over")
        for kind in np.flatnonzero(self._warnings).tolist():
            warning = mujoco.mjtWarning(kind).name.removeprefix("mjWARN_")
            found.append(f"MuJoCo warned {self._warnings[kind]} times of {warning}")
        if not self._keeps_time():
            found.append(f"MuJoCo's time is {self.data.time:g} s after {self.steps} steps: it has reset itself")
        return found

    def has_misbehaved(self) -> bool:
        """Return whether MuJoCo has warned or reset itself; it takes microseconds and is called after every move."""
        return any(self._warnings.tolist()) or not self._keeps_time()

    def _is_finite(self) -> bool:
        return math.isfinite(sum(self._qpos.tolist()) + sum(self._qvel.tolist()))

    def _keeps_time(self) -> bool:
        # Half a step: room for the rounding of some 1e9 additions, none for a step too many.
        return bool(abs(self.data.time - self.steps * self._timestep) < self._timestep / 2)

    def settle(self, scratch: Any) -> None:
        """Measure how the robot stands after a change of the model: later spawns place it in that attitude.

        `scratch` is a new `MjData` of the model, in which the robot comes to rest.
        """
        scratch.qpos[self._root][2] += _DROP_M
        self._let_rest(scratch)
        rest = scratch.qpos[self._root]
        qw, qx, qy, qz = rest[3:].tolist()
        half = math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz)) / 2
        turned = np.empty(4)
        mujoco.mju_mulQuat(turned, np.array([math.cos(half), 0, 0, -math.sin(half)]), rest[3:])
        self._resting_qpos = self._at_origin(rest[2], turned)
        self._spawned.clear()

    def _settle(self) -> NDArray[np.float64]:
        """Let the robot come to rest, and return that qpos, moved to the origin and heading along +x."""
        self._let_rest(self.data)
        half = math.atan2(self.root_qpos[5], self.root_qpos[3])
        return self._at_origin(self.root_qpos[2], [math.cos(half), 0.0, math.sin(half), 0.0])

    def _at_origin(self, height_m: float, quaternion: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the qpos of a robot at the arena's centre, its wheels at angle 0."""
        qpos = np.zeros(self.model.nq)
        qpos[self._root] = 0.0, 0.0, height_m, *quaternion
        return qpos

    def _let_rest(self, data: Any) -> None:
        """Let the robot come to rest at the arena's centre, without contacts with a closed cell that may be there."""
        touchable = self.model.geom_contype.copy()
        self.model.geom_contype[:] = 0
        mujoco.mj_step(self.model, data, nstep=round(_SETTLING_S / self.model.opt.timestep))
        self.model.geom_contype[:] = touchable


def _silence_warning_log() -> None:
    """Keep MuJoCo from writing warnings to MUJOCO_LOG.TXT in the working directory: `faults` reads their counts."""
    if mujoco.get_mju_user_warning() is None:
        mujoco.set_mju_user_warning(_ignore_warning)


def _ignore_warning(message: str) -> None:
    """Discard a warning's text."""
