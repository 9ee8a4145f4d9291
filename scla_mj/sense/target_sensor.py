"""The paper's four sensors: one fires when the target is one cell away in its direction."""

from __future__ import annotations

from scla_mj.grid import Cell, Grid
from scla_mj.signals import Percept


class TargetSensor:
    """Turns a cell into a percept: the cell that the robot takes it for, and the direction of a target that is
    truly in a neighbouring cell."""

    def __init__(self, grid: Grid) -> None:
        self._sensed = {cell: action for cell in grid.open_cells() if (action := grid.sensed_from(cell)) is not None}

    def sense(self, cell: Cell, believed: Cell) -> Percept:
        """Return what a robot senses that stands in a cell, and believes to stand in another."""
        return Percept(believed, self._sensed.get(cell))
