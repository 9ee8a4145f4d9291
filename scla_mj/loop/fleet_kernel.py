"""The compiled drive of many robots, which share a model and are reached by the addresses of their data."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np
from numba import types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array
from numba.np.unsafe.ndarray import to_fixed_tuple
from numpy.typing import NDArray

from scla_mj.compiled import cached_njit, leaf_njit
from scla_mj.control import caution, controller, motion, profile
from scla_mj.control.motion import ARRIVED, RETURNED, Gains, Goal
from scla_mj.loop import periods as of_one
from scla_mj.loop.periods import Body, Ending, crossed_in, drive, write_ending
from scla_mj.sense import odometry
from scla_mj.world import perturbation, robot
from scla_mj.world.robot import Addresses
from scla_mj.world.world import UPRIGHT_COSINE

MOVED: Final = 0
BLOCKED: Final = 1
FAILED: Final = 2
"""`Outcome`, in its order."""
_ADDRESSES: Final = len(Addresses._fields)
_GAINS: Final = len(Gains._fields)
_ENDING: Final = len(Ending._fields)


class Driven(NamedTuple):
    """What one move of every robot came to: arrays of (N,), `after` and `off_m` of (N, 2).

    Cells count from 1; `periods` are those of the drive, `stepped` those in which the physics was stepped, `elapsed`
    those by which the time goes on; `crossed` is the period at whose end the axle had crossed, 0 for never; `off_m` is
    the way from the centre of the cell where the robot ended, NaN after a fall.
    """

    after: NDArray[np.int64]
    off_m: NDArray[np.float64]
    outcome: NDArray[np.int64]
    fallen: NDArray[np.int64]
    periods: NDArray[np.int64]
    stepped: NDArray[np.int64]
    elapsed: NDArray[np.int64]
    crossed: NDArray[np.int64]


def empty_driven(number: int) -> Driven:
    """Return room for the moves of so many robots."""
    outcome, fallen, periods, stepped, elapsed, crossed = np.zeros((6, number), np.int64)
    off_m = np.zeros((number, 2))
    return Driven(np.zeros((number, 2), np.int64), off_m, outcome, fallen, periods, stepped, elapsed, crossed)


@intrinsic
def _doubles(typing_context: Any, address: Any, length: Any) -> Any:
    """Return the array of so many doubles at an address; `carray` would count references."""
    array_type = types.Array(types.float64, 1, "C")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = make_array(array_type)(context, builder)
        data = builder.inttoptr(arguments[0], array.data.type)
        stride = context.get_constant(types.intp, 8)
        populate_array(array, data=data, shape=[arguments[1]], strides=[stride], itemsize=stride, meminfo=None)
        return array._getvalue()

    return array_type(types.intp, types.intp), generate


@leaf_njit(inline="always")
def _column(x_m: float, cell_size_m: float, columns: int) -> int:
    """Return the column, from 1, of a place; the same for rows."""
    return min(max(math.floor(x_m / cell_size_m + columns / 2) + 1, 1), columns)


@leaf_njit(inline="always")
def _neighbour(x: int, y: int, direction: int) -> tuple[int, int]:
    return x + (direction == 3) - (direction == 2), y + (direction == 0) - (direction == 1)


@cached_njit(caution, controller, motion, profile, perturbation, robot, odometry, of_one, nogil=True)
def run_fleet(
    first: int,
    last: int,
    rows: NDArray[np.float64],
    cells: NDArray[np.int64],
    driven: NDArray[np.int64],
    into: Driven,
    table: NDArray[np.int64],
    standing: int,
    limit: int,
    whole: NDArray[np.int64],
    real: NDArray[np.float64],
    open_cells: NDArray[np.bool_],
    cell_size_m: float,
) -> None:
    """Drive the robots `first` to `last`, and judge their moves as `Driver` does; callers hold every array.

    `rows` has room for one robot's trajectory; `cells` (N, 2) and `driven` (N,) are every robot's cell and direction;
    `table` (N, 5) has the addresses of its data, qpos, qvel, ctrl and sensordata; `whole` is the model's address, the
    physics steps per period, the lengths of these four, and `Addresses`; `real` is `Gains`.
    """
    at, gains = Addresses(*to_fixed_tuple(whole[6:], _ADDRESSES)), Gains(*to_fixed_tuple(real, _GAINS))
    (width, height), ending = open_cells.shape, rows[-1, :_ENDING]
    middle_x, middle_y = (width + 1) / 2, (height + 1) / 2
    for i in range(first, last):
        x, y, direction = cells[i, 0], cells[i, 1], driven[i]
        to_x, to_y = _neighbour(x, y, direction)
        goal = Goal((x - middle_x) * cell_size_m, (y - middle_y) * cell_size_m,
                    (to_x - middle_x) * cell_size_m, (to_y - middle_y) * cell_size_m)  # fmt: skip
        qpos, qvel = _doubles(table[i, 1], whole[2]), _doubles(table[i, 2], whole[3])
        ctrl, sensed = _doubles(table[i, 3], whole[4]), _doubles(table[i, 4], whole[5])
        body = Body(whole[0], table[i, 0], whole[1], at, qpos, qvel, ctrl, sensed, ending)
        stepped, status = drive(standing, limit, False, goal, gains, body, None, None, rows, 0)
        write_ending(body)
        crossed = crossed_in(rows, standing, stepped, goal)
        _judge(i, (x, y), (to_x, to_y), ending, crossed, stepped, status, standing, open_cells, cell_size_m, into)


@leaf_njit(inline="always")
def _judge(
    i: int,
    cell: tuple[int, int],
    to: tuple[int, int],
    ending: NDArray[np.float64],
    crossed: int,
    stepped: int,
    status: int,
    standing: int,
    open_cells: NDArray[np.bool_],
    cell_size_m: float,
    into: Driven,
) -> None:
    """Write what a move came to that ended so."""
    (width, height), (x, y), (to_x, to_y) = open_cells.shape, cell, to
    middle_x, middle_y = (width + 1) / 2, (height + 1) / 2
    x_m, y_m = ending[0], ending[1]
    stands = math.isfinite(x_m + y_m + ending[2]) and ending[4] == 1.0 and ending[3] >= UPRIGHT_COSINE
    column, row = _column(x_m, cell_size_m, width), _column(y_m, cell_size_m, height)
    is_open = 1 <= to_x <= width and 1 <= to_y <= height and open_cells[to_x - 1, to_y - 1]
    moved = stands and status == ARRIVED and column == to_x and row == to_y
    blocked = stands and status == RETURNED and column == x and row == y and not is_open
    into.stepped[i], into.fallen[i] = stepped, not stands
    into.periods[i], into.elapsed[i] = max(0, stepped - standing), max(stepped, standing)
    into.outcome[i] = MOVED if moved else BLOCKED if blocked else FAILED
    into.crossed[i] = crossed if moved else 0
    into.after[i, 0], into.after[i, 1] = (column, row) if stands else (x, y)
    into.off_m[i, 0] = x_m - (column - middle_x) * cell_size_m if stands else math.nan
    into.off_m[i, 1] = y_m - (row - middle_y) * cell_size_m if stands else math.nan


@cached_njit(motion, robot, of_one, nogil=True)
def judge_fleet(
    cells: NDArray[np.int64],
    driven: NDArray[np.int64],
    endings: NDArray[np.float64],
    stepped: NDArray[np.int64],
    status: NDArray[np.int64],
    standing: int,
    open_cells: NDArray[np.bool_],
    cell_size_m: float,
    into: Driven,
) -> None:
    """Judge moves that were driven elsewhere, and ended in `endings`, (N, 6), after so many periods, (N,)."""
    for i in range(len(cells)):
        x, y = cells[i, 0], cells[i, 1]
        to, crossed = _neighbour(x, y, driven[i]), int(endings[i, 5])
        _judge(
            i, (x, y), to, endings[i], crossed, stepped[i], status[i], standing, open_cells, cell_size_m, into
        )  # fmt: skip
