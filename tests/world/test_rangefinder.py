"""Rays in the physics agree with the map that the robot knows."""

import math

import mujoco
import numpy as np
import pytest

from scla_mj.clock import resolve_clock
from scla_mj.config import ClockConfig
from scla_mj.grid import Cell, Grid
from scla_mj.sense.ranging import MAX_RANGE_M, expected_range, make_map, ray_angles
from scla_mj.world.rangefinder import ranges_m
from scla_mj.world.world import World

CLOCK = resolve_clock(ClockConfig())


@pytest.mark.parametrize("closed", [frozenset(), frozenset({Cell(4, 3), Cell(2, 4), Cell(1, 2)})])
def test_the_physics_rays_go_as_far_as_the_known_map_says(closed):
    grid = Grid((5, 5), Cell(3, 3), 0.30, closed)
    world, floor, rng = World(grid, CLOCK), make_map(grid), np.random.default_rng(0)
    for cell in grid.open_cells():
        world.spawn(cell, rng.uniform(-math.pi, math.pi))
        world.data.qpos[:2] += rng.uniform(-0.05, 0.05, 2)
        mujoco.mj_forward(world.model, world.data)
        pose, found = world.pose(), ranges_m(world, ray_angles(), reach_m=MAX_RANGE_M)
        expected = [expected_range(floor, pose.x_m, pose.y_m, pose.heading_rad + angle)[0] for angle in ray_angles()]
        assert np.abs(found - expected).max() < 2e-3  # a robot at rest leans back by a fifth of a degree


def test_what_is_out_of_reach_gives_no_echo():
    world = World(Grid((50, 3), Cell(3, 2), 0.30), CLOCK)
    world.spawn(Cell(25, 2), 0.0)
    found = ranges_m(world, ray_angles(), reach_m=MAX_RANGE_M)
    assert np.isinf(found[[0, 4]]).all()
    assert found[[2, 6]] == pytest.approx(0.45)
    assert np.isfinite(found[[1, 3, 5, 7]]).all()


def test_a_leaning_robot_measures_along_its_own_plane():
    world = World(Grid((5, 5), Cell(3, 3), 0.30), CLOCK)
    world.spawn(Cell(3, 3), 0.0)
    lean = math.radians(3.0)
    world.data.qpos[3:7] = math.cos(lean / 2), 0.0, math.sin(lean / 2), 0.0
    mujoco.mj_forward(world.model, world.data)
    ahead = ranges_m(world, ray_angles(), reach_m=MAX_RANGE_M)[0]
    offset = 0.035 * math.sin(lean)
    assert ahead == pytest.approx((0.75 - offset) / math.cos(lean), abs=1e-4)
