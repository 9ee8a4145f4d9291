"""The discrete twin: a task's world and driver without physics, with the cells and hits of an undisturbed robot.

Every move ends in the centre of the cell where it should end, and takes as long as a driven one takes on average.
"""

from __future__ import annotations

import math
from typing import Any, Final

from scla_mj.clock import Clock
from scla_mj.grid import Action, Cell, Grid
from scla_mj.loop.drive import NO_ROWS
from scla_mj.signals import Move, Outcome
from scla_mj.world.world import Pose

MOVE_S: Final = 0.87
CROSSED_S: Final = 0.57
"""How long a driven move takes, and when its axle crosses into the next cell: means over a random walk."""


def move_periods(period_s: float) -> tuple[int, int]:
    """Return how many control periods a move takes, and after how many the axle has crossed."""
    return math.ceil(MOVE_S / period_s), math.ceil(CROSSED_S / period_s)


class TwinWorld:
    """Where the robot is, as `World` says it."""

    def __init__(self, grid: Grid) -> None:
        self.grid, self.cell, self.heading_rad = grid, grid.target, 0.0

    def spawn(self, cell: Cell, heading_rad: float, *, derive: bool = True) -> None:
        """Put the robot into a cell."""
        self.cell, self.heading_rad = cell, heading_rad

    def move_target(self, grid: Grid) -> None:
        """Put the targets where `grid` has them."""
        self.grid = grid

    def pose(self) -> Pose:
        """Return the cell's centre, upright."""
        return Pose(*self.grid.centre_m(self.cell), self.heading_rad, 1.0)

    def has_misbehaved(self) -> bool:
        """Return that nothing can go wrong."""
        return False

    def state(self) -> dict[str, Any]:
        """Return where the robot is."""
        return {"cell": list(self.cell), "heading_rad": self.heading_rad}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`."""
        self.cell, self.heading_rad = Cell(*state["cell"]), state["heading_rad"]


class TwinDriver:
    """Carries out moves as the grid has them, as `Driver` drives them."""

    careful = False

    def __init__(self, world: TwinWorld, clock: Clock) -> None:
        self._world, self._period_s = world, clock.control_period_s
        self.periods = 0

    @property
    def time_s(self) -> float:
        """The run's time."""
        return self.periods * self._period_s

    def drive(self, action: Action, start_cell: Cell, *, standing: int = 0, observe: bool = True) -> Move:
        """Carry out one action; there is no trajectory."""
        driven, crossed = move_periods(self._period_s)
        self.periods += standing + driven
        after = self._world.cell = self._world.grid.after(start_cell, action)
        outcome = Outcome.MOVED if after != start_cell else Outcome.BLOCKED
        crossed_s = crossed * self._period_s if outcome is Outcome.MOVED else None
        return Move(outcome, start_cell, after, driven * self._period_s, 0.0, 0.0, False, NO_ROWS, crossed_s)

    def restart(self) -> None:
        """Start again at time 0."""
        self.periods = 0

    def state(self) -> dict[str, Any]:
        """Return the run's time."""
        return {"periods": self.periods}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`."""
        self.periods = state["periods"]


class NoRandomisation:
    """Nothing to draw for an episode."""

    def renew(self) -> None:
        """Draw nothing."""

    def state(self) -> dict[str, Any]:
        """Return nothing."""
        return {}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore nothing."""
