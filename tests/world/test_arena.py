"""The compiled model against the published robot, and the arena against its grid."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from scla_mj.clock import resolve_clock
from scla_mj.config import ClockConfig
from scla_mj.grid import Cell, Grid
from scla_mj.world import names
from scla_mj.world.arena import compose
from scla_mj.world.robot import BURGER, PREFIX

CLOCK = resolve_clock(ClockConfig())
CHASSIS, LEFT_WHEEL = PREFIX + BURGER.chassis, PREFIX + BURGER.wheels[0]
BUMPERS = [PREFIX + bumper for bumper in BURGER.bumpers]
GRID = Grid((5, 5), Cell(3, 3), 0.30)


@pytest.fixture(scope="module")
def model():
    return compose(GRID, CLOCK, BURGER).compile()


def test_masses_are_the_published_ones(model):
    # turtlebot3_burger.urdf: base 0.8257, wheels 0.0285 each, caster 0.005, lidar 0.114; e-Manual: 1 kg.
    assert model.body(LEFT_WHEEL).mass[0] == pytest.approx(0.0285, abs=1e-4)
    assert model.body(CHASSIS).mass[0] == pytest.approx(0.8257 + 0.005 + 0.114, abs=1e-4)
    assert model.body_mass.sum() == pytest.approx(1.0, abs=0.005)


def test_dimensions_are_the_published_ones(model):
    # e-Manual: 138 x 178 x 192 mm; wheel radius 33 mm, wheel separation 160 mm.
    radius = model.geom("robot/wheel_left_tyre").size[0]
    assert radius == 0.033
    assert np.ptp([model.body(PREFIX + wheel).pos[1] for wheel in BURGER.wheels]) == pytest.approx(0.160)
    width = 2 * (model.body(LEFT_WHEEL).pos[1] + model.geom("robot/wheel_left_tyre").size[1])
    assert width == pytest.approx(0.178)
    lidar = model.geom("robot/lidar_head")
    assert radius + lidar.pos[2] + lidar.size[1] == pytest.approx(0.192)
    plate, tyre_front = model.geom("robot/plate_1"), radius
    length = max(plate.pos[0] + plate.size[0], tyre_front) - (plate.pos[0] - plate.size[0])
    assert length == pytest.approx(0.138, abs=0.003)


def test_motors_stay_below_their_torque_speed_line(model):
    # DYNAMIXEL XL330-M077-T at 5 V: 0.215 N m at stall, 383 rev/min without load.
    top = model.actuator_ctrlrange[:, 1]
    line = 0.215 * (1 - top / (383 * 2 * math.pi / 60))
    assert (model.actuator_forcerange[:, 1] <= line).all()
    assert (model.actuator_forcerange[:, 0] == -model.actuator_forcerange[:, 1]).all()


def test_every_element_is_named(model):
    kinds = {
        mujoco.mjtObj.mjOBJ_BODY: model.nbody,
        mujoco.mjtObj.mjOBJ_GEOM: model.ngeom,
        mujoco.mjtObj.mjOBJ_JOINT: model.njnt,
        mujoco.mjtObj.mjOBJ_SENSOR: model.nsensor,
        mujoco.mjtObj.mjOBJ_CAMERA: model.ncam,
    }
    for kind, count in kinds.items():
        assert all(mujoco.mj_id2name(model, kind, i) for i in range(count))


@pytest.mark.parametrize(("cells", "closed"), [((5, 5), ()), ((7, 7), ()), ((3, 4), ((1, 1), (3, 2))), ((2, 1), ())])
def test_the_walls_stand_at_the_edge_of_the_floor(cells, closed):
    grid = Grid(cells, Cell(2, 1), 0.30, frozenset(Cell(*cell) for cell in closed))
    model = compose(grid, CLOCK, BURGER).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    half = np.array(cells) * 0.30 / 2
    for side, axis, sign in (("left", 0, -1), ("right", 0, 1), ("bottom", 1, -1), ("top", 1, 1)):
        face = data.geom(f"wall_{side}")
        assert face.xpos[axis] == pytest.approx(sign * half[axis])
        assert face.xmat.reshape(3, 3)[axis, 2] == pytest.approx(-sign)
    assert model.geom(names.FLOOR).size[:2] == pytest.approx(half)
    for cell in grid.closed:
        box = data.geom(f"closed_{cell.x}_{cell.y}")
        assert box.xpos[:2] == pytest.approx(grid.centre_m(cell))
        assert model.geom(box.id).size[:2] == pytest.approx([0.15, 0.15])


def test_the_robot_turns_in_a_cell_without_reaching_its_edge(model):
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    reach = 0.0
    for name in BUMPERS:
        geom = data.geom(name)
        tip = np.abs(geom.xmat.reshape(3, 3)[:, 2]) * model.geom(name).size[1]
        reach = max(reach, math.hypot(*(np.abs(geom.xpos[:2]) + tip[:2])) + model.geom(name).size[0])
    assert 0.089 < reach < 0.30 / 2 - 0.003


def test_a_large_floor_has_no_more_parts_than_a_small_one(model):
    large = compose(Grid((50, 50), Cell(3, 3), 0.30), CLOCK, BURGER).compile()
    assert (large.ngeom, large.nbody, large.npair) == (model.ngeom, model.nbody, model.npair)


def test_both_cameras_hold_the_whole_floor(model):
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    corners = np.array([[x, y, 0.0] for x in (-0.75, 0.75) for y in (-0.75, 0.75)])
    for name in (names.TOP_CAMERA, names.ANGLED_CAMERA):
        seen = (corners - data.camera(name).xpos) @ data.camera(name).xmat.reshape(3, 3)
        half = math.tan(math.radians(model.camera(name).fovy[0]) / 2)
        assert (np.abs(seen[:, 1] / seen[:, 2]) < half).all()
        assert (np.abs(seen[:, 0] / seen[:, 2]) < half * 4 / 3).all()
