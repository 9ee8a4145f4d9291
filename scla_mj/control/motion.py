"""The controller's data: its input, its goal, its state and its gains."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from scla_mj.config import ControllerConfig
from scla_mj.dimensions import Dimensions

DRIVING: Final = 0
"""The move is not over."""
ARRIVED: Final = 1
"""The robot stands at the target's centre, or has used up its aims on the way there."""
RETURNED: Final = 2
"""The bumper touched, and the robot stands back at the start's centre, or has used up its aims on the way there."""

STANDING: Final = 0
OUTWARD: Final = 1
BACK: Final = 2
STARTING: Final = 3
AGAIN: Final = 4
"""On the way back to the start as in BACK, but to set out once more."""

FRONT: Final = 1
REAR: Final = 2
"""The bits of a motion's touch."""

_STEERING_PER_S: Final = 20.0
_STEERING_PER_PERIOD: Final = 0.2
"""Gain from the error of heading to the turn rate while driving; the wheels and the period lag by about 0.02 s."""
_ALIGNED_RAD: Final = 0.25
"""It drives only while it faces its course this closely; the rest of the turn overlaps with the start of the drive."""
_APPROACH_PER_S: Final = 40.0
_APPROACH_PER_PERIOD: Final = 0.4
"""Gain of the last approach: 40 per second, or 0.4 of the error per period where periods are long (stability)."""

_OF_GRIP: Final = 0.5
"""Share of the tyres' grip for what the wheels do within a period, and for turning in place."""
_OF_TYRE: Final = 0.4
"""Share of the grip for turn and drive together."""
_OF_SLIPPING: Final = 0.85
_OF_TIPPING: Final = 0.92
_OF_MOTORS: Final = 0.65
"""Shares of the accelerations at which the tyres slip, the robot tips, and the motors can no more: the highest at which
2,000 moves of the burger end where they should."""
_OF_TURNING: Final = 0.8
"""Share of the turn rate at which the motors' speed is used up."""
_BALANCED_SINE: Final = 0.176
_BALANCED_RAD_S: Final = 2.933
"""Tipping over by 10 degrees, or at this rate, it drives under its lean with all that the motors have."""
_LOOKAHEAD_TRACKS: Final = 0.3125
_TOUCH_CELLS: Final = 1 / 9
_TOUCH_M: Final = 0.03
"""A wall in the way is touched within this, and a period's drive, of where it must be, at most a ninth of a cell."""
_GRAVITY_M_S2: Final = 9.81


class Motion(NamedTuple):
    """The controller's input in each period: pose, body speeds, which bumpers touched since the last (FRONT, REAR,
    both or 0), the cosine of its lean, and the sine and the rate of its pitch, forwards positive."""

    x_m: float
    y_m: float
    heading_rad: float
    speed_m_s: float
    turn_rate_rad_s: float
    touched: int
    upright: float = 1.0
    pitch_sine: float = 0.0
    pitch_rate_rad_s: float = 0.0


class Goal(NamedTuple):
    """One move: from the centre of one cell to the centre of another."""

    start_x_m: float
    start_y_m: float
    target_x_m: float
    target_y_m: float


class Gains(NamedTuple):
    """The controller's limits and tolerances as the compiled law takes them.

    A point of its line that the robot steers at is never nearer than `lookahead_m`: a nearer one makes it zigzag.
    `balance_m_s` and `balance_m` are the speed under its lean, per sine of the pitch and per rad/s of it.
    """

    period_s: float
    wheel_radius_m: float
    track_m: float
    front_reach_m: float
    rear_reach_m: float
    top_rim_speed_m_s: float
    max_speed_m_s: float
    forward_acceleration_m_s2: float
    backward_acceleration_m_s2: float
    max_turn_rate_rad_s: float
    max_turn_acceleration_rad_s2: float
    position_tolerance_m: float
    heading_tolerance_rad: float
    approach_per_s: float
    steering_per_s: float
    aligned_rad: float
    tyre_acceleration_m_s2: float
    reaim_distance_m: float
    reaim_limit: int
    lookahead_m: float
    touch_margin_m: float
    balance_m_s: float
    balance_m: float


class State(NamedTuple):
    """What the controller remembers between two periods.

    `course_rad` is the line's direction of travel, `direction` 1 forwards and -1 in reverse; the speeds are the last
    commanded ones, the drive's along the course. `careful` says that the robot has slipped on this move.
    """

    phase: int
    course_rad: float
    direction: float
    aims: int
    speed_m_s: float
    turn_rate_rad_s: float
    careful: bool


STAND_STILL: Final = State(STANDING, 0.0, 1.0, 0, 0.0, 0.0, False)


def make_gains(config: ControllerConfig, body: Dimensions, *, period_s: float, cell_size_m: float) -> Gains:
    """Return the gains of a robot of these measures in cells of this size: the one place where they follow from them.

    The settings are upper limits; a robot that would slip, tip over or ask too much of its motors gets lower ones.
    """
    radius_m, track_m = body.wheel_radius_m, body.track_m
    top_rim_speed_m_s = body.top_wheel_speed_rad_s * radius_m
    slipping_m_s2, forwards_m_s2, backwards_m_s2, turning_rad_s2 = _limits(body)
    motors_m_s2 = _OF_MOTORS * 2 * body.motor_torque_n_m / radius_m / body.mass_kg
    wheel_load_n = slipping_m_s2 * body.mass_kg / 2
    # A command's step within a period must not jerk a wheel loose.
    jerk_m_s2 = (
        _OF_GRIP * wheel_load_n * radius_m * radius_m * body.torque_reach_rad_s / body.motor_torque_n_m / period_s
    )
    most_m_s2 = min(motors_m_s2, jerk_m_s2)
    motors_rad_s2 = _OF_MOTORS * body.motor_torque_n_m / radius_m * track_m / body.yaw_inertia_kg_m2
    reach_m_s = body.torque_reach_rad_s * radius_m
    return Gains(
        period_s=period_s,
        wheel_radius_m=radius_m,
        track_m=track_m,
        front_reach_m=body.front_reach_m,
        rear_reach_m=body.rear_reach_m,
        top_rim_speed_m_s=top_rim_speed_m_s,
        max_speed_m_s=min(float(config.max_speed_m_s), top_rim_speed_m_s),
        forward_acceleration_m_s2=min(float(config.forward_acceleration_m_s2), forwards_m_s2, most_m_s2),
        backward_acceleration_m_s2=min(float(config.backward_acceleration_m_s2), backwards_m_s2, most_m_s2),
        max_turn_rate_rad_s=min(float(config.max_turn_rate_rad_s), _OF_TURNING * 2 * top_rim_speed_m_s / track_m),
        max_turn_acceleration_rad_s2=min(
            float(config.max_turn_acceleration_rad_s2), turning_rad_s2, motors_rad_s2, jerk_m_s2 * 2 / track_m
        ),
        position_tolerance_m=float(config.position_tolerance_m),
        heading_tolerance_rad=float(config.heading_tolerance_rad),
        approach_per_s=min(_APPROACH_PER_S, _APPROACH_PER_PERIOD / period_s),
        steering_per_s=min(_STEERING_PER_S, _STEERING_PER_PERIOD / period_s),
        aligned_rad=_ALIGNED_RAD,
        tyre_acceleration_m_s2=round(min(_OF_TYRE * slipping_m_s2, most_m_s2), 1),
        reaim_distance_m=config.reaim_fraction * cell_size_m,
        reaim_limit=config.reaim_limit,
        lookahead_m=round(_LOOKAHEAD_TRACKS * track_m, 3),
        touch_margin_m=min(_TOUCH_M, _TOUCH_CELLS * cell_size_m),
        balance_m_s=round(reach_m_s / _BALANCED_SINE, 3),
        balance_m=round(reach_m_s / _BALANCED_RAD_S, 3),
    )


def _limits(body: Dimensions) -> tuple[float, float, float, float]:
    """Return the acceleration at which a robot at rest would slip, and the highest that it may have forwards, backwards
    (speeding up in reverse, or braking) and in turn.

    Pushing forwards shifts weight to the rear, pushing backwards to the front: it slips where the wheels lose load to
    a caster there, and tips where it has none.
    """
    behind_m, height_m = body.com_behind_m, body.com_height_m
    caster_m = body.caster_behind_m if behind_m >= 0.0 else body.caster_ahead_m
    slipping = body.friction * _GRAVITY_M_S2 * (1.0 - abs(behind_m) / caster_m)

    def push(caster_m: float, towards_m: float) -> float:
        """Limit a push that shifts weight to a caster so far off, the centre of mass being off the axle towards it."""
        if caster_m <= 0.0:
            return _OF_TIPPING * _GRAVITY_M_S2 * -towards_m / height_m
        loss = body.friction * height_m / caster_m
        return _OF_SLIPPING * body.friction * _GRAVITY_M_S2 * (1.0 - towards_m / caster_m) / (1.0 + loss)

    grip_n = slipping * body.mass_kg / 2
    along, across = body.yaw_inertia_kg_m2 / body.track_m, body.mass_kg * behind_m / 2
    turning = _OF_GRIP * grip_n / math.hypot(along, across)
    return slipping, push(body.caster_behind_m, behind_m), push(body.caster_ahead_m, -behind_m), turning
