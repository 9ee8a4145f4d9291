"""One move as a feedback law: face the line to the next cell's centre, drive along it, come back if the bumper touches.

The robot holds its heading: it drives in reverse where that saves half a turn, and does not turn at all for a move on
the axis it already stands on. It aims at the cells' absolute centres, so that errors of moves do not add up. All
functions are pure and compiled with numba; `tick` is one control period.
"""

from __future__ import annotations

import math
from typing import Final

from scla_mj.compiled import leaf_njit
from scla_mj.control.caution import CAREFUL_SHARE, balance, careful_gains, roll_along, slips
from scla_mj.control.motion import (
    AGAIN,
    ARRIVED,
    BACK,
    DRIVING,
    FRONT,
    OUTWARD,
    REAR,
    RETURNED,
    STANDING,
    Gains,
    Goal,
    Motion,
    State,
)
from scla_mj.control.profile import braking_speed, slew, wrap_angle

_REVERSE_COSINE: Final = -0.7071
"""It drives in reverse where its course lies more than 135 degrees off its heading."""
_FREEING_SPEED_M_S: Final = 0.1
"""How fast it backs off from a wall that its bumper brushes while it turns."""
_TIPPING_COSINE: Final = 0.995
"""Leaning by more than 6 degrees it is about to tip: it balances until it is down again. Its own accelerations lean it
by less than 2 degrees."""


@leaf_njit(inline="always")
def begin(goal: Goal, heading_rad: float, careful: bool = False) -> State:
    """Return the state at the start of a move: outward bound, in reverse if the target lies behind."""
    course = math.atan2(goal.target_y_m - goal.start_y_m, goal.target_x_m - goal.start_x_m)
    state: State = aim(OUTWARD, course, heading_rad, 0, careful)
    return state


@leaf_njit()
def aim(phase: int, course_rad: float, heading_rad: float, aims: int, careful: bool) -> State:
    """Return the state of a robot at rest that is to travel along a course, backwards if it faces away from it."""
    direction = -1.0 if math.cos(course_rad - heading_rad) < _REVERSE_COSINE else 1.0
    return State(phase, course_rad, direction, aims, 0.0, 0.0, careful)


@leaf_njit(from_python=True)
def tick(state: State, motion: Motion, goal: Goal, gains: Gains) -> tuple[State, float, float, int]:
    """Run one control period.

    Returns:
        The new state, the left and the right wheel's speed command in rad/s, and DRIVING, ARRIVED or RETURNED. The
        commands are not numbers if the motion is not finite (limits would swallow that): the caller checks them.
    """
    if not math.isfinite(motion.x_m + motion.y_m + motion.heading_rad + motion.speed_m_s + motion.turn_rate_rad_s):
        return state, math.nan, math.nan, DRIVING
    if state.phase == STANDING:
        if motion.upright >= _TIPPING_COSINE:
            return state, 0.0, 0.0, DRIVING
        left, right = _wheel_speeds(balance(state, motion, gains), gains)
        return state, left, right, DRIVING
    if state.phase == OUTWARD and motion.touched:
        state = _touch(state, motion, goal, gains)
    elif state.phase == OUTWARD and not state.careful and motion.touched == 0 and slips(state, motion, gains):
        state = roll_along(state, motion, True)
    if state.careful:
        gains = careful_gains(gains)
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
        state = roll_along(state, motion, state.careful)
        ahead = math.hypot(to_x, to_y)
    state = _steer(state, motion, ahead, to_x, to_y, gains)
    if motion.upright < _TIPPING_COSINE:
        state = balance(state, motion, gains)
    left, right = _wheel_speeds(state, gains)
    return state, left, right, DRIVING


@leaf_njit(inline="always")
def _wheel_speeds(state: State, gains: Gains) -> tuple[float, float]:
    """Return the left and the right wheel's speed; where the motors are too slow for both, the turn comes first."""
    spread = state.turn_rate_rad_s * gains.track_m / 2.0
    room = max(0.0, gains.top_rim_speed_m_s - abs(spread))
    drive = state.direction * min(max(state.speed_m_s, -room), room)
    return (drive - spread) / gains.wheel_radius_m, (drive + spread) / gains.wheel_radius_m


@leaf_njit(inline="always")
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
    margin = gains.touch_margin_m + gains.max_speed_m_s * gains.period_s
    phase, course, aims = BACK, state.course_rad + math.pi, state.aims
    if surplus > margin:
        phase, course = OUTWARD, math.atan2(goal.target_y_m - motion.y_m, goal.target_x_m - motion.x_m)
    elif surplus < -margin and aims < gains.reaim_limit:
        phase, aims = AGAIN, aims + 1
    turned_back: State = aim(phase, course, motion.heading_rad, aims, state.careful)
    return turned_back


@leaf_njit(inline="always")
def _at_rest_there(state: State, motion: Motion, ahead_m: float, gains: Gains) -> bool:
    """Return whether the robot is level with its target, and slow and straight enough to leave it at that."""
    facing = motion.heading_rad if state.direction > 0.0 else motion.heading_rad + math.pi
    return (
        abs(ahead_m) <= gains.position_tolerance_m
        and abs(motion.speed_m_s) <= 2.0 * gains.approach_per_s * gains.position_tolerance_m
        and abs(wrap_angle(state.course_rad - facing)) <= gains.heading_tolerance_rad
    )


@leaf_njit(inline="always")
def _steer(state: State, motion: Motion, ahead_m: float, to_x_m: float, to_y_m: float, gains: Gains) -> State:
    """Turn towards the line, and drive along it once roughly aligned, both on braking curves."""
    facing = motion.heading_rad if state.direction > 0.0 else motion.heading_rad + math.pi
    left_of_line = to_x_m * math.sin(state.course_rad) - to_y_m * math.cos(state.course_rad)
    # Four time constants of the steering ahead is the critically damped choice.
    lookahead = max(gains.lookahead_m, 4.0 / gains.steering_per_s * abs(motion.speed_m_s))
    # Level with the target it faces along the line, whatever offset is left.
    fade = min(1.0, abs(ahead_m) / gains.lookahead_m)
    error = wrap_angle(state.course_rad - math.atan(fade * left_of_line / lookahead) - facing)
    forwards, backwards = gains.forward_acceleration_m_s2, gains.backward_acceleration_m_s2
    speeding_up, braking = (forwards, backwards) if state.direction > 0.0 else (backwards, forwards)
    share = CAREFUL_SHARE if state.careful else 1.0
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
