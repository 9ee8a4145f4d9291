"""A robot is its own two files: its MJCF and its `Robot`."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from scla_mj.clock import resolve_clock
from scla_mj.config import ClockConfig, ControllerConfig
from scla_mj.errors import SclaError
from scla_mj.grid import Action, Cell, Grid
from scla_mj.loop.drive import Driver
from scla_mj.signals import Outcome
from scla_mj.world.robot import BURGER, PREFIX
from scla_mj.world.world import World

CLOCK = resolve_clock(ClockConfig())
GRID = Grid((5, 5), Cell(3, 3), 0.30)
BURGER_XML = BURGER.file.read_text(encoding="utf-8")


def write(folder, *changes):
    text = BURGER_XML
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    file = folder / "other.xml"
    file.write_text(text, encoding="utf-8")
    return file


def exchanged(text, first, second, end):
    """Exchange what begins with `first` and what begins with `second` and ends before `end`."""
    before, rest = text.split(first)
    one, rest = rest.split(second)
    two, after = rest.split(end, 1)
    return before + second + two + first + one + end + after


def walk(driver, world, count):
    rng, cell = np.random.default_rng(0), Cell(3, 3)
    world.spawn(cell, 0.0)
    for _ in range(count):
        action = Action(int(rng.integers(4)))
        move = driver.drive(action, cell, standing=CLOCK.thinking_controls)
        yield cell, action, move
        cell = move.after


def test_a_robot_of_other_dimensions_drives_from_its_own_files_alone(tmp_path):
    smaller = (
        ('size="0.033" mass="0"', 'size="0.030" mass="0"'),
        ('pos="0 0 0.033"', 'pos="0 0 0.030"'),
        ('pos="0 0.080 0"', 'pos="0 0.075 0"'),
        ('pos="0 -0.080 0"', 'pos="0 -0.075 0"'),
        ('pos="-0.081 0 -0.027"', 'pos="-0.081 0 -0.024"'),
    )
    world = World(GRID, CLOCK, BURGER._replace(mjcf=write(tmp_path, *smaller)))
    assert world.dimensions.wheel_radius_m == 0.030
    assert world.dimensions.track_m == pytest.approx(0.150)
    driver = Driver(world, CLOCK, ControllerConfig())
    for cell, action, move in walk(driver, world, 50):
        beyond = GRID.after(cell, action)
        assert move.after == beyond
        assert move.outcome == (Outcome.MOVED if beyond != cell else Outcome.BLOCKED)
        assert move.position_error_m <= 0.003


def test_the_order_of_a_robots_parts_does_not_matter(tmp_path):
    """Left and right, front and rear stand in the other order in the file: every address is another one."""
    text = exchanged(BURGER_XML, '<body name="wheel_left"', '<body name="wheel_right"', "<!-- At the height")
    text = exchanged(text, '<body name="bumper_front"', '<body name="bumper_rear"', "</body>\n  </worldbody>")
    text = exchanged(text, '<velocity name="drive_left"', '<velocity name="drive_right"', "</actuator>")
    text = exchanged(text, '<touch name="touch_front"', '<touch name="touch_rear"', "</sensor>")
    (tmp_path / "other.xml").write_text(text, encoding="utf-8")
    other = World(GRID, CLOCK, BURGER._replace(mjcf=tmp_path / "other.xml"))
    plain = World(GRID, CLOCK)
    assert other.at.left_qpos == plain.at.right_qpos
    assert (other.at.left_motor, other.at.front_touch) == (plain.at.right_motor, plain.at.rear_touch)
    worlds = [(world, Driver(world, CLOCK, ControllerConfig())) for world in (plain, other)]
    for (*_, expected), (*_, move) in zip(*(walk(driver, world, 30) for world, driver in worlds), strict=True):
        assert (move.outcome, move.after) == (expected.outcome, expected.after)
        assert move.trajectory[-1] == pytest.approx(expected.trajectory[-1], abs=1e-6)


def test_every_sensor_of_the_robots_file_is_read():
    """The pose and the speeds are read from qpos and qvel: inside mj_step a sensor is one step old."""
    spec = mujoco.MjSpec.from_string(BURGER_XML)
    assert [sensor.name for sensor in spec.sensors] == list(BURGER.touch_sensors)
    assert {site.name for site in spec.sites} == {sensor.objname for sensor in spec.sensors}


def test_addresses_are_those_that_mujoco_has_for_the_names():
    world = World(GRID, CLOCK)
    world.spawn(Cell(4, 2), 0.7)
    world.data.ctrl[:] = 3.0, 4.0
    mujoco.mj_step(world.model, world.data, nstep=30)
    data, at = world.data, world.at
    root = data.joint(PREFIX + BURGER.root_joint)
    assert (world.root_qpos == root.qpos).all()
    assert (data.qvel[at.root_dof : at.root_dof + 6] == root.qvel).all()
    wheels = [data.joint(PREFIX + joint).qpos[0] for joint in BURGER.wheel_joints]
    assert [data.qpos[at.left_qpos], data.qpos[at.right_qpos]] == wheels == list(world.wheel_angles_rad())
    assert math.isclose(data.ctrl[at.left_motor], 3.0)
    assert world.model.body(at.chassis).name == PREFIX + BURGER.chassis


def test_a_file_that_is_no_such_robot_is_refused_in_one_sentence(tmp_path):
    robot = BURGER._replace(mjcf=write(tmp_path, ('name="touch_rear"', 'name="touch_back"')))
    with pytest.raises(SclaError, match="has no sensor named touch_rear"):
        World(GRID, CLOCK, robot)
    robot = BURGER._replace(mjcf=write(tmp_path, ('size="0.033" mass="0"', 'size="-1" mass="0"')))
    with pytest.raises(SclaError, match=r"cannot compile .*other\.xml: Error: size 0 .* 'robot/wheel_left_collision'"):
        World(GRID, CLOCK, robot)
    with pytest.raises(SclaError, match=r"cannot read the robot's file .*nowhere\.xml"):
        World(GRID, CLOCK, BURGER._replace(mjcf="nowhere.xml"))
