"""Dead reckoning against closed forms, and its calibration against the physics."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest
from numba import njit

from scla_mj.clock import resolve_clock
from scla_mj.config import ClockConfig
from scla_mj.grid import Cell, Grid
from scla_mj.sense.odometry import (
    ENCODER_COUNTS,
    GYRO_BIAS_DEG_S,
    GYRO_NOISE_DEG_SQRT_S,
    advance,
    make_odometer,
    place,
)
from scla_mj.world.world import World

PERIOD_S, RADIUS_M = 0.01, 0.033
ROLLING_M = 0.988 * RADIUS_M


@njit
def compiled_advance(odometer, left, right, turned):
    advance(odometer, left, right, turned)


@njit
def compiled_standstill(odometer, periods):
    for _ in range(periods):
        advance(odometer, 0.0, 0.0, 0.0)


def make(seed=0, *, silent=True, x=0.0, y=0.0, heading=0.0):
    odometer = make_odometer(rolling_radius_m=ROLLING_M, period_s=PERIOD_S, rng=np.random.default_rng(seed))
    if silent:
        odometer.gyro_bias_rad_s[0] = 0.0
        odometer = odometer._replace(gyro_noise_rad=0.0)
    place(odometer, x, y, heading, np.zeros(2))
    return odometer


def test_a_straight_drive_is_the_wheels_turn_times_their_rolling_radius():
    odometer = make(x=1.0, y=2.0, heading=math.pi / 3)
    for i in range(1, 101):
        compiled_advance(odometer, 0.2 * i, 0.2 * i, 0.0)
    moved = odometer.estimate[:2] - (1.0, 2.0)
    count_m = ROLLING_M * math.tau / ENCODER_COUNTS
    assert np.hypot(*moved) == pytest.approx(20.0 * ROLLING_M, abs=count_m)
    assert math.atan2(moved[1], moved[0]) == pytest.approx(math.pi / 3)
    assert odometer.estimate[3] == pytest.approx(0.2 * ROLLING_M / PERIOD_S, abs=count_m / PERIOD_S)


def test_a_circle_closes():
    odometer, track = make(), 0.160
    left, right, turned = 0.0, 0.0, math.tau / 500
    for _ in range(500):
        left += (1.0 - track / 2) * turned / ROLLING_M
        right += (1.0 + track / 2) * turned / ROLLING_M
        compiled_advance(odometer, left, right, turned)
    assert odometer.estimate[:3] == pytest.approx([0.0, 0.0, math.tau], abs=2e-4)


def test_half_a_circle_is_its_diameter_away():
    odometer, turned, wheel = make(), math.pi / 500, 0.0
    for _ in range(500):
        wheel += turned / ROLLING_M
        compiled_advance(odometer, wheel, wheel, turned)
    assert odometer.estimate[:3] == pytest.approx([0.0, 2.0, math.pi], abs=2e-3)


def test_the_gyros_bias_adds_up_linearly_and_its_noise_as_a_random_walk():
    ends, periods = [], 1000
    for seed in range(300):
        odometer = make(seed, silent=False)
        compiled_standstill(odometer, periods)
        seconds = periods * PERIOD_S
        ends.append((odometer.estimate[2] - odometer.gyro_bias_rad_s[0] * seconds, odometer.gyro_bias_rad_s[0]))
    walk, bias = np.degrees(np.array(ends)).T
    assert walk.std() == pytest.approx(GYRO_NOISE_DEG_SQRT_S * math.sqrt(10.0), rel=0.15)
    assert abs(walk.mean()) < 0.3 * walk.std()
    assert bias.std() == pytest.approx(GYRO_BIAS_DEG_S, rel=0.15)


def test_an_encoder_counts_whole_steps():
    odometer, step = make(), math.tau / ENCODER_COUNTS
    for angle in (0.4 * step, 0.9 * step):
        compiled_advance(odometer, angle, angle, 0.0)
        assert odometer.estimate[0] == 0.0
    compiled_advance(odometer, 1.1 * step, 1.1 * step, 0.0)
    assert odometer.estimate[0] == pytest.approx(step * ROLLING_M)


def test_the_calibration_drive_measures_the_rolling_radius():
    """Three metres over the floor at the wheels' usual speeds, as one calibrates a real robot."""
    clock = resolve_clock(ClockConfig())
    world = World(Grid((40, 3), Cell(3, 3), 0.30), clock)
    measured = []
    for speed_rad_s in (4.0, 8.0, 12.0):
        world.spawn(Cell(5, 2), 0.0)
        world.data.ctrl[:] = speed_rad_s
        mujoco.mj_step(world.model, world.data, nstep=100)
        x, wheel = world.data.qpos[0], world.data.qpos[7]
        mujoco.mj_step(world.model, world.data, nstep=round(3.0 / (speed_rad_s * RADIUS_M * clock.physics_step_s)))
        measured.append((world.data.qpos[0] - x) / (world.data.qpos[7] - wheel) / RADIUS_M)
    assert measured == pytest.approx([0.988] * 3, abs=0.003)
