"""The scalar laws a motion is made of, compiled with numba."""

from __future__ import annotations

import math

from scla_mj.compiled import leaf_njit


@leaf_njit(from_python=True)
def wrap_angle(angle_rad: float) -> float:
    """Return the same angle in -pi..pi."""
    return math.atan2(math.sin(angle_rad), math.cos(angle_rad))


@leaf_njit(from_python=True)
def braking_speed(distance: float, top: float, deceleration: float, rate_per_s: float) -> float:
    """Return the signed speed from which a constant deceleration ends at the target, softened near it.

    Far away this is sqrt(2 deceleration distance); near zero it tends to rate distance, so that the approach is smooth.
    Distance in m or rad, speed in the same unit per second.
    """
    knee = deceleration / rate_per_s
    speed = math.sqrt(2.0 * deceleration * abs(distance) + knee * knee) - knee
    return math.copysign(min(speed, top), distance)


@leaf_njit(from_python=True)
def slew(previous: float, wanted: float, change: float) -> float:
    """Return `wanted`, or as near to it as `change` away from `previous` allows."""
    return min(max(wanted, previous - change), previous + change)
