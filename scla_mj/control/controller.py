"""One move as a feedback law: face the line to the next cell's centre, drive along it, come back if the bumper touches.

The robot holds its heading: it drives in reverse where that saves half a turn, and does not turn at all for a move on
the axis it already stands on. It aims at the cells' absolute centres, so that errors of moves do not add up. All
functions are pure and compiled with numba; `tick` is one control period.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

from numba import njit

from scla_mj.control.profile import braking_speed, slew, wrap_angle

if TYPE_CHECKING:
    from scla_mj.config import ControllerConfig

DRIVING: Final = 0
"""The move goes on."""
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
_LOOKAHEAD_M: Final = 0.05
"""The point of its line that the robot steers at is never nearer than this: a nearer one makes it zigzag."""
_ALIGNED_RAD: Final = 0.25
"""It drives only while it faces its course this closely; the rest of the turn overlaps with the start of the drive."""
_TYRE_ACCELERATION_M_S2: Final = 2.5
"""What a wheel's rim may gain or lose, turn and drive together: 40 % of what a grip of 3.1 N gives half a kilogram."""
_REVERSE_COSINE: Final = -0.7071
"""It drives in reverse where its course lies more than 135 degrees off its heading."""
_TOUCH_MARGIN_M: Final = 0.03
"""A wall in the way is touched within this, and a period's drive, of where it must be: a tenth of the smallest cell."""
_FREEING_SPEED_M_S: Final = 0.1
"""How fast it backs off from a wall that its bumper brushes while it turns."""
_TIPPING_COSINE: Final = 0.995
"""Leaning by more than 6 degrees it is about to tip: its wheels roll along until it is down again. Its own
accelerations lean it by less than 2 degrees."""
_SLIP_M_S: Final = 0.10
_SLIP_RAD_S: Final = 0.7
"""A body that is off its commanded speed by this, and what two periods' acceleration adds, is not doing as its wheels
do. Undisturbed it stays within half of that."""
_CAREFUL_SPEED_M_S: Final = 0.15
_CAREFUL: Final = 0.3
"""After that it drives with this share of its accelerations, half of its speeds and gains, and wider tolerances."""
_APPROACH_PER_S: Final = 40.0
_APPROACH_PER_PERIOD: Final = 0.4
"""Gain of the last approach: 40 a second, or 0.4 of the error a period where periods are long (stability)."""


class Motion(NamedTuple):
    """What the controller is told each period: pose, body speeds, which bumpers touched since the last (FRONT, REAR,
    both or 0), and the cosine of its lean."""

    x_m: float
    y_m: float
    heading_rad: float
    speed_m_s: float
    turn_rate_rad_s: float
    touched: int
    upright: float = 1.0


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
START: Final = State(STARTING, 0.0, 1.0, 0, 0.0, 0.0, False)
"""A move that has yet to `begin`, at the heading that its first period finds."""


def make_gains(
    config: ControllerConfig,
    *,
    period_s: float,
    wheel_radius_m: float,
    track_m: float,
    front_reach_m: float,
    rear_reach_m: float,
    top_wheel_speed_rad_s: float,
    cell_size_m: float,
) -> Gains:
    """Return the gains of a robot with these wheels and bumpers in cells of this size."""
    return Gains(
        period_s=period_s,
        wheel_radius_m=wheel_radius_m,
        track_m=track_m,
        front_reach_m=front_reach_m,
        rear_reach_m=rear_reach_m,
        top_rim_speed_m_s=top_wheel_speed_rad_s * wheel_radius_m,
        max_speed_m_s=float(config.max_speed_m_s),
        forward_acceleration_m_s2=float(config.forward_acceleration_m_s2),
        backward_acceleration_m_s2=float(config.backward_acceleration_m_s2),
        max_turn_rate_rad_s=float(config.max_turn_rate_rad_s),
        max_turn_acceleration_rad_s2=float(config.max_turn_acceleration_rad_s2),
        position_tolerance_m=float(config.position_tolerance_m),
        heading_tolerance_rad=float(config.heading_tolerance_rad),
        approach_per_s=min(_APPROACH_PER_S, _APPROACH_PER_PERIOD / period_s),
        steering_per_s=min(_STEERING_PER_S, _STEERING_PER_PERIOD / period_s),
        aligned_rad=_ALIGNED_RAD,
        tyre_acceleration_m_s2=_TYRE_ACCELERATION_M_S2,
        reaim_distance_m=config.reaim_fraction * cell_size_m,
        reaim_limit=config.reaim_limit,
    )


@njit(inline="always")
def begin(goal: Goal, heading_rad: float, careful: bool = False) -> State:
    """Return the state at the start of a move: outward bound, in reverse if the target lies behind."""
    course = math.atan2(goal.target_y_m - goal.start_y_m, goal.target_x_m - goal.start_x_m)
    state: State = aim(OUTWARD, course, heading_rad, 0, careful)
    return state


@njit(inline="always")
def aim(phase: int, course_rad: float, heading_rad: float, aims: int, careful: bool) -> State:
    """Return the state of a robot at rest that is to travel along a course, backwards if it faces away from it."""
    direction = -1.0 if math.cos(course_rad - heading_rad) < _REVERSE_COSINE else 1.0
    return State(phase, course_rad, direction, aims, 0.0, 0.0, careful)


@njit(inline="always")
def tick(state: State, motion: Motion, goal: Goal, gains: Gains) -> tuple[State, float, float, int]:
    """Run one control period.

    Returns:
        The new state, the left and the right wheel's speed command in rad/s, and DRIVING, ARRIVED or RETURNED. The
        commands are not numbers if the motion is not finite (limits would swallow that): the caller checks them.
    """
    if not math.isfinite(motion.x_m + motion.y_m + motion.heading_rad + motion.speed_m_s + motion.turn_rate_rad_s):
        return state, math.nan, math.nan, DRIVING
    if state.phase == STANDING:
        return state, 0.0, 0.0, DRIVING
    if state.phase == OUTWARD and motion.touched:
        state = _touch(state, motion, goal, gains)
    elif state.phase == OUTWARD and not state.careful and motion.touched == 0 and _slips(state, motion, gains):
        state = _roll_along(state, motion, True)
    if state.careful:
        gains = _careful(gains)
    outward = state.phase == OUTWARD
    to_x = (goal.target_x_m if outward else goal.start_x_m) - motion.x_m
    to_y = (goal.target_y_m if outward else goal.start_y_m) - motion.y_m
    ahead = to_x * math.cos(state.course_rad) + to_y * math.sin(state.course_rad)
    if _at_rest_there(state, motion, ahead, gains):
        off = math.hypot(to_x, to_y)
        if state.phase == AGAIN:
            to_x, to_y, outward = goal.target_x_m - motion.x_m, goal.target_y_m - motion.y_m, True
        elif off <= gains.reaim_distance_m or state.aims >= gains.reaim_limit:
            return state, 0.0, 0.0, ARRIVED if outward else RETURNED
        phase, aims = (OUTWARD, state.aims) if state.phase == AGAIN else (state.phase, state.aims + 1)
        state = aim(phase, math.atan2(to_y, to_x), motion.heading_rad, aims, state.careful)
        ahead = math.hypot(to_x, to_y)
    elif ahead < -gains.reaim_distance_m:
        # Far beyond its target: the law that steers along a line would steer it off the line in reverse.
        state = aim(state.phase, math.atan2(to_y, to_x), motion.heading_rad, state.aims, state.careful)
        state = _roll_along(state, motion, state.careful)
        ahead = math.hypot(to_x, to_y)
    state = _steer(state, motion, ahead, to_x, to_y, gains)
    if motion.upright < _TIPPING_COSINE:
        state = _roll_along(state, motion, state.careful)
    spread = state.turn_rate_rad_s * gains.track_m / 2.0
    room = max(0.0, gains.top_rim_speed_m_s - abs(spread))
    drive = state.direction * min(max(state.speed_m_s, -room), room)
    return state, (drive - spread) / gains.wheel_radius_m, (drive + spread) / gains.wheel_radius_m, DRIVING


@njit(inline="always")
def _touch(state: State, motion: Motion, goal: Goal, gains: Gains) -> State:
    """Turn back from a wall in the way; after a touch where no such wall can be, set out or aim again."""
    forwards = state.direction > 0.0
    facing = motion.heading_rad if forwards else motion.heading_rad + math.pi
    leads = motion.touched & (FRONT if forwards else REAR)
    if leads == 0 or abs(wrap_angle(state.course_rad - facing)) >= gains.aligned_rad:
        return state
    across_x, across_y = goal.target_x_m - goal.start_x_m, goal.target_y_m - goal.start_y_m
    length = math.hypot(across_x, across_y)
    gone = ((motion.x_m - goal.start_x_m) * across_x + (motion.y_m - goal.start_y_m) * across_y) / length
    surplus = gone - (length / 2.0 - (gains.front_reach_m if forwards else gains.rear_reach_m))
    margin = _TOUCH_MARGIN_M + gains.max_speed_m_s * gains.period_s
    phase, course, aims = BACK, state.course_rad + math.pi, state.aims
    if surplus > margin:
        phase, course = OUTWARD, math.atan2(goal.target_y_m - motion.y_m, goal.target_x_m - motion.x_m)
    elif surplus < -margin and aims < gains.reaim_limit:
        phase, aims = AGAIN, aims + 1
    turned_back: State = aim(phase, course, motion.heading_rad, aims, state.careful)
    return turned_back


@njit(inline="always")
def _at_rest_there(state: State, motion: Motion, ahead_m: float, gains: Gains) -> bool:
    """Tell whether the robot is level with its target, and slow and straight enough to leave it at that."""
    facing = motion.heading_rad if state.direction > 0.0 else motion.heading_rad + math.pi
    return (
        abs(ahead_m) <= gains.position_tolerance_m
        and abs(motion.speed_m_s) <= 2.0 * gains.approach_per_s * gains.position_tolerance_m
        and abs(wrap_angle(state.course_rad - facing)) <= gains.heading_tolerance_rad
    )


@njit(inline="always")
def _steer(state: State, motion: Motion, ahead_m: float, to_x_m: float, to_y_m: float, gains: Gains) -> State:
    """Turn towards the line, and drive along it once roughly aligned, both on braking curves."""
    facing = motion.heading_rad if state.direction > 0.0 else motion.heading_rad + math.pi
    left_of_line = to_x_m * math.sin(state.course_rad) - to_y_m * math.cos(state.course_rad)
    # Four time constants of the steering ahead is the critically damped choice.
    lookahead = max(_LOOKAHEAD_M, 4.0 / gains.steering_per_s * abs(motion.speed_m_s))
    # Level with the target it faces along the line, whatever offset is left.
    fade = min(1.0, abs(ahead_m) / _LOOKAHEAD_M)
    error = wrap_angle(state.course_rad - math.atan(fade * left_of_line / lookahead) - facing)
    forwards, backwards = gains.forward_acceleration_m_s2, gains.backward_acceleration_m_s2
    speeding_up, braking = (forwards, backwards) if state.direction > 0.0 else (backwards, forwards)
    share = _CAREFUL if state.careful else 1.0
    speed, gain = 0.0, gains.approach_per_s
    if motion.touched != 0:
        speed = (
            -state.direction * _FREEING_SPEED_M_S if motion.touched & FRONT else state.direction * _FREEING_SPEED_M_S
        )
    if abs(error) < gains.aligned_rad:
        speed = braking_speed(ahead_m, gains.max_speed_m_s, share * braking, gain)
        gain = gains.steering_per_s
    turning = share * gains.max_turn_acceleration_rad_s2
    wanted_turn_rate = braking_speed(error, gains.max_turn_rate_rad_s, turning, gain)
    turn_rate = slew(state.turn_rate_rad_s, wanted_turn_rate, gains.max_turn_acceleration_rad_s2 * gains.period_s)
    # The turn comes first; the drive gets what is left of what one tyre can pass on.
    taken = abs(turn_rate - state.turn_rate_rad_s) * gains.track_m / 2.0
    left = max(0.0, gains.tyre_acceleration_m_s2 * gains.period_s - taken)
    slowest = state.speed_m_s - min(left, braking * gains.period_s)
    fastest = state.speed_m_s + min(left, speeding_up * gains.period_s)
    speed = min(max(speed, slowest), fastest)
    return State(state.phase, state.course_rad, state.direction, state.aims, speed, turn_rate, state.careful)


@njit(inline="always")
def _roll_along(state: State, motion: Motion, careful: bool) -> State:
    """Command the speeds that the body has, so that the wheels pass no force on to it."""
    along = state.direction * motion.speed_m_s
    return State(state.phase, state.course_rad, state.direction, state.aims, along, motion.turn_rate_rad_s, careful)


@njit(inline="always")
def _slips(state: State, motion: Motion, gains: Gains) -> bool:
    """Tell whether the body does not do as the wheels were told."""
    off = abs(motion.speed_m_s - state.direction * state.speed_m_s)
    off_turn = abs(motion.turn_rate_rad_s - state.turn_rate_rad_s)
    return (
        off > _SLIP_M_S + 2.0 * gains.backward_acceleration_m_s2 * gains.period_s
        or off_turn > _SLIP_RAD_S + 2.0 * gains.max_turn_acceleration_rad_s2 * gains.period_s
    )


@njit(inline="always")
def _careful(gains: Gains) -> Gains:
    """Return the gains of a robot that has slipped."""
    return Gains(
        gains.period_s,
        gains.wheel_radius_m,
        gains.track_m,
        gains.front_reach_m,
        gains.rear_reach_m,
        gains.top_rim_speed_m_s,
        min(_CAREFUL_SPEED_M_S, gains.max_speed_m_s),
        gains.forward_acceleration_m_s2,
        gains.backward_acceleration_m_s2,
        min(2.0 * _CAREFUL_SPEED_M_S / gains.track_m, gains.max_turn_rate_rad_s),
        gains.max_turn_acceleration_rad_s2,
        3.0 * gains.position_tolerance_m,
        3.0 * gains.heading_tolerance_rad,
        gains.approach_per_s,
        gains.steering_per_s,
        gains.aligned_rad,
        gains.tyre_acceleration_m_s2,
        gains.reaim_distance_m,
        gains.reaim_limit,
    )
