"""A robot is its own two files: its MJCF and its `Robot`."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from scla_mj.checked import check
from scla_mj.clock import resolve_clock
from scla_mj.config import ClockConfig, ControllerConfig, RunConfig
from scla_mj.errors import SclaError
from scla_mj.grid import Action, Cell, Grid
from scla_mj.loop.drive import Driver, gains_of
from scla_mj.signals import Outcome
from scla_mj.world.robot import BURGER, PREFIX, robot_of
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


def disc_of_the_page(folder):
    text = (Path(__file__).parents[2] / "docs" / "robot.md").read_text(encoding="utf-8")
    file = folder / "disc.xml"
    file.write_text(text.split("```xml\n")[1].split("```")[0], encoding="utf-8")
    return file


@pytest.mark.parametrize("name", ["mouse", "disc"])
def test_robots_of_other_sizes_weights_motors_and_casters_end_every_move_where_they_should(name, tmp_path):
    robot = BURGER._replace(mjcf=name if name == "mouse" else disc_of_the_page(tmp_path))
    world = World(GRID, CLOCK, robot)
    driver = Driver(world, CLOCK, ControllerConfig())
    for cell, action, move in walk(driver, world, 150):
        beyond = GRID.after(cell, action)
        assert move.after == beyond
        assert move.outcome == (Outcome.MOVED if beyond != cell else Outcome.BLOCKED)
        assert move.position_error_m <= 0.006


def test_the_controller_asks_of_a_robot_no_more_than_its_motors_tyres_and_balance_allow(tmp_path):
    config = ControllerConfig()
    plain = gains_of(World(GRID, CLOCK), CLOCK, config)
    assert plain.forward_acceleration_m_s2 == config.forward_acceleration_m_s2
    assert plain.max_turn_acceleration_rad_s2 == config.max_turn_acceleration_rad_s2

    def gains(*changes):
        return gains_of(World(GRID, CLOCK, BURGER._replace(mjcf=write(tmp_path, *changes))), CLOCK, config)

    weak = gains(('forcerange="-0.080 0.080"', 'forcerange="-0.020 0.020"'))
    assert weak.forward_acceleration_m_s2 == pytest.approx(0.65 * 2 * 0.020 / 0.033 / 1.0017, rel=1e-3)  # F = m a
    slow = gains(('ctrlrange="-25 25"', 'ctrlrange="-10 10"'))
    assert (slow.max_speed_m_s, slow.max_turn_rate_rad_s) == pytest.approx((0.33, 0.8 * 2 * 0.33 / 0.16))
    slippery = gains(('friction="1 0.005 0.0001"', 'friction="0.3 0.005 0.0001"'))
    assert slippery.forward_acceleration_m_s2 < 0.3 * 9.81
    assert slippery.tyre_acceleration_m_s2 == pytest.approx(0.3 * plain.tyre_acceleration_m_s2, abs=0.06)
    top_heavy = gains(('size="0.0508 0.0275" pos="-0.020 0 0.1315"', 'size="0.0508 0.0275" pos="-0.020 0 0.60"'))
    assert top_heavy.backward_acceleration_m_s2 < plain.backward_acceleration_m_s2


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            ('name="wheel_right" pos', 'name="wheel_other" pos'),
            r"has no body named wheel_right: .* there are .*wheel_other",
        ),
        (('pos="0 -0.080 0"', 'pos="0 -0.090 0"'), r"has wheels at y = 0\.08 and -0\.09 m: put"),
        (
            ('<geom type="sphere" size="0.033"', '<geom type="box" size="0.033 0.01 0.033"'),
            "that is no sphere: make it one",
        ),
        (
            ('pos="-0.081 0 -0.027" mass', 'pos="-0.020 0 -0.027" mass'),
            "tips over: its centre of mass lies 28.* behind the axle",
        ),
        (
            ('pos="-0.081 0 -0.027" mass', 'pos="-0.081 0 -0.020" mass'),
            r"leans: the caster_collision behind the axle ends 7\.0 mm higher than the wheels; move it down by as much",
        ),
        (('ctrlrange="-25 25" forcerange="-0.080 0.080"', ""), "has motors without limits: give both a ctrlrange"),
        (('"0 0.062 0 0 -0.062 0"', '"0 0.162 0 0 -0.162 0"'), r"needs cells of at least 0\.40\d m to turn in"),
    ],
)
def test_a_robot_that_cannot_drive_is_told_what_would_be_right(tmp_path, change, said):
    with pytest.raises(SclaError, match=said) as refused:
        World(GRID, CLOCK, BURGER._replace(mjcf=write(tmp_path, change)))
    assert "\n" not in str(refused.value)


def test_a_run_keeps_the_digest_of_its_robot_and_drives_no_changed_one(tmp_path):
    file = write(tmp_path)
    checked = check(RunConfig(robot=str(file)))
    assert len(checked.config.robot_sha256) == 64
    World(GRID, CLOCK, robot_of(checked))
    write(tmp_path, ('size="0.033" mass="0"', 'size="0.030" mass="0"'))
    with pytest.raises(SclaError, match="has changed since the run began: put back the one of SHA-256"):
        World(GRID, CLOCK, robot_of(checked))
    with pytest.raises(SclaError, match="--robot trolley cannot be read: No such file or directory; name an MJCF file"):
        check(RunConfig(robot="trolley"))
