"""The paper's four sensors: one fires when the target is one cell away in its direction."""

from __future__ import annotations

from scla_mj.grid import Grid
from scla_mj.signals import Percept


class TargetSensor:
    """Turns a place on the floor into a percept: the cell that the robot takes it for, and the direction of a target
    that is truly next door."""

    def __init__(self, grid: Grid) -> None:
        self._grid = grid
        self._sensed = {cell: action.opposite for action, cell in grid.neighbours(grid.target)}

    def sense(self, x_m: float, y_m: float, believed_m: tuple[float, float] | None = None) -> Percept:
        """Return what a robot senses that stands at a point of the floor, and believes to stand at another.

        Args:
            x_m: where it stands, in metres from the floor's centre.
            y_m: likewise.
            believed_m: where it believes to stand; None for where it does.
        """
        cell = self._grid.cell_at(x_m, y_m)
        return Percept(cell if believed_m is None else self._grid.cell_at(*believed_m), self._sensed.get(cell))
