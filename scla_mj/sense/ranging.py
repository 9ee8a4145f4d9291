"""Where am I? Eight ranges to the walls against the known map: a pose correction by least squares."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numba import njit

from scla_mj.compiled import cached_njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from scla_mj.grid import Grid

RAYS: Final = 8
"""One every 45 degrees, the first straight ahead: any heading has one within 22.5 degrees of each wall's normal."""
RANGE_NOISE_M: Final = 0.010
"""Standard deviation of one range: a time-of-flight sensor such as the VL53L1X is good to +-20 mm, two of these."""
MAX_RANGE_M: Final = 4.0
"""What is further away gives no echo (VL53L1X: up to 4 m)."""

_POSITION_PRIOR_M: Final = 0.05
_HEADING_PRIOR_RAD: Final = 0.01
"""What one move's odometry is trusted to: slipping tyres cost some centimetres; a gyro keeps the heading all the same,
to a tenth of a degree a move, and five times that leaves room for what the last correction was off."""
_OUTLIER_M: Final = 0.05
"""A range that is further than this from what the map says counts for less and less: it may have met another wall."""
_LOST_M: Final = 3 * RANGE_NOISE_M
"""Where the ranges miss the map by more than this on average, the robot is not near the place it believes to be."""
_SEARCH_STEPS: Final = 4
_SEARCH_STEP_M: Final = 0.1
"""It then looks around for a better place, on a lattice of 0.4 m about it: as far as a move can lead astray."""
_ITERATIONS: Final = 5
"""Gauss-Newton converges within three; two more for ranges that jump from one wall to the next."""


class FloorMap(NamedTuple):
    """The walls as the robot knows them: the floor's half extents, and the closed cells, shape (count, 2), by their
    centres, with half their edge."""

    half_x_m: float
    half_y_m: float
    closed_m: NDArray[np.float64]
    half_cell_m: float


def make_map(grid: Grid) -> FloorMap:
    """Return the map of a floor."""
    closed = np.array([grid.centre_m(cell) for cell in sorted(grid.closed)], dtype=float).reshape(-1, 2)
    half = grid.cell_size_m / 2
    return FloorMap(grid.cells[0] * half, grid.cells[1] * half, closed, half)


def ray_angles() -> NDArray[np.float64]:
    """Return each ray's angle from straight ahead, towards the left, shape (RAYS,)."""
    return np.linspace(0.0, math.tau, RAYS, endpoint=False)


@cached_njit(makes_arrays=True)
def expected_range(floor: FloorMap, x_m: float, y_m: float, angle_rad: float) -> tuple[float, float, float]:
    """Return how far a ray goes from a point inside the walls, and the normal of the wall it meets, facing the robot.

    The range is infinite, and the normal zero, where nothing is met: from a point beyond the walls, outwards.
    """
    dx, dy = math.cos(angle_rad), math.sin(angle_rad)
    best, normal_x, normal_y = math.inf, 0.0, 0.0
    if dx != 0.0:
        along = (math.copysign(floor.half_x_m, dx) - x_m) / dx
        if 0.0 < along < best:
            best, normal_x, normal_y = along, -math.copysign(1.0, dx), 0.0
    if dy != 0.0:
        along = (math.copysign(floor.half_y_m, dy) - y_m) / dy
        if 0.0 < along < best:
            best, normal_x, normal_y = along, 0.0, -math.copysign(1.0, dy)
    for i in range(len(floor.closed_m)):
        entry, across_x = _box_entry(floor.closed_m[i, 0] - x_m, floor.closed_m[i, 1] - y_m, floor.half_cell_m, dx, dy)
        if 0.0 < entry < best:
            best = entry
            normal_x = -math.copysign(1.0, dx) if across_x else 0.0
            normal_y = 0.0 if across_x else -math.copysign(1.0, dy)
    return best, normal_x, normal_y


@njit(inline="always")
def _box_entry(to_x: float, to_y: float, half: float, dx: float, dy: float) -> tuple[float, bool]:
    """Return where a ray enters a box (infinite if it misses), and whether through a face across x."""
    near_x, far_x = _slab(to_x, half, dx)
    near_y, far_y = _slab(to_y, half, dy)
    near, far = max(near_x, near_y), min(far_x, far_y)
    return (near if near <= far else math.inf), near_x >= near_y


@njit(inline="always")
def _slab(to_centre: float, half: float, direction: float) -> tuple[float, float]:
    """Return between which two lengths a ray is within a slab of the plane."""
    if direction == 0.0:
        inside = abs(to_centre) <= half
        return (-math.inf, math.inf) if inside else (math.inf, -math.inf)
    first, second = (to_centre - half) / direction, (to_centre + half) / direction
    return min(first, second), max(first, second)


@cached_njit(makes_arrays=True)
def corrected_pose(
    floor: FloorMap, pose: NDArray[np.float64], angles_rad: NDArray[np.float64], ranges_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the pose that the ranges and the believed pose say together, by damped least squares.

    Args:
        floor: the known map.
        pose: believed x and y in metres and heading in radians, shape (3,).
        angles_rad: each ray's angle from straight ahead.
        ranges_m: what each ray measured, the robot's own radius included; not finite where there was no echo.

    Returns:
        The corrected pose, shape (3,); the believed one where no ray met a wall.
    """
    estimate = pose.copy()
    prior = np.array([_POSITION_PRIOR_M**-2, _POSITION_PRIOR_M**-2, _HEADING_PRIOR_RAD**-2])
    for _ in range(_ITERATIONS):
        information = np.diag(prior)
        gradient = prior * (pose - estimate)
        for angle, measured in zip(angles_rad, ranges_m):  # noqa: B905 numba knows no strict
            direction = estimate[2] + angle
            expected, normal_x, normal_y = expected_range(floor, estimate[0], estimate[1], direction)
            if not (math.isfinite(measured) and math.isfinite(expected)):
                continue
            facing = normal_x * math.cos(direction) + normal_y * math.sin(direction)
            turning = normal_y * math.cos(direction) - normal_x * math.sin(direction)
            slope = np.array([-normal_x / facing, -normal_y / facing, -expected * turning / facing])
            error = measured - expected
            weight = RANGE_NOISE_M**-2 / (1.0 + (error / _OUTLIER_M) ** 2)
            information += weight * np.outer(slope, slope)
            gradient += weight * error * slope
        estimate += np.linalg.solve(information, gradient)
    return estimate


@cached_njit(makes_arrays=True)
def misfit_m(
    floor: FloorMap, pose: NDArray[np.float64], angles_rad: NDArray[np.float64], ranges_m: NDArray[np.float64]
) -> float:
    """Return by how much the ranges that gave an echo differ from what the map says for a pose, on average; 0 of none.

    A place where the map says that there is nothing to meet is infinitely wrong.
    """
    total, count = 0.0, 0
    for angle, measured in zip(angles_rad, ranges_m):  # noqa: B905 numba knows no strict
        if math.isfinite(measured):
            total += abs(measured - expected_range(floor, pose[0], pose[1], pose[2] + angle)[0])
            count += 1
    return total / count if count else 0.0


@cached_njit(makes_arrays=True)
def located_pose(
    floor: FloorMap, pose: NDArray[np.float64], angles_rad: NDArray[np.float64], ranges_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return `corrected_pose`, from the best of the places around where the ranges do not fit the believed one."""
    best: NDArray[np.float64] = corrected_pose(floor, pose, angles_rad, ranges_m)
    least = misfit_m(floor, best, angles_rad, ranges_m)
    if least <= _LOST_M:
        return best
    for i in range(-_SEARCH_STEPS, _SEARCH_STEPS + 1):
        for j in range(-_SEARCH_STEPS, _SEARCH_STEPS + 1):
            start = pose + np.array([i * _SEARCH_STEP_M, j * _SEARCH_STEP_M, 0.0])
            found = corrected_pose(floor, start, angles_rad, ranges_m)
            misfit = misfit_m(floor, found, angles_rad, ranges_m)
            if misfit < least:
                best, least = found, misfit
    return best
