"""The robot's physics against closed forms, and the world's faults."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from scla_mj.clock import resolve_clock
from scla_mj.config import ClockConfig
from scla_mj.errors import SclaError
from scla_mj.grid import Cell, Grid
from scla_mj.world.robot import BURGER, PREFIX
from scla_mj.world.world import World

CLOCK = resolve_clock(ClockConfig())


def make_world(cells=(5, 5), clock=CLOCK):
    return World(Grid(cells, Cell(3, 3), 0.30), clock)


def roll(world, left, right, steps):
    """Command the wheels for some steps, and return the speeds and the sensors, one row per step each."""
    world.data.ctrl[:] = left, right
    speeds, sensed = [], []
    for _ in range(steps):
        mujoco.mj_step(world.model, world.data)
        world.steps += 1
        speeds.append(world.data.qvel.copy())
        sensed.append(world.data.sensordata.copy())
    return np.array(speeds), np.array(sensed)


def wheels(world):
    """The joints of the left and the right wheel, as MuJoCo names their parts."""
    return [world.data.joint(PREFIX + joint) for joint in BURGER.wheel_joints]


def test_a_spawned_robot_rests_where_it_was_put():
    world = make_world()
    world.spawn(Cell(2, 5), 1.0)
    before = world.data.qpos.copy()
    assert world.pose()[:3] == pytest.approx((-0.30, 0.60, 1.0), abs=1e-12)
    highest = max(abs(world.data.qvel).max() for _ in range(50) if roll(world, 0, 0, 1) is not None)
    assert highest < 1e-4
    assert world.data.qpos == pytest.approx(before, abs=1e-5)
    world.spawn(Cell(2, 5), 1.0)
    assert world.data.time == 0.0
    assert world.steps == 0


def test_a_closed_cell_at_the_floors_centre_does_not_change_how_the_robot_stands():
    open_floor = World(Grid((3, 3), Cell(3, 3), 0.30), CLOCK)
    closed = World(Grid((3, 3), Cell(3, 3), 0.30, frozenset({Cell(2, 2)})), CLOCK)
    for world in (open_floor, closed):
        world.spawn(Cell(1, 1), 0.5)
    assert (closed.data.qpos == open_floor.data.qpos).all()
    roll(closed, 0, 0, 50)
    assert np.abs(closed.data.qvel).max() < 1e-4


def test_the_floor_carries_exactly_the_weight():
    world = make_world()
    world.spawn(Cell(3, 3), 0.3)
    roll(world, 0, 0, 50)
    force, total = np.zeros(6), 0.0
    for i in range(world.data.ncon):
        mujoco.mj_contactForce(world.model, world.data, i, force)
        total += force[0]
    assert total == pytest.approx(world.model.body_mass.sum() * 9.81, rel=1e-6)


def test_a_spawn_off_the_floor_or_in_a_closed_cell_is_refused():
    world = World(Grid((3, 3), Cell(3, 3), 0.30, frozenset({Cell(2, 2)})), CLOCK)
    for cell in (Cell(0, 1), Cell(2, 2)):
        with pytest.raises(SclaError, match="choose an open cell"):
            world.spawn(cell, 0.0)


def test_unequal_wheels_drive_the_circle_of_the_closed_form():
    world = make_world((20, 20))
    world.spawn(Cell(10, 10), 0.0)
    roll(world, 5.0, 7.0, 100)
    points = []
    for _ in range(1000):
        roll(world, 5.0, 7.0, 1)
        points.append(world.pose()[:2])
    x, y = np.array(points).T
    solution, *_ = np.linalg.lstsq(np.column_stack([2 * x, 2 * y, np.ones_like(x)]), x**2 + y**2, rcond=None)
    radius = math.sqrt(solution[2] + solution[0] ** 2 + solution[1] ** 2)
    left, right = (float(wheel.qvel[0]) for wheel in wheels(world))
    assert radius == pytest.approx(0.160 / 2 * (right + left) / (right - left), rel=0.003)


def test_a_wheels_turn_times_its_radius_is_the_distance():
    world = make_world((20, 20))
    world.spawn(Cell(3, 10), 0.0)
    start = world.pose().x_m
    roll(world, 6.0, 6.0, 500)
    turned, right_turned = world.wheel_angles_rad()
    # A loaded tyre rolls on a slightly smaller radius (1.2 % here, from the contact's compliance).
    assert turned * 0.033 == pytest.approx(world.pose().x_m - start, rel=0.02)
    assert turned == pytest.approx(right_turned, rel=1e-6)
    assert wheels(world)[0].qvel[0] == pytest.approx(6.0, rel=1e-3)


def test_the_turn_rate_adds_up_to_the_yaw():
    """What odometry integrates as its gyro: after each step, as the step moves the robot by its new speeds."""
    world = make_world()
    world.spawn(Cell(3, 3), 0.0)
    speeds, _ = roll(world, -4.0, 4.0, 80)
    yaw = speeds[:, world.at.root_dof + 5].sum() * CLOCK.physics_step_s
    assert yaw == pytest.approx(world.pose().heading_rad, abs=0.002)
    assert abs(yaw) > 0.5


def test_wheels_at_rest_bring_a_rolling_robot_to_a_stop():
    world = make_world()
    world.spawn(Cell(3, 3), 0.0)
    roll(world, 8.0, 8.0, 30)
    assert world.data.qvel[0] > 0.2
    roll(world, 0.0, 0.0, 100)
    assert np.abs(world.data.qvel).max() < 1e-3


@pytest.mark.parametrize(("heading", "speed", "bumper"), [(0.0, 6.0, 0), (math.pi, -6.0, 1)])
def test_the_bumper_that_meets_the_wall_feels_it(heading, speed, bumper):
    world = make_world()
    world.spawn(Cell(5, 3), heading)
    _, sensed = roll(world, speed, speed, 100)
    felt = [(sensed[:, address] > 0).any() for address in (world.at.front_touch, world.at.rear_touch)]
    assert felt[bumper]
    assert not felt[1 - bumper]
    assert world.pose().x_m < 0.75


def test_a_sound_robot_has_no_faults():
    world = make_world()
    roll(world, 3.0, 4.0, 200)
    assert world.faults() == []
    assert world.can_drive()


def test_a_state_that_is_not_a_number_is_seen_and_leaves_no_log(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mujoco.set_mju_user_warning(None)
    world = make_world()
    world.data.qvel[0] = math.nan
    roll(world, 0.0, 0.0, 2)
    assert not world.can_drive()
    assert any("not finite" in fault for fault in world.faults())
    assert any("BADQVEL" in fault for fault in world.faults())
    assert list(Path(tmp_path).iterdir()) == []
    world.spawn(Cell(1, 1), 0.0)
    assert world.faults() == []


def test_a_robot_on_its_side_has_fallen():
    world = make_world()
    world.data.qpos[2:7] = 0.12, math.cos(math.pi / 4), math.sin(math.pi / 4), 0, 0
    assert world.faults() == ["the robot has fallen over"]
    assert not world.can_drive()


def test_a_silent_reset_is_seen_by_the_clock():
    world = make_world()
    roll(world, 1.0, 1.0, 10)
    mujoco.mj_resetData(world.model, world.data)
    assert any("reset itself" in fault for fault in world.faults())
