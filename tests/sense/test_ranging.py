"""Ranges against geometry done by hand, and poses found again from them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scla_mj.grid import Cell, Grid
from scla_mj.sense.ranging import (
    MAX_RANGE_M,
    RANGE_NOISE_M,
    RAYS,
    corrected_pose,
    expected_range,
    located_pose,
    make_map,
    ray_angles,
)

OPEN = make_map(Grid((5, 5), Cell(3, 3), 0.30))
CLOSED = make_map(Grid((5, 5), Cell(3, 3), 0.30, frozenset({Cell(4, 3), Cell(2, 4)})))


def ranges(floor, x, y, heading):
    found = np.array([expected_range(floor, x, y, heading + angle)[0] for angle in ray_angles()])
    return np.where(found <= MAX_RANGE_M, found, math.inf)


@pytest.mark.parametrize(
    ("floor", "x", "y", "angle", "expected", "normal"),
    [
        (OPEN, 0.0, 0.0, 0.0, 0.75, (-1, 0)),
        (OPEN, 0.25, 0.0, math.pi, 1.00, (1, 0)),
        (OPEN, 0.0, 0.10, math.pi / 2, 0.65, (0, -1)),
        (OPEN, 0.0, 0.0, -math.pi / 3, 0.75 / math.sin(math.pi / 3), (0, 1)),
        (CLOSED, 0.0, 0.0, 0.0, 0.15, (-1, 0)),
        (CLOSED, 0.60, 0.0, math.pi, 0.15, (1, 0)),
        (CLOSED, -0.30, 0.0, math.pi / 2, 0.15, (0, -1)),
        (CLOSED, 0.0, 0.0, math.atan2(0.30, 0.30) + 0.5, 0.75 / math.sin(math.pi / 4 + 0.5), (0, -1)),
        (CLOSED, 0.0, 0.20, 0.0, 0.75, (-1, 0)),
    ],
)
def test_a_ray_goes_as_far_as_geometry_says(floor, x, y, angle, expected, normal):
    length, *faces = expected_range(floor, x, y, angle)
    assert length == pytest.approx(expected)
    assert faces == list(normal)


@settings(deadline=None, max_examples=200, derandomize=True)
@given(
    x=st.floats(-0.6, 0.6),
    y=st.floats(-0.6, 0.6),
    heading=st.floats(-math.pi, math.pi),
    off=st.tuples(st.floats(-0.06, 0.06), st.floats(-0.06, 0.06), st.floats(-0.02, 0.02)),
)
def test_a_pose_is_found_again_from_ranges_without_noise(x, y, heading, off):
    believed = np.array([x, y, heading]) + off
    found = corrected_pose(OPEN, believed, ray_angles(), ranges(OPEN, x, y, heading))
    assert np.hypot(*(found - (x, y, heading))[:2]) < 0.03  # less than half of the furthest that it was off


@pytest.mark.parametrize("floor", [OPEN, CLOSED])
def test_a_pose_is_found_again_within_the_ranges_noise(floor):
    """Eight ranges of noise s give each coordinate to about s / 2; the map's corners cost a little."""
    rng, errors, turns = np.random.default_rng(0), [], []
    for _ in range(400):
        true = np.array([0.3 * rng.integers(-2, 1), 0.3 * rng.integers(-2, 1), 0.5 * math.pi * rng.integers(4)])
        true += rng.normal(0.0, 0.02, 3)
        believed = true + rng.normal(0.0, [0.03, 0.03, 0.01])
        measured = ranges(floor, *true) + rng.normal(0.0, RANGE_NOISE_M, RAYS)
        found = corrected_pose(floor, believed, ray_angles(), measured)
        errors.append(np.hypot(*(found - true)[:2]))
        turns.append(abs(found[2] - true[2]))
    assert np.mean(errors) < RANGE_NOISE_M
    assert np.quantile(errors, 0.99) < 4 * RANGE_NOISE_M
    assert math.degrees(np.mean(turns)) < 1.5


def test_without_an_echo_the_believed_pose_stays():
    believed = np.array([0.1, -0.2, 0.3])
    assert (corrected_pose(OPEN, believed, ray_angles(), np.full(RAYS, math.inf)) == believed).all()


def test_one_ray_that_meets_something_unknown_does_not_lead_astray():
    measured = ranges(OPEN, 0.1, 0.0, 0.0)
    measured[3] = 0.10
    found = corrected_pose(OPEN, np.array([0.12, -0.02, 0.01]), ray_angles(), measured)
    assert np.hypot(found[0] - 0.1, found[1]) < 0.02


def test_far_from_every_wall_the_rays_that_reach_one_still_count():
    floor = make_map(Grid((50, 50), Cell(3, 3), 0.30))
    measured = ranges(floor, -6.0, 0.0, 0.0)
    assert np.isfinite(measured).sum() == 3
    found = corrected_pose(floor, np.array([-6.05, 0.03, 0.0]), ray_angles(), measured)
    assert found[0] == pytest.approx(-6.0, abs=0.01)


@pytest.mark.parametrize("floor", [OPEN, CLOSED])
def test_a_robot_that_slid_away_from_where_it_believes_to_be_finds_itself_again(floor):
    rng, errors = np.random.default_rng(1), []
    for _ in range(100):
        true = np.array([-0.6 + 0.3 * rng.integers(3), -0.6 + 0.3 * rng.integers(3), 0.5 * math.pi * rng.integers(4)])
        true[:2] += rng.normal(0.0, 0.02, 2)
        believed = true + np.array([*rng.uniform(-0.3, 0.3, 2), rng.normal(0.0, 0.01)])
        found = located_pose(floor, believed, ray_angles(), ranges(floor, *true) + rng.normal(0.0, RANGE_NOISE_M, RAYS))
        errors.append(np.hypot(*(found - true)[:2]))
    assert np.mean(np.array(errors) < 0.04) > 0.95
