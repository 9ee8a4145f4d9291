"""Slippery ground and pushes: how slip is detected, how the robot drives after that, and how it does not tip over."""

from __future__ import annotations

from typing import Final

from scla_mj.compiled import leaf_njit
from scla_mj.control.motion import Gains, Motion, State

_SLIP_M_S: Final = 0.10
_SLIP_RAD_S: Final = 0.7
"""Slip is detected when the body's speed differs from the commanded one by more than this plus the change over two
periods. Unperturbed, the difference stays below half of that."""
_CAREFUL_SPEED_M_S: Final = 0.15
CAREFUL_SHARE: Final = 0.3
"""After slip it drives with this share of its accelerations, lower speeds and wider tolerances."""


@leaf_njit(inline="always")
def roll_along(state: State, motion: Motion, careful: bool) -> State:
    """Command the speeds that the body has, so that the wheels exert no force on it."""
    along = state.direction * motion.speed_m_s
    return State(state.phase, state.course_rad, state.direction, state.aims, along, motion.turn_rate_rad_s, careful)


@leaf_njit(inline="always")
def balance(state: State, motion: Motion, gains: Gains) -> State:
    """Let the wheels roll along, and drive them under the side that the robot tips over to."""
    rolling = roll_along(state, motion, state.careful)
    under = gains.balance_m_s * motion.pitch_sine + gains.balance_m * motion.pitch_rate_rad_s
    along = rolling.speed_m_s + state.direction * under
    return State(
        state.phase, state.course_rad, state.direction, state.aims, along, rolling.turn_rate_rad_s, state.careful
    )


@leaf_njit(inline="always")
def slips(state: State, motion: Motion, gains: Gains) -> bool:
    """Return whether the body does not move as the wheels were commanded."""
    off = abs(motion.speed_m_s - state.direction * state.speed_m_s)
    off_turn = abs(motion.turn_rate_rad_s - state.turn_rate_rad_s)
    return (
        off > _SLIP_M_S + 2.0 * gains.backward_acceleration_m_s2 * gains.period_s
        or off_turn > _SLIP_RAD_S + 2.0 * gains.max_turn_acceleration_rad_s2 * gains.period_s
    )


@leaf_njit(inline="always")
def careful_gains(gains: Gains) -> Gains:
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
        gains.lookahead_m,
        gains.touch_margin_m,
        gains.balance_m_s,
        gains.balance_m,
    )
