"""The arena: scene, robot, walls, target and cameras composed into one MuJoCo model from the grid."""

from __future__ import annotations

import itertools
import math
from typing import Any, Final

import mujoco
import numpy as np

from scla_mj.clock import Clock
from scla_mj.grid import Grid
from scla_mj.paths import SCENE_XML, assets_folder
from scla_mj.world import names
from scla_mj.world.robot import PREFIX, Robot, casters, read

WALL_HEIGHT_M: Final = 0.10
"""Above the bumpers, below the lidar."""
WALL_THICKNESS_M: Final = 0.02

_TOP_FOVY_DEG: Final = 30.0
_ANGLED_FOVY_DEG: Final = 32.0
_ANGLED_VIEW: Final = (0.45, -1.0, 0.95)
"""Where the angled camera stands, as a direction from the floor's centre."""


def compose(grid: Grid, clock: Clock, robot: Robot, *, lean: bool = False) -> mujoco.MjSpec:
    """Return the arena of one grid with the robot in it, ready to compile or to edit further.

    A `lean` one has nothing that is only for looks: no visual geoms, materials, textures, lights and cameras. It moves
    bit for bit as the full one does, a sixth faster, in a hundredth of the memory.

    Raises:
        SclaError: the robot's file cannot be read, or lacks a part that the robot names.
    """
    spec = mujoco.MjSpec.from_file(str(assets_folder() / SCENE_XML))
    spec.attach(read(robot), frame=spec.worldbody.add_frame(name="spawn"), prefix=PREFIX)
    _set_options(spec, clock)
    _lay_floor(spec, grid)
    _add_walls(spec, grid)
    _add_closed_cells(spec, grid)
    _add_targets(spec, grid)
    _add_contacts(spec, grid, robot)
    _add_cameras(spec, grid)
    if lean:
        _strip(spec)
    return spec


def _strip(spec: mujoco.MjSpec) -> None:
    """Delete what is only for looks, and what MuJoCo would search at every step for contacts that cannot be."""
    collides = any(geom.contype for geom in spec.geoms)
    for geom in spec.geoms:
        if geom.group == names.VISUAL_GROUP and geom.mass == 0.0:
            spec.delete(geom)
        else:
            geom.material = ""
            geom.conaffinity = geom.conaffinity if collides else 0
    for element in (*spec.materials, *spec.textures, *spec.lights, *spec.cameras):
        spec.delete(element)


def _set_options(spec: mujoco.MjSpec, clock: Clock) -> None:
    """The cheapest honest settings: the discrete integrator makes a 10 ms step turn like 0.5 ms ones."""
    option = spec.option
    option.timestep = clock.physics_step_s
    option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    option.impratio = 10.0
    # One robot is one island; and a silent reset would hide a fault.
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND | mujoco.mjtDisableBit.mjDSBL_AUTORESET


def _half_extents(grid: Grid) -> tuple[float, float]:
    return grid.cells[0] * grid.cell_size_m / 2, grid.cells[1] * grid.cell_size_m / 2


def _lay_floor(spec: mujoco.MjSpec, grid: Grid) -> None:
    """Size the one floor; its texture draws the W x H tiles, which costs the physics nothing at any grid size."""
    half_x, half_y = _half_extents(grid)
    spec.geom(names.FLOOR).size = [half_x, half_y, 0.1]
    spec.material("tiles").texrepeat = [grid.cells[0] / 2, grid.cells[1] / 2]
    reach = 4 * max(half_x, half_y)
    visual = spec.find_default("visual")
    spec.worldbody.add_geom(
        visual,
        name="ground",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[reach, reach, 0.1],
        pos=[0, 0, -0.004],
        material="ground",
    )
    spec.stat.extent = 2 * max(half_x, half_y)
    spec.stat.center = [0, 0, 0.05]


def _add_walls(spec: mujoco.MjSpec, grid: Grid) -> None:
    """Four walls at the floor's edge: planes to touch (the cheapest contact, nothing tunnels through), boxes to see."""
    half_x, half_y = _half_extents(grid)
    t, h = WALL_THICKNESS_M / 2, WALL_HEIGHT_M / 2
    inward = {"left": (1, 0), "right": (-1, 0), "bottom": (0, 1), "top": (0, -1)}
    for side in names.WALL_SIDES:
        nx, ny = inward[side]
        spec.worldbody.add_geom(
            spec.find_default("wall_face"),
            name=f"wall_{side}",
            pos=[-nx * half_x, -ny * half_y, h],
            quat=_facing(nx, ny),
        )
        size = [t, half_y, h] if nx else [half_x + 2 * t, t, h]
        spec.worldbody.add_geom(
            spec.find_default("wall"),
            name=f"wall_{side}_box",
            size=size,
            pos=[-nx * (half_x + t), -ny * (half_y + t), h],
        )


def _facing(nx: float, ny: float) -> list[float]:
    """Quaternion that turns +z into the horizontal direction (nx, ny)."""
    half = math.pi / 4
    return [math.cos(half), -ny * math.sin(half), nx * math.sin(half), 0.0]


def _add_closed_cells(spec: mujoco.MjSpec, grid: Grid) -> None:
    half, h = grid.cell_size_m / 2, WALL_HEIGHT_M / 2
    for cell in sorted(grid.closed):
        x_m, y_m = grid.centre_m(cell)
        spec.worldbody.add_geom(
            spec.find_default("closed_cell"), name=f"closed_{cell.x}_{cell.y}", size=[half, half, h], pos=[x_m, y_m, h]
        )
        spec.worldbody.add_geom(
            spec.find_default("closed_face"),
            name=f"face_{cell.x}_{cell.y}",
            size=[half, half, half],
            pos=[x_m, y_m, half],
        )


def place_targets(model: Any, grid: Grid) -> None:
    """Move the targets' marks in a compiled model to where the grid has them."""
    for part, (number, target) in itertools.product((names.TARGET_RING, names.TARGET_DISC), enumerate(grid.targets)):
        model.geom(names.of_target(part, number)).pos[:2] = grid.centre_m(target)


def _add_targets(spec: mujoco.MjSpec, grid: Grid) -> None:
    for number, target in enumerate(grid.targets):
        x_m, y_m = grid.centre_m(target)
        for part, radius, height_m in ((names.TARGET_RING, 0.42, 0.0006), (names.TARGET_DISC, 0.34, 0.0012)):
            spec.worldbody.add_geom(
                spec.find_default("visual"), name=names.of_target(part, number), type=mujoco.mjtGeom.mjGEOM_CYLINDER,
                material=part, size=[radius * grid.cell_size_m, height_m / 2, 0], pos=[x_m, y_m, height_m / 2],
            )  # fmt: skip


def _grounds(spec: mujoco.MjSpec, grid: Grid) -> list[tuple[str, float]]:
    """Return what the robot stands on, each with its grip as a factor: the one plane or, with patches, level boxes.

    Cells of a row that grip alike are one box. The patches, other than plain floor, are seen.
    """
    if not grid.grip:
        return [(names.FLOOR, 1.0)]
    grounds, half = [], grid.cell_size_m / 2
    box = {"type": mujoco.mjtGeom.mjGEOM_BOX}
    for (y, factor), cells in itertools.groupby(
        sorted(grid.all_cells(), key=lambda cell: (cell.y, cell.x)), lambda cell: (cell.y, grid.grip.get(cell, 1.0))
    ):
        run = list(cells)
        (first_m, y_m), (last_m, _) = grid.centre_m(run[0]), grid.centre_m(run[-1])
        where, half_x, x_m = f"{run[0].x}_{y}", half * len(run), (first_m + last_m) / 2
        spec.worldbody.add_geom(
            spec.find_default("collision"),
            name=f"ground_{where}",
            size=[half_x, half, 0.05],
            pos=[x_m, y_m, -0.05],
            **box,
        )
        if factor != 1.0:
            spec.worldbody.add_geom(
                spec.find_default("visual"), name=f"patch_{where}", material="patch", size=[half_x, half, 0.0002],
                pos=[x_m, y_m, 0.0], **box,
            )  # fmt: skip
        grounds.append((f"ground_{where}", factor))
    return grounds


def _add_contacts(spec: mujoco.MjSpec, grid: Grid, robot: Robot) -> None:
    """Name the pairs that can touch, cheaper than filtering: tyres and casters on the floor, bumpers on walls.

    Friction and solref are those of the robot's geoms.
    """
    tyres = [spec.geom(PREFIX + tyre) for tyre in robot.tyres]
    for ground, factor in _grounds(spec, grid):
        for tyre in tyres:
            slide, spin, roll = tyre.friction.tolist()
            friction = [slide * factor, slide * factor, spin, roll, roll]
            _add_pair(spec, ground, tyre, condim=3, friction=friction)
        for caster in casters(spec, robot):  # a ball rolls any way: no friction
            _add_pair(spec, ground, caster, condim=1)
    for bumper in robot.bumpers:
        for side in names.WALL_SIDES:
            _add_pair(spec, f"wall_{side}", spec.geom(PREFIX + bumper), condim=1)


def _add_pair(spec: mujoco.MjSpec, other: str, geom: Any, **contact: Any) -> None:
    spec.add_pair(name=f"{geom.name}_{other}", geomname1=other, geomname2=geom.name, solref=geom.solref, **contact)


def _add_cameras(spec: mujoco.MjSpec, grid: Grid) -> None:
    """Two cameras that hold the whole floor in a 4:3 picture, at a distance computed from its size."""
    half_x, half_y = _half_extents(grid)
    half_m = max(half_y, half_x * 3 / 4) + 2 * WALL_THICKNESS_M
    height_m = half_m / math.tan(math.radians(_TOP_FOVY_DEG / 2)) + WALL_HEIGHT_M
    spec.worldbody.add_camera(name=names.TOP_CAMERA, pos=[0, 0, height_m], fovy=_TOP_FOVY_DEG)
    reach_m = math.hypot(half_x, half_y) / math.tan(math.radians(_ANGLED_FOVY_DEG / 2)) * 0.88
    back = np.array(_ANGLED_VIEW) / np.linalg.norm(_ANGLED_VIEW)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    frame = np.column_stack([right, np.cross(back, right), back])
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, frame.ravel())
    spec.worldbody.add_camera(name=names.ANGLED_CAMERA, pos=back * reach_m, quat=quat, fovy=_ANGLED_FOVY_DEG)
