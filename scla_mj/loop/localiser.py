"""The pose that the robot believes in: the true one, dead reckoning, or dead reckoning corrected by range rays."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scla_mj.config import Localisation
from scla_mj.sense.odometry import draw_gyro_bias_rad_s, make_odometer, place
from scla_mj.sense.ranging import MAX_RANGE_M, RANGE_NOISE_M, RAYS, located_pose, make_map, ray_angles
from scla_mj.signals import Localised
from scla_mj.world.rangefinder import ranges_m
from scla_mj.world.world import World


class Localiser:
    """Keeps the believed pose of the world's robot.

    Attributes:
        odometer: what the compiled loop advances in every control period and steers by; None for the truth.
    """

    def __init__(self, kind: Localisation, world: World, *, control_period_s: float, rng: np.random.Generator) -> None:
        self._world = world
        self._rng = rng
        self._angles = ray_angles()
        self._map = make_map(world.grid) if kind == "sensors" else None
        self.odometer = None
        if kind != "truth":
            self.odometer = make_odometer(rolling_radius_m=world.rolling_radius_m, period_s=control_period_s, rng=rng)

    def position_m(self) -> tuple[float, float]:
        """Return the believed position, x and y."""
        x_m, y_m, _ = self.place()
        return x_m, y_m

    def place(self) -> tuple[float, float, float]:
        """Return the believed position, x and y in metres, and the heading in radians."""
        if self.odometer is not None:
            return tuple(self.odometer.estimate[:3].tolist())
        return self._world.pose()[:3]

    def power_on(self) -> None:
        """Switch the sensors on: this draws the gyro's bias."""
        if self.odometer is not None:
            self.odometer.gyro_bias_rad_s[:] = draw_gyro_bias_rad_s(self._rng)

    def set_to_truth(self) -> None:
        """Set the believed pose to the true one: a robot knows where it is spawned."""
        if self.odometer is not None:
            pose = self._world.pose()
            place(self.odometer, pose.x_m, pose.y_m, pose.heading_rad, self._world.wheel_angles_rad())

    def look(self) -> float:
        """Correct the believed pose by the range rays, if the robot has them.

        Returns:
            By how far this moved the believed position, in metres.
        """
        if self.odometer is None or self._map is None:
            return 0.0
        ranges = ranges_m(self._world, self._angles, reach_m=MAX_RANGE_M)
        measured = ranges + self._rng.normal(0.0, RANGE_NOISE_M, RAYS)
        pose = self.odometer.estimate[:3]
        before = pose.copy()
        pose[:] = located_pose(self._map, before, self._angles, measured)
        return float(np.hypot(*(pose - before)[:2]))

    def error(self) -> Localised | None:
        """Return the error of the believed position; None where the robot knows the truth."""
        if self.odometer is None:
            return None
        grid, pose, (x_m, y_m) = self._world.grid, self._world.pose(), self.position_m()
        right = math.isfinite(x_m + y_m) and grid.cell_at(x_m, y_m) == grid.cell_at(pose.x_m, pose.y_m)
        return Localised(math.hypot(x_m - pose.x_m, y_m - pose.y_m), right)

    def state(self) -> dict[str, Any]:
        """Return the belief, the gyro's bias and the sensors' generator."""
        state: dict[str, Any] = {"rng": self._rng.bit_generator.state}
        if self.odometer is not None:
            for name in ("estimate", "counts", "gyro_bias_rad_s"):
                state[name] = getattr(self.odometer, name).copy()
        return state

    def restore(self, state: dict[str, Any]) -> None:
        """Resume from a `state`, bit-identically."""
        self._rng.bit_generator.state = state["rng"]
        if self.odometer is not None:
            for name in ("estimate", "counts", "gyro_bias_rad_s"):
                getattr(self.odometer, name)[:] = state[name]
