"""From the rows of a move's trajectory to what a recording keeps of them."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.signals import TRAJECTORY_COLUMNS
from scla_mj.telemetry.pile import Pile
from scla_mj.telemetry.scene import xyzw

POSE_PERIOD_S: Final = 0.05
"""A recording keeps a pose about this often: 20 Hz still looks smooth."""

_TIME = TRAJECTORY_COLUMNS.index("time_s")
_POSITION = slice(TRAJECTORY_COLUMNS.index("x_m"), TRAJECTORY_COLUMNS.index("z_m") + 1)
_QUATERNION = slice(TRAJECTORY_COLUMNS.index("qw"), TRAJECTORY_COLUMNS.index("qz") + 1)
_LEFT = TRAJECTORY_COLUMNS.index("wheel_left_rad")
_RIGHT = TRAJECTORY_COLUMNS.index("wheel_right_rad")


class Poses(NamedTuple):
    """Chassis poses in the world and the wheels' turns about their axles, a row a time; quaternions are x y z w."""

    time_s: NDArray[np.float64]
    position_m: NDArray[np.float32]
    quaternion: NDArray[np.float32]
    left_wheel: NDArray[np.float32]
    right_wheel: NDArray[np.float32]


def add_poses(pile: Pile, trajectory: NDArray[np.float64], stride: int) -> int:
    """Add every stride-th row, and the last one, for the pose in which a move ended is always kept; return how many."""
    before, rows = len(pile), len(trajectory)
    pile.add(trajectory[::stride])
    if rows and (rows - 1) % stride:
        pile.add(trajectory[-1:])
    return len(pile) - before


def poses_of(trajectory: NDArray[np.float64]) -> Poses:
    """Split rows of `TRAJECTORY_COLUMNS` into what the recording's entities want."""
    return Poses(
        time_s=trajectory[:, _TIME],
        position_m=trajectory[:, _POSITION].astype(np.float32),
        quaternion=xyzw(trajectory[:, _QUATERNION]).astype(np.float32),
        left_wheel=_turn_about_y(trajectory[:, _LEFT]),
        right_wheel=_turn_about_y(trajectory[:, _RIGHT]),
    )


def end_time_s(trajectory: NDArray[np.float64], start_s: float) -> float:
    """Return when a move ended, or `start_s` if nothing moved."""
    return float(trajectory[-1, _TIME]) if len(trajectory) else start_s


def _turn_about_y(angle_rad: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the quaternions x y z w of turns about +y, the wheels' axle."""
    quaternion = np.zeros((len(angle_rad), 4), np.float32)
    quaternion[:, 1] = np.sin(angle_rad / 2)
    quaternion[:, 3] = np.cos(angle_rad / 2)
    return quaternion
