"""The controller on an exact kinematic unicycle, with no physics at all."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scla_mj.config import ControllerConfig
from scla_mj.control.controller import begin, tick
from scla_mj.control.motion import (
    AGAIN,
    ARRIVED,
    BACK,
    DRIVING,
    FRONT,
    OUTWARD,
    REAR,
    RETURNED,
    STAND_STILL,
    Goal,
    Motion,
    make_gains,
)
from scla_mj.control.profile import braking_speed, slew, wrap_angle
from scla_mj.dimensions import Dimensions

PERIOD_S, RADIUS_M, TRACK_M = 0.01, 0.033, 0.160
BURGER = Dimensions(
    wheel_radius_m=RADIUS_M,
    track_m=TRACK_M,
    front_reach_m=0.066,
    rear_reach_m=0.112,
    top_wheel_speed_rad_s=25.0,
    turning_radius_m=0.132,
    mass_kg=1.0,
    com_behind_m=0.029,
    com_height_m=0.087,
    caster_behind_m=0.081,
    caster_ahead_m=0.0,
    yaw_inertia_kg_m2=0.0042,
    friction=1.0,
    motor_torque_n_m=0.08,
    torque_reach_rad_s=2.67,
)
GAINS = make_gains(ControllerConfig(), BURGER, period_s=PERIOD_S, cell_size_m=0.30)
GOAL = Goal(0.0, 0.0, 0.30, 0.0)


def unicycle(goal, x, y, heading, wall_at=math.inf, periods=1000):
    """Drive an ideal unicycle, exactly integrated; a wall stops it at |x| = wall_at. Returns its path."""
    state, speed, turn_rate, touched, path = begin(goal, heading), 0.0, 0.0, False, []
    for _ in range(periods):
        motion = Motion(x, y, heading, speed, turn_rate, touched)
        state, left, right, status = tick(state, motion, goal, GAINS)
        path.append((x, y, heading, left, right, status))
        if status != DRIVING:
            return path
        speed, turn_rate = RADIUS_M * (left + right) / 2, RADIUS_M * (right - left) / TRACK_M
        turned = turn_rate * PERIOD_S
        chord = speed * PERIOD_S * (math.sin(turned / 2) / (turned / 2) if turned else 1.0)
        x_new = x + chord * math.cos(heading + turned / 2)
        touched = abs(x_new) > wall_at
        x = math.copysign(min(abs(x_new), wall_at), x_new)
        y += chord * math.sin(heading + turned / 2)
        heading += turned
    return path


@pytest.mark.parametrize("heading", [0.0, math.pi / 2, math.pi, -math.pi / 2])
def test_it_arrives_from_every_held_heading(heading):
    x, y, facing, *_, status = unicycle(GOAL, 0.0, 0.0, heading)[-1]
    assert status == ARRIVED
    assert math.hypot(x - 0.30, y) <= 0.003
    assert math.remainder(facing, math.pi) == pytest.approx(0.0, abs=0.02)


def test_it_reverses_rather_than_turn_round():
    path = unicycle(GOAL, 0.0, 0.0, math.pi)
    assert all(
        math.remainder(heading - math.pi, math.tau) == pytest.approx(0.0, abs=1e-9) for _, _, heading, *_ in path
    )
    assert min(left for *_, left, _, _ in path) < -10


@settings(deadline=None, max_examples=60)
@given(x=st.floats(-0.05, 0.05), y=st.floats(-0.05, 0.05), heading=st.floats(-math.pi, math.pi))
def test_it_arrives_from_wherever_it_was_left(x, y, heading):
    end_x, end_y, *_, status = unicycle(GOAL, x, y, heading)[-1]
    assert status == ARRIVED
    assert math.hypot(end_x - 0.30, end_y) <= GAINS.reaim_distance_m


def test_it_aims_again_where_steering_alone_cannot_help():
    end_x, end_y, *_, status = unicycle(GOAL, 0.29, 0.05, 0.0)[-1]
    assert status == ARRIVED
    assert math.hypot(end_x - 0.30, end_y) <= GAINS.reaim_distance_m


def test_a_wall_sends_it_back_to_where_it_came_from():
    path = unicycle(GOAL, 0.001, -0.001, 0.0, wall_at=0.08)
    x, y, *_, status = path[-1]
    assert status == RETURNED
    assert math.hypot(x, y) <= 0.003
    assert max(point[0] for point in path) == pytest.approx(0.08)


def test_speed_and_acceleration_stay_within_their_limits():
    for heading in (0.0, math.pi / 2, math.pi):
        path = unicycle(GOAL, 0.0, 0.0, heading)
        rims = [(RADIUS_M * left, RADIUS_M * right) for *_, left, right, status in path if status == DRIVING]
        drive = [(left + right) / 2 for left, right in rims]
        turn = [(right - left) / TRACK_M for left, right in rims]
        assert max(map(abs, drive)) <= 0.8 + 1e-9
        assert max(map(abs, turn)) <= 8.0 + 1e-9
        rates = [(after - before) / PERIOD_S for before, after in zip([0.0, *drive], drive, strict=False)]
        assert max(rates) <= 2.2 + 1e-6
        assert min(rates) >= -2.6 - 1e-6


def test_a_straight_move_takes_about_the_time_of_its_trapezoid():
    # 2.2 up and 2.6 down over 0.30 m: the triangle's top, 0.85 m/s, is cut at 0.8.
    up, down, top = 2.2, 2.6, 0.8
    ideal_s = top / up + top / down + (0.30 - top**2 / 2 * (1 / up + 1 / down)) / top
    assert len(unicycle(GOAL, 0.0, 0.0, 0.0)) * PERIOD_S == pytest.approx(ideal_s, rel=0.08)


def test_a_standing_robot_is_commanded_to_rest():
    state, left, right, status = tick(STAND_STILL, Motion(1.0, 2.0, 3.0, 0.1, 0.1, True), GOAL, GAINS)
    assert (state, left, right, status) == (STAND_STILL, 0.0, 0.0, DRIVING)


@pytest.mark.parametrize("field", ["x_m", "y_m", "heading_rad", "speed_m_s", "turn_rate_rad_s"])
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_pose_that_is_not_finite_comes_out_in_the_commands(field, value):
    motion = Motion(0.0, 0.0, 0.0, 0.0, 0.0, False)._replace(**{field: value})
    _, left, right, status = tick(begin(GOAL, 0.0), motion, GOAL, GAINS)
    assert status == DRIVING
    assert not (math.isfinite(left) and math.isfinite(right))


def test_the_braking_curve_is_that_of_constant_deceleration():
    # v^2 = 2 a d, less the softening a / rate, from any distance at which the top speed does not cap it.
    for distance in (0.05, 0.2, 1.0):
        speed = braking_speed(distance, 100.0, 2.0, 1e6)
        assert speed == pytest.approx(math.sqrt(2 * 2.0 * distance), rel=1e-4)
    assert braking_speed(-0.2, 100.0, 2.0, 1e6) == -braking_speed(0.2, 100.0, 2.0, 1e6)
    assert braking_speed(1e-6, 100.0, 2.0, 40.0) == pytest.approx(40.0e-6, rel=1e-3)
    assert braking_speed(9.0, 0.8, 2.0, 40.0) == 0.8


def test_angles_wrap_and_speeds_slew():
    assert wrap_angle(3 * math.pi / 2) == pytest.approx(-math.pi / 2)
    assert (slew(1.0, 2.0, 0.25), slew(1.0, 1.1, 0.25), slew(1.0, -2.0, 0.25)) == (1.25, 1.1, 0.75)


def at(x, y=0.0, heading=0.0, speed=0.0, touched=0, upright=1.0):
    return Motion(x, y, heading, speed, 0.0, touched, upright)


def test_a_wall_is_taken_for_one_in_the_way_only_where_it_can_be():
    """The front bumper reaches 0.066 m ahead, so the wall between the cells is touched 0.084 m from the start."""
    state = begin(GOAL, 0.0)
    assert tick(state, at(0.085, touched=FRONT), GOAL, GAINS)[0].phase == BACK
    assert tick(state, at(0.29, touched=FRONT), GOAL, GAINS)[0].phase == OUTWARD
    assert tick(state, at(0.01, touched=FRONT), GOAL, GAINS)[0].phase == AGAIN
    assert tick(state, at(0.085, touched=REAR), GOAL, GAINS)[0].phase == OUTWARD
    assert tick(state, at(0.085, heading=0.6, touched=FRONT), GOAL, GAINS)[0].phase == OUTWARD


@pytest.mark.parametrize(("touched", "backs_off"), [(FRONT, -1), (REAR, 1)])
def test_a_bumper_that_brushes_a_wall_in_a_turn_is_driven_away_from_it(touched, backs_off):
    def drives(bits):
        state = begin(GOAL, math.pi / 2)
        for _ in range(40):
            state, left, right, _ = tick(state, at(0.0, heading=math.pi / 2, touched=bits), GOAL, GAINS)
        return RADIUS_M * (left + right) / 2

    assert drives(touched) == pytest.approx(0.1 * backs_off)
    assert drives(0) == 0.0


def test_a_robot_about_to_tip_lets_its_wheels_roll_along():
    state = begin(GOAL, 0.0)._replace(speed_m_s=0.6)
    _, left, right, _ = tick(state, at(0.1, speed=0.55, upright=math.cos(math.radians(8))), GOAL, GAINS)
    assert (left, right) == (pytest.approx(0.55 / RADIUS_M), pytest.approx(0.55 / RADIUS_M))


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize(("pitch_deg", "rate", "sign"), [(8, 0.0, 1), (-8, 0.0, -1), (8, 2.0, 1), (8, -4.0, -1)])
def test_a_robot_that_tips_over_drives_its_wheels_under_the_lean(direction, pitch_deg, rate, sign):
    """Forwards where it falls forwards, whichever way it travels, and the other way where it comes back too fast."""
    pitch = math.radians(pitch_deg)
    leaning = at(0.1, speed=0.2, upright=math.cos(pitch))
    leaning = leaning._replace(pitch_sine=math.sin(pitch), pitch_rate_rad_s=rate)
    for state in (STAND_STILL, begin(GOAL, 0.0)._replace(direction=direction, speed_m_s=0.2)):
        _, left, right, _ = tick(state, leaning, GOAL, GAINS)
        assert (RADIUS_M * left - 0.2) * sign > 0.01
        assert (RADIUS_M * right - 0.2) * sign > 0.01


def test_a_robot_that_slips_is_careful_for_the_rest_of_the_move():
    state, *_ = tick(begin(GOAL, 0.0)._replace(speed_m_s=0.6), at(0.1, speed=0.2), GOAL, GAINS)
    assert state.careful
    for _ in range(200):
        state, left, right, _ = tick(state, at(0.1, speed=0.15), GOAL, GAINS)
    assert RADIUS_M * (left + right) / 2 <= 0.15 + 1e-9
    calm, *_ = tick(begin(GOAL, 0.0)._replace(speed_m_s=0.6), at(0.1, speed=0.55), GOAL, GAINS)
    assert not calm.careful


def test_far_beyond_its_target_it_aims_again_and_turns_back():
    state, *_ = tick(begin(GOAL, 0.0), at(0.45, 0.05, speed=0.3), GOAL, GAINS)
    assert math.cos(state.course_rad - math.atan2(-0.05, -0.15)) == pytest.approx(1.0)
