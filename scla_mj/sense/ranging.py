"""Pose correction by least squares: eight ranges to the walls against the known map."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from scla_mj.compiled import cached_njit
from scla_mj.grid import Grid

RAYS: Final = 8
"""One every 45 degrees, the first straight ahead: any heading has one within 22.5 degrees of each wall's normal."""
RANGE_NOISE_M: Final = 0.010
"""Standard deviation of one range: a time-of-flight sensor such as the VL53L1X is good to +-20 mm, two of these."""
MAX_RANGE_M: Final = 4.0
"""Beyond this distance there is no echo (VL53L1X: up to 4 m)."""

_POSITION_PRIOR_M: Final = 0.05
_HEADING_PRIOR_RAD: Final = 0.01
"""Standard deviations of one move's odometry: slipping tyres cost some centimetres; a gyro still keeps the heading to a
tenth of a degree per move, and five times that leaves room for the error of the last correction."""
_OUTLIER_M: Final = 0.05
"""Errors above this lose weight: the ray may have met another wall."""
_LOST_M: Final = 3 * RANGE_NOISE_M
"""Where the ranges miss the map by more than this on average, the robot is not near its believed position."""
_SEARCH_STEPS: Final = 4
_SEARCH_STEP_M: Final = 0.1
"""It then searches a lattice of 0.4 m around that: as far as a move can lead astray."""
_ITERATIONS: Final = 5
"""Gauss-Newton converges within three iterations; two more are for ranges that jump from one wall to the next."""


class ArenaMap(NamedTuple):
    """The known walls: the arena's half extents, and the centres of the closed cells, shape (count, 2),
    with half of their edge."""

    half_x_m: float
    half_y_m: float
    closed_m: NDArray[np.float64]
    half_cell_m: float


def make_map(grid: Grid) -> ArenaMap:
    """Return the map of an arena."""
    closed = np.array([grid.centre_m(cell) for cell in sorted(grid.closed)], dtype=float).reshape(-1, 2)
    half = grid.cell_size_m / 2
    return ArenaMap(grid.cells[0] * half, grid.cells[1] * half, closed, half)


def ray_angles() -> NDArray[np.float64]:
    """Return each ray's angle from straight ahead, towards the left, shape (RAYS,)."""
    return np.linspace(0.0, math.tau, RAYS, endpoint=False)


@cached_njit(makes_arrays=True)
def expected_range(arena: ArenaMap, x_m: float, y_m: float, angle_rad: float) -> tuple[float, float, float]:
    """Return a ray's distance to a wall from a point inside the walls, and that wall's normal, facing the robot.

    If the ray meets nothing, from a point beyond the walls outwards, the distance is infinite and the normal zero.
    """
    dx, dy = math.cos(angle_rad), math.sin(angle_rad)
    best, normal_x, normal_y = math.inf, 0.0, 0.0
    if dx != 0.0:
        along = (math.copysign(arena.half_x_m, dx) - x_m) / dx
        if 0.0 < along < best:
            best, normal_x, normal_y = along, -math.copysign(1.0, dx), 0.0
    if dy != 0.0:
        along = (math.copysign(arena.half_y_m, dy) - y_m) / dy
        if 0.0 < along < best:
            best, normal_x, normal_y = along, 0.0, -math.copysign(1.0, dy)
    for i in range(len(arena.closed_m)):
        entry, across_x = _box_entry(arena.closed_m[i, 0] - x_m, arena.closed_m[i, 1] - y_m, arena.half_cell_m, dx, dy)
        if 0.0 < entry < best:
            best = entry
            normal_x = -math.copysign(1.0, dx) if across_x else 0.0
            normal_y = 0.0 if across_x else -math.copysign(1.0, dy)
    return best, normal_x, normal_y


@njit(inline="always")
def _box_entry(to_x: float, to_y: float, half: float, dx: float, dy: float) -> tuple[float, bool]:
    """Return where a ray enters a box, infinite if it misses, and whether through a face across x."""
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
    arena: ArenaMap, pose: NDArray[np.float64], angles_rad: NDArray[np.float64], ranges_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the pose that fits the ranges and the believed pose best, by damped least squares.

    Args:
        arena: the known map.
        pose: believed x and y in metres and heading in radians, shape (3,).
        angles_rad: each ray's angle from straight ahead.
        ranges_m: measured distances from the axle's midpoint, one per ray; not finite without an echo.

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
            expected, normal_x, normal_y = expected_range(arena, estimate[0], estimate[1], direction)
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
    arena: ArenaMap, pose: NDArray[np.float64], angles_rad: NDArray[np.float64], ranges_m: NDArray[np.float64]
) -> float:
    """Return the mean difference between the ranges that gave an echo and the map's for a pose, 0 without any echo.

    It is infinite at a pose from which the map has nothing to meet.
    """
    total, count = 0.0, 0
    for angle, measured in zip(angles_rad, ranges_m):  # noqa: B905 numba knows no strict
        if math.isfinite(measured):
            total += abs(measured - expected_range(arena, pose[0], pose[1], pose[2] + angle)[0])
            count += 1
    return total / count if count else 0.0


@cached_njit(makes_arrays=True)
def located_pose(
    arena: ArenaMap, pose: NDArray[np.float64], angles_rad: NDArray[np.float64], ranges_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return `corrected_pose`; where the ranges do not fit it, from the best position around the believed one."""
    best: NDArray[np.float64] = corrected_pose(arena, pose, angles_rad, ranges_m)
    least = misfit_m(arena, best, angles_rad, ranges_m)
    if least <= _LOST_M:
        return best
    for i in range(-_SEARCH_STEPS, _SEARCH_STEPS + 1):
        for j in range(-_SEARCH_STEPS, _SEARCH_STEPS + 1):
            start = pose + np.array([i * _SEARCH_STEP_M, j * _SEARCH_STEP_M, 0.0])
            found = corrected_pose(arena, start, angles_rad, ranges_m)
            misfit = misfit_m(arena, found, angles_rad, ranges_m)
            if misfit < least:
                best, least = found, misfit
    return best
