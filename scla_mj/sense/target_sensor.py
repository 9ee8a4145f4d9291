"""The paper's four sensors: one fires when the target is one cell away in its direction."""

from __future__ import annotations

from scla_mj.grid import Grid
from scla_mj.signals import Percept


class TargetSensor:
    """Turns a place on the floor into a percept: the cell, and the direction of a target next door."""

    def __init__(self, grid: Grid) -> None:
        self._grid = grid
        self._sensed = {cell: action.opposite for action, cell in grid.neighbours(grid.target)}

    def sense(self, x_m: float, y_m: float) -> Percept:
        """Return what the robot senses at a point of the floor, in metres from the floor's centre."""
        cell = self._grid.cell_at(x_m, y_m)
        return Percept(cell, self._sensed.get(cell))
