"""Many robots on one model, driven in one compiled call on all cores: each does what a `Task` of its seed does."""

from __future__ import annotations

import functools
import itertools
import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from typing import Any, Final, NamedTuple, TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from scla_mj.checked import CheckedConfig, require_undisturbed
from scla_mj.errors import SclaError
from scla_mj.grid import ACTIONS, Cell, Grid
from scla_mj.loop.action_noise import ActionNoise
from scla_mj.loop.drive import gains_of
from scla_mj.loop.fleet_kernel import FAILED, Driven, empty_driven, run_fleet
from scla_mj.loop.task import HELPLESS_MOVES, QUARTER_TURN_RAD
from scla_mj.loop.twin import move_periods
from scla_mj.randomness import Consumer, generator, require_seed
from scla_mj.signals import TRAJECTORY_COLUMNS
from scla_mj.validation import whole_number
from scla_mj.world.robot import robot_of
from scla_mj.world.world import World

_INTEGRATION: Final = mujoco.mjtState.mjSTATE_INTEGRATION
_CHUNKS_PER_THREAD: Final = 16
"""Moves take longer and shorter: a thread that is done early takes another chunk."""
MOST_ROBOTS: Final = 100_000
_InChunks: TypeAlias = Callable[[Callable[[int, int], None]], None]
Bodies: TypeAlias = Callable[[CheckedConfig, int], Any]
"""Makes bodies with `spawn(robot, cell, heading_rad)`, `drive(cells, directions)` and `qpos(robot)`."""


class Came(NamedTuple):
    """What came of one action of every robot, arrays of (N,): `executed`, `outcome` (0 moved, 1 blocked, 2 failed),
    `hit`, `fallen`, `duration_s`, `crossed_s` (0 without a crossing), `position_error_m` (NaN after a fall)."""

    executed: NDArray[np.int64]
    outcome: NDArray[np.int64]
    hit: NDArray[np.bool_]
    fallen: NDArray[np.bool_]
    duration_s: NDArray[np.float64]
    crossed_s: NDArray[np.float64]
    position_error_m: NDArray[np.float64]


class Fleet:
    """Robots in arenas of their own, without brains and undisturbed; each has its own seed, target and time.

    Args:
        number: of robots.
        threads: how many drive them; None for one per core that this process may use.
        body: whether there is any physics; or what makes another, from the configuration and `number`.

    Attributes:
        cells: where the robots are, column and row from 1, shape (N, 2).

    Raises:
        SclaError: robots of this configuration are disturbed or localise themselves; or `number` or `threads` is not a
            whole number from 1.
    """

    def __init__(
        self, checked: CheckedConfig, number: int, *, threads: int | None = None, body: bool | Bodies = True
    ) -> None:
        require_undisturbed(checked, "a fleet of robots")
        threads = _cores() if threads is None else threads
        number = whole_number(number, "the number of robots", 1, MOST_ROBOTS)
        threads = whole_number(threads, "threads", 1, MOST_ROBOTS)
        self._period_s = np.float64(checked.clock.control_period_s)
        self._checked, task, per_epoch = checked, checked.config.task, checked.config.decisions
        self._targets = np.array([grid.targets for grid in checked.grids])
        self._sensed = np.array([_sensed(grid) for grid in checked.grids])
        self._starts = [grid.start_cells(checked.config.protocol) for grid in checked.grids]
        chunks = 1 if threads == 1 else min(number, _CHUNKS_PER_THREAD * threads)
        self._chunks = list(itertools.pairwise(np.linspace(0, number, chunks + 1).astype(int).tolist()))
        self._helpers = min(threads, chunks) - 1
        self._pool = ThreadPoolExecutor(self._helpers) if self._helpers else None
        made = body if callable(body) else functools.partial(_Bodies, in_chunks=self.in_chunks) if body else _Twins
        self._bodies: Any = made(checked, number)
        self._jump_at = [(epoch - 1) * per_epoch for epoch, _ in checked.jumps]
        self._cross_at = (task.crossed_epoch - 1) * per_epoch
        self.cells = np.ones((number, 2), np.int64)
        self._stage, self._crossed, self._decisions, self._failures, self._periods = np.zeros((5, number), np.int64)
        self._spawn: list[Any] = [None] * number
        self._noise: list[Any] = [None] * number
        for robot in range(number):
            self.reseed(robot, checked.config.seed)

    @property
    def time_s(self) -> NDArray[np.float64]:
        """The robots' times since their seeds, (N,)."""
        time_s: NDArray[np.float64] = self._periods * self._period_s
        return time_s

    @property
    def sensed(self) -> NDArray[np.int64]:
        """The direction of a target in a neighbouring cell, 4 where there is none, (N,)."""
        sensed: NDArray[np.int64] = self._sensed[self._stage, self.cells[:, 0] - 1, self.cells[:, 1] - 1]
        return sensed

    def reseed(self, robot: int, seed: int) -> None:
        """Start one robot's run again, with a seed.

        Raises:
            SclaError: `seed` is not one that a run can have.
        """
        require_seed(seed)
        noise = generator(seed, Consumer.ACTION_NOISE)
        self._spawn[robot] = generator(seed, Consumer.SPAWN)
        self._noise[robot] = ActionNoise(self._checked.config.task.action_noise, rng=noise)
        self._stage[robot], self._crossed[robot] = self._checked.stage(1), self._checked.has_crossed(1)
        self._decisions[robot] = self._periods[robot] = 0
        self.respawn(robot)

    def respawn(self, robot: int) -> None:
        """Put one robot into a start cell, as `Task.respawn` does."""
        starts, rng = self._starts[self._stage[robot]], self._spawn[robot]
        cell = starts[rng.integers(len(starts))]
        self._bodies.spawn(robot, cell, QUARTER_TURN_RAD * int(rng.integers(4)))
        self.cells[robot], self._failures[robot] = cell, 0

    def act(self, actions: NDArray[np.int64]) -> Came:
        """Let every robot stand through the decision window and carry out its action, 0 to 3; none is respawned.

        Raises:
            SclaError: MuJoCo warned or reset itself, so that what it computed cannot be trusted.
        """
        executed = actions
        if self._checked.config.task.action_noise > 0.0:
            executed = np.array([n.execute(ACTIONS[a]) for n, a in zip(self._noise, actions, strict=True)], np.int64)
        driven: Driven = self._bodies.drive(self.cells, executed ^ self._crossed)
        fallen = driven.fallen.astype(bool)
        hit = ~fallen & self._on_target(driven.after)
        self._failures = np.where((driven.outcome == FAILED) & ~hit, self._failures + 1, 0)
        fallen |= self._failures >= HELPLESS_MOVES
        self.cells = np.where(fallen[:, None], self.cells, driven.after)
        self._periods += driven.elapsed
        self._decisions += 1
        errors_m = np.array(list(map(math.hypot, *driven.off_m.T.tolist())))
        return Came(
            executed,
            driven.outcome.copy(),
            hit,
            fallen,
            driven.periods * self._period_s,
            driven.crossed * self._period_s,
            errors_m,
        )

    def begin_decisions(self) -> None:
        """Let targets jump and wheels cross where a new epoch begins, as `begin_decision` does for a task."""
        if self._cross_at >= 0:
            self._crossed[self._decisions == self._cross_at] = True
        for stage, jump_at in enumerate(self._jump_at, 1):
            moved = self._decisions == jump_at
            self._stage[moved] = stage
            for robot in np.flatnonzero(moved & self._on_target(self.cells)).tolist():
                self.respawn(robot)

    def _on_target(self, cells: NDArray[np.int64]) -> NDArray[np.bool_]:
        on: NDArray[np.bool_] = (cells[:, None] == self._targets[self._stage]).all(axis=2).any(axis=1)
        return on

    def qpos(self, robot: int) -> NDArray[np.float64]:
        """Return MuJoCo's positions of one robot, which has a body; a copy."""
        qpos: NDArray[np.float64] = self._bodies.qpos(robot)
        return qpos

    def in_chunks(self, work: Callable[[int, int], None]) -> None:
        """Call `work(first, last)` for all robots, some at a time, in this thread and the fleet's others."""
        chunks = iter(self._chunks)  # whoever is done takes the next

        def share() -> None:
            for first, last in chunks:
                work(first, last)

        helping = [self._pool.submit(share) for _ in range(self._helpers)] if self._pool else []
        try:
            share()
        finally:
            wait(helping)
        for helper in helping:
            helper.result()

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()


class _Bodies:
    """The physics: one lean model, and data for every robot."""

    def __init__(self, checked: CheckedConfig, number: int, in_chunks: _InChunks) -> None:
        grid, clock, config = checked.grid(), checked.clock, checked.config.controller
        self._world = world = World(grid, clock, robot_of(checked))
        self._model = model = world.model
        self._data = [mujoco.MjData(model) for _ in range(number)]
        self._views = [(d.qpos, d.qvel, d.ctrl, d.sensordata) for d in self._data]  # kept alive for the addresses
        self._warnings = [data.warning.number for data in self._data]
        self._table = np.array(
            [[data._address, *(view.ctypes.data for view in views)]
             for data, views in zip(self._data, self._views, strict=True)], np.int64
        )  # fmt: skip
        self._timestep_s = float(model.opt.timestep)
        self._steps = np.zeros(number, np.int64)
        self._steps_per_period = clock.physics_steps_per_control
        sizes = model.nq, model.nv, model.nu, model.nsensordata
        whole = np.array([model._address, clock.physics_steps_per_control, *sizes, *world.at], np.int64)
        gains = np.array(gains_of(world, clock, config), np.float64)
        limit = math.ceil(config.timeout_s / clock.control_period_s)
        open_cells = np.array([[grid.is_open(Cell(x + 1, y + 1)) for y in range(grid.cells[1])]
                               for x in range(grid.cells[0])])  # fmt: skip
        self._fixed = (clock.thinking_controls, limit, whole, gains, open_cells, grid.cell_size_m)
        self._driven = empty_driven(number)
        self._row_count, self._in_chunks = clock.thinking_controls + limit, in_chunks

    def spawn(self, robot: int, cell: Cell, heading_rad: float) -> None:
        data = self._data[robot]
        if any(self._warnings[robot].tolist()):
            mujoco.mj_resetData(self._model, data)
        mujoco.mj_setState(self._model, data, self._world.spawned(cell, heading_rad), _INTEGRATION)
        self._steps[robot] = 0

    def qpos(self, robot: int) -> NDArray[np.float64]:
        qpos: NDArray[np.float64] = self._data[robot].qpos.copy()
        return qpos

    def drive(self, cells: NDArray[np.int64], driven: NDArray[np.int64]) -> Driven:
        def run(first: int, last: int) -> None:
            rows = np.empty((self._row_count, len(TRAJECTORY_COLUMNS)))
            run_fleet(first, last, rows, cells, driven, self._driven, self._table, *self._fixed)

        self._in_chunks(run)
        self._steps += self._driven.stepped * self._steps_per_period
        self._refuse_faults()
        return self._driven

    def _refuse_faults(self) -> None:
        fallen, elapsed_s = self._driven.fallen.tolist(), (self._steps * self._timestep_s).tolist()
        for robot, (data, warnings) in enumerate(zip(self._data, self._warnings, strict=True)):
            is_late = abs(data.time - elapsed_s[robot]) >= self._timestep_s / 2
            if not fallen[robot] and (is_late or any(warnings.tolist())):
                raise SclaError(f"the physics of robot {robot} went wrong: use a smaller physics step")


class _Twins:
    """No physics: every move ends as the grid has it."""

    def __init__(self, checked: CheckedConfig, number: int) -> None:
        grid = checked.grid()
        self._after = np.array([[[grid.after(Cell(x + 1, y + 1), action) for action in ACTIONS]
                                 for y in range(grid.cells[1])] for x in range(grid.cells[0])])  # fmt: skip
        self._driven = empty_driven(number)
        self._periods, self._crossed = move_periods(checked.clock.control_period_s)
        self._driven.periods[:] = self._periods
        self._driven.elapsed[:] = self._periods + checked.clock.thinking_controls

    def spawn(self, robot: int, cell: Cell, heading_rad: float) -> None:
        """There is nothing to put there."""

    def drive(self, cells: NDArray[np.int64], driven: NDArray[np.int64]) -> Driven:
        after = self._after[cells[:, 0] - 1, cells[:, 1] - 1, driven]
        blocked = (after == cells).all(axis=1)
        return self._driven._replace(
            after=after, outcome=blocked.astype(np.int64), crossed=np.where(blocked, 0, self._crossed)
        )


def _sensed(grid: Grid) -> list[list[int]]:
    """Return the sensed direction in every cell, (W, H), 4 for none."""
    none = len(ACTIONS)
    sensed = [[grid.sensed_from(Cell(x + 1, y + 1)) for y in range(grid.cells[1])] for x in range(grid.cells[0])]
    return [[none if action is None else int(action) for action in column] for column in sensed]


def _cores() -> int:
    """Return how many cores this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return (len(affinity(0)) if affinity else os.cpu_count()) or 1
