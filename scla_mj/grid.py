"""The grid world's discrete truth: cells, actions, who is next to whom, and what a shortest path earns."""

from __future__ import annotations

import enum
import functools
import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, Literal, NamedTuple, get_args

from scla_mj.errors import SclaError

StartProtocol = Literal["any-start", "sensed-start"]
PROTOCOLS: Final = get_args(StartProtocol)


class Action(enum.IntEnum):
    """The four moves, in the paper's order (Tables 3 and 4): up, down, left, right."""

    UP = 0
    DOWN = 1
    LEFT = 2
    RIGHT = 3

    @property
    def label(self) -> str:
        """The action's name as files and tables carry it."""
        return _LABELS[self]

    @property
    def opposite(self) -> Action:
        """The action that undoes this one."""
        return ACTIONS[self ^ 1]

    @property
    def step(self) -> tuple[int, int]:
        """The change of (x, y) in cells; x grows to the right, y upwards."""
        return _STEPS[self]


ACTIONS: Final = tuple(Action)
"""The four moves; to go through them costs a tenth of going through the enumeration."""
_STEPS: Final = ((0, 1), (0, -1), (-1, 0), (1, 0))
_LABELS: Final = tuple(action.name.lower() for action in Action)


class Cell(NamedTuple):
    """A cell by its column x (rightwards) and row y (upwards), both from 1."""

    x: int
    y: int

    def after(self, action: Action) -> Cell:
        """Return the cell one step away, on the grid or not."""
        dx, dy = _STEPS[action]
        return Cell(self.x + dx, self.y + dy)


def said(targets: Sequence[tuple[int, int]], verb: tuple[str, str] = ("", "s")) -> str:
    """Return targets in words, such as "target (3, 3)"; `verb` is what follows "target" for one, for several."""
    return f"target{verb[len(targets) > 1]} {' and '.join(f'({x}, {y})' for x, y in targets)}"


@functools.cache
def around(cell: Cell) -> tuple[Cell, Cell, Cell, Cell]:
    """Return the four cells next to one, on the grid or not, in the order of the actions."""
    up, down, left, right = (cell.after(action) for action in Action)
    return up, down, left, right


MOST_CELLS: Final = 10_000
"""An arena of 100 x 100: more than a robot that learns by walking about could ever cover."""


@dataclass(frozen=True)
class Grid:
    """An arena of `cells` = (W, H) square cells with one target or several and, optionally, closed cells.

    `others` are the targets after the first. `starts` are the cells where robots are spawned, every one where it is
    empty. `grip` is a factor on the friction of the tyres, where it is not 1.

    Raises:
        SclaError: the grid has fewer than two open cells, or a target, start or closed cell is not on it, or two are in
            one place, or some open cell cannot reach the first target.
    """

    cells: tuple[int, int]
    target: Cell
    cell_size_m: float
    closed: frozenset[Cell] = frozenset()
    others: tuple[Cell, ...] = ()
    starts: frozenset[Cell] = frozenset()
    grip: Mapping[Cell, float] = field(default_factory=dict, hash=False)
    distances: dict[Cell, int] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        width, height = self.cells
        if width < 1 or height < 1 or width * height < 2:
            raise SclaError(f"--cells {width} {height} leaves no room to move: a grid wants at least two cells")
        if width * height > MOST_CELLS:
            raise SclaError(f"--cells {width} {height} is too large: a grid has at most {MOST_CELLS} cells")
        if not 0 < self.cell_size_m < math.inf:
            raise SclaError(f"a cell size of {self.cell_size_m} m is not possible: it must be above 0 and finite")
        named = [("target", self.targets), ("closed cell", sorted(self.closed)), ("start", sorted(self.starts))]
        for name, cell in ((name, cell) for name, cells in named for cell in cells):
            if not self.contains(cell):
                raise SclaError(
                    f"the {name} ({cell.x}, {cell.y}) is off the {width}x{height} grid: "
                    f"x must be 1 to {width} and y 1 to {height}"
                )
            if name != "closed cell" and cell in self.closed:
                raise SclaError(f"the {name} ({cell.x}, {cell.y}) is a closed cell: open it or move the {name}")
        object.__setattr__(self, "distances", self._search([self.target]))
        lost = [cell for cell in self.open_cells() if cell not in self.distances]
        if lost:
            where = (
                f"the cell ({lost[0].x}, {lost[0].y}) is walled off from the target ({self.target.x}, {self.target.y})"
            )
            raise SclaError(f"{where}: open a way or close it too")
        if self.others:
            object.__setattr__(self, "distances", self._search(self.targets))
        if len(self.distances) <= len(self.targets):
            raise SclaError("every cell but the target is closed: leave at least one open")

    @property
    def targets(self) -> tuple[Cell, ...]:
        """Every target; to reach one is a hit."""
        return (self.target, *self.others)

    def contains(self, cell: Cell) -> bool:
        """Return whether the cell lies in the arena, closed or not."""
        return 1 <= cell.x <= self.cells[0] and 1 <= cell.y <= self.cells[1]

    def is_open(self, cell: Cell) -> bool:
        """Return whether a robot can stand in the cell."""
        return self.contains(cell) and cell not in self.closed

    def all_cells(self) -> list[Cell]:
        """Every cell of the arena, by columns."""
        return [Cell(x, y) for x in range(1, self.cells[0] + 1) for y in range(1, self.cells[1] + 1)]

    def open_cells(self) -> list[Cell]:
        """Every open cell, by columns."""
        return [cell for cell in self.all_cells() if cell not in self.closed]

    def after(self, cell: Cell, action: Action) -> Cell:
        """Return where the action leads: the next cell, or the same one where a wall blocks it."""
        beyond = cell.after(action)
        return beyond if self.is_open(beyond) else cell

    def neighbours(self, cell: Cell) -> list[tuple[Action, Cell]]:
        """Return the open cells one action away, each with its action."""
        return [(action, cell.after(action)) for action in Action if self.is_open(cell.after(action))]

    def sensed_from(self, cell: Cell) -> Action | None:
        """Return the direction of a target in a neighbouring cell, or None (the paper's sensor)."""
        return next((action for action, beyond in self.neighbours(cell) if beyond in self.targets), None)

    def start_cells(self, protocol: StartProtocol) -> list[Cell]:
        """Return the cells where a protocol re-spawns the robot, each equally likely (docs/model.md, protocols).

        Raises:
            SclaError: none of the grid's `starts` is one of them.
        """
        cells = [cell for cell in self.open_cells() if cell not in self.targets]
        if protocol == "sensed-start":
            beside = [cell for target in self.targets for _, cell in self.neighbours(target)]
            cells = [cell for cell in dict.fromkeys(beside) if cell not in self.targets]
        cells = [cell for cell in cells if not self.starts or cell in self.starts]
        if not cells:
            where = "beside a target" if protocol == "sensed-start" else "outside the targets"
            raise SclaError(f"--protocol {protocol} has no cell to start in: leave an open cell, or a start, {where}")
        return cells

    def ceiling_hits_per_1000(self, protocol: StartProtocol) -> float:
        """Return what a shortest-path policy earns: 1000 / mean shortest path over the start cells, found by search."""
        starts = self.start_cells(protocol)
        return 1000.0 * len(starts) / sum(self.distances[cell] for cell in starts)

    def centre_m(self, cell: Cell) -> tuple[float, float]:
        """Return the cell's centre; the origin is the arena's centre."""
        width, height = self.cells
        return ((cell.x - (width + 1) / 2) * self.cell_size_m, (cell.y - (height + 1) / 2) * self.cell_size_m)

    def cell_at(self, x_m: float, y_m: float) -> Cell:
        """Return the cell that contains a point; points beyond the walls belong to the nearest cell."""
        width, height = self.cells
        column = int((x_m / self.cell_size_m + width / 2) // 1) + 1
        row = int((y_m / self.cell_size_m + height / 2) // 1) + 1
        return Cell(min(max(column, 1), width), min(max(row, 1), height))

    def _search(self, targets: Sequence[Cell]) -> dict[Cell, int]:
        """Breadth-first distances, in moves, from every reachable cell to the nearest of the targets."""
        distances, queue = dict.fromkeys(targets, 0), deque(targets)
        while queue:
            cell = queue.popleft()
            for _, beyond in self.neighbours(cell):
                if beyond not in distances:
                    distances[beyond] = distances[cell] + 1
                    queue.append(beyond)
        return distances
