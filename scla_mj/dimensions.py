"""What a robot measures: read from its compiled model, and what the controller's constants follow from."""

from __future__ import annotations

from typing import NamedTuple


class Dimensions(NamedTuple):
    """The robot's measures, read from the compiled model.

    Reaches are how far bumpers stand out from the axle, `turning_radius_m` how far anything does. The centre of mass is
    `com_behind_m` behind the axle (negative: ahead), `com_height_m` above the floor; casters stand as far behind and
    ahead of the axle as the furthest does, 0 where there is none. `yaw_inertia_kg_m2` is about the axle's midpoint.
    `torque_reach_rad_s` is by how much a command must differ from a wheel's speed for all of the motor's torque.
    """

    wheel_radius_m: float
    track_m: float
    front_reach_m: float
    rear_reach_m: float
    top_wheel_speed_rad_s: float
    turning_radius_m: float
    mass_kg: float
    com_behind_m: float
    com_height_m: float
    caster_behind_m: float
    caster_ahead_m: float
    yaw_inertia_kg_m2: float
    friction: float
    motor_torque_n_m: float
    torque_reach_rad_s: float
