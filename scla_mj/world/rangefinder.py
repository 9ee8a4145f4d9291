"""Distances to the walls: rays from the robot, as a ring of range sensors casts them."""

from __future__ import annotations

import math
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from scla_mj.world import names
from scla_mj.world.world import World

_HEIGHT_M: Final = 0.068
"""Height of the ring above the floor: half-way up the walls, so that a robot that leans a little still meets them."""
_NO_BODY: Final = -1


def ranges_m(world: World, angles_rad: NDArray[np.float64], *, reach_m: float) -> NDArray[np.float64]:
    """Return the true distance to a wall or a closed cell along each ray.

    The rays start at the axle's midpoint, in the chassis' own plane: a robot that leans casts them up and down. (Real
    sensors sit on the chassis' rim; their distance from the axle is known and taken off.)

    Args:
        world: with the robot where it is now (MuJoCo's own `xpos` is that of the latest step's start).
        angles_rad: each ray's angle from straight ahead, towards the left.
        reach_m: beyond this distance there is no echo.

    Returns:
        Distances in metres, one per ray; infinite where there is no echo.
    """
    elements = np.empty(9)
    mujoco.mju_quat2Mat(elements, world.root_qpos[3:])
    frame = elements.reshape(3, 3)
    rays = np.column_stack([np.cos(angles_rad), np.sin(angles_rad), np.zeros(len(angles_rad))]) @ frame.T
    above_axle_m = round(_HEIGHT_M - world.dimensions.wheel_radius_m, 6)
    origin = world.root_qpos[:3] + above_axle_m * frame[:, 2]
    groups, met = np.zeros(mujoco.mjNGROUP, dtype=np.uint8), np.empty(1, dtype=np.int32)
    groups[names.WALL_GROUP] = 1
    # One by one: mj_multiRay (3.17) loses the walls, which only planes can touch, where the floor has closed cells.
    lengths = np.array(
        [mujoco.mj_ray(world.model, world.data, origin, ray, groups, True, _NO_BODY, met, None) for ray in rays]
    )
    return np.where((lengths >= 0.0) & (lengths <= reach_m), lengths, math.inf)
