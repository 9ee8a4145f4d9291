"""The controller's data: its input, its goal, its state and its gains."""

from __future__ import annotations

from typing import Final, NamedTuple

from scla_mj.config import ControllerConfig

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
    """The controller's limits and tolerances as the compiled law takes them."""

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


def make_gains(
    config: ControllerConfig,
    *,
    period_s: float,
    wheel_radius_m: float,
    track_m: float,
    front_reach_m: float,
    rear_reach_m: float,
    top_wheel_speed_rad_s: float,
    tyre_acceleration_m_s2: float,
    cell_size_m: float,
) -> Gains:
    """Return the gains of a robot with these wheels and bumpers in cells of this size."""
    top_rim_speed_m_s = top_wheel_speed_rad_s * wheel_radius_m
    return Gains(
        period_s=period_s,
        wheel_radius_m=wheel_radius_m,
        track_m=track_m,
        front_reach_m=front_reach_m,
        rear_reach_m=rear_reach_m,
        top_rim_speed_m_s=top_rim_speed_m_s,
        max_speed_m_s=min(float(config.max_speed_m_s), top_rim_speed_m_s),
        forward_acceleration_m_s2=float(config.forward_acceleration_m_s2),
        backward_acceleration_m_s2=float(config.backward_acceleration_m_s2),
        max_turn_rate_rad_s=float(config.max_turn_rate_rad_s),
        max_turn_acceleration_rad_s2=float(config.max_turn_acceleration_rad_s2),
        position_tolerance_m=float(config.position_tolerance_m),
        heading_tolerance_rad=float(config.heading_tolerance_rad),
        approach_per_s=min(_APPROACH_PER_S, _APPROACH_PER_PERIOD / period_s),
        steering_per_s=min(_STEERING_PER_S, _STEERING_PER_PERIOD / period_s),
        aligned_rad=_ALIGNED_RAD,
        tyre_acceleration_m_s2=tyre_acceleration_m_s2,
        reaim_distance_m=config.reaim_fraction * cell_size_m,
        reaim_limit=config.reaim_limit,
    )
