"""The robot: its MJCF file, the names that it must have, and what a compiled model of it measures (docs/robot.md)."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from scla_mj.checked import CheckedConfig
from scla_mj.dimensions import Dimensions
from scla_mj.errors import SclaError
from scla_mj.paths import shipped_file
from scla_mj.world.names import VISUAL_GROUP

PREFIX: Final = "robot/"
"""What the arena puts in front of the robot's names."""


class Robot(NamedTuple):
    """A robot with two driven wheels, casters, and a bumper at either end.

    Its chassis has a free joint, its origin midway between the wheels, +x forwards and +y to the left; the wheels turn
    about +y. Tuples of two are left and right, or front and rear. What is only for looks is massless and in group 2.

    Attributes:
        mjcf: the MJCF file: a path, or the name of a robot that ships with the package.
        sha256: of the file as it must be; empty for any.
        chassis, root_joint: the body that stands for the robot, and its free joint.
        wheels, wheel_joints, motors: bodies, joints and velocity actuators.
        tyres: the spheres on which the wheels roll.
        bumpers, touch_sensors: the geoms that touch walls, and the touch sensors of the sites around them.
        caster: how the names of the geoms begin that slide on the floor, if there are any.
    """

    mjcf: str | Path = "burger"
    sha256: str = ""
    chassis: str = "chassis"
    root_joint: str = "root"
    wheels: tuple[str, str] = ("wheel_left", "wheel_right")
    wheel_joints: tuple[str, str] = ("wheel_left", "wheel_right")
    motors: tuple[str, str] = ("drive_left", "drive_right")
    tyres: tuple[str, str] = ("wheel_left_collision", "wheel_right_collision")
    bumpers: tuple[str, str] = ("bumper_front_collision", "bumper_rear_collision")
    touch_sensors: tuple[str, str] = ("touch_front", "touch_rear")
    caster: str = "caster_collision"

    @property
    def file(self) -> Path:
        """Where the MJCF is."""
        return shipped_file(str(self.mjcf), ".xml")


BURGER: Final = Robot()
"""A TurtleBot3 Burger with faster motors and with bumpers: assets/burger.xml has its sources."""


def robot_of(checked: CheckedConfig) -> Robot:
    """Return the robot that a configuration names."""
    return Robot(checked.config.robot, checked.config.robot_sha256)


class Addresses(NamedTuple):
    """Where the robot's parts are in the arrays of a compiled model and its data: plain numbers for the compiled loop.

    `chassis` is a body's number, the tyres are geoms'; `root_qpos` and `root_dof` are the first of the free joint's
    seven positions (x y z, quaternion w x y z) and six velocities.
    """

    root_qpos: int
    root_dof: int
    left_qpos: int
    right_qpos: int
    left_dof: int
    right_dof: int
    left_motor: int
    right_motor: int
    front_touch: int
    rear_touch: int
    chassis: int
    left_tyre: int
    right_tyre: int


def one_line(error: Exception) -> str:
    """Return MuJoCo's message, which may have several lines, as one."""
    return "; ".join(str(error).splitlines())


def read(robot: Robot) -> mujoco.MjSpec:
    """Return the robot's MJCF as it stands in its file.

    Raises:
        SclaError: the file cannot be read, has changed, has not every part that a robot must have, or has a part that
            cannot be driven; one sentence says what would be right.
    """
    file = robot.file
    try:
        digest = hashlib.sha256(file.read_bytes()).hexdigest() if robot.sha256 else ""
        spec = mujoco.MjSpec.from_file(str(file))
    except (ValueError, OSError) as error:
        raise SclaError(f"cannot read the robot's file {file}: {one_line(error)}") from error
    if digest != robot.sha256:
        raise SclaError(
            f"the robot's file {file} has changed since the run began: put back the one of SHA-256 {robot.sha256}, or "
            "name it anew for a new run (in Python with robot_sha256='')"
        )
    fault = next(_faults(spec, robot), None)
    if fault is not None:
        raise SclaError(f"the robot's file {file} {fault} (docs/robot.md)")
    return spec


def _faults(spec: mujoco.MjSpec, robot: Robot) -> Iterator[str]:
    """Say what is wrong with a file, and what would be right."""
    named = {
        "body": (robot.chassis, *robot.wheels),
        "joint": (robot.root_joint, *robot.wheel_joints),
        "actuator": robot.motors,
        "geom": (*robot.tyres, *robot.bumpers),
        "sensor": robot.touch_sensors,
    }
    for kind, names in named.items():
        for name in names:
            if getattr(spec, kind)(name) is None:
                there = ", ".join(
                    sorted(part.name for part in getattr(spec, _PLURALS.get(kind, f"{kind}s")) if part.name)
                )
                yield f"has no {kind} named {name}: give the right one that name; there are {there or 'none'}"
    if spec.joint(robot.root_joint).type != mujoco.mjtJoint.mjJNT_FREE:
        yield f'has a joint {robot.root_joint} that is not free: write <freejoint name="{robot.root_joint}"/>'
    for body in robot.wheels:
        if spec.body(body).parent.name != robot.chassis:
            yield f"has the wheel {body} outside the body {robot.chassis}: put it into that"
    for tyre in robot.tyres:
        if spec.geom(tyre).type != mujoco.mjtGeom.mjGEOM_SPHERE:
            yield f"has a tyre {tyre} that is no sphere: make it one, which touches the floor in one point"
    left_m, right_m = (float(spec.body(wheel).pos[1]) for wheel in robot.wheels)
    if left_m <= 0.0 or abs(left_m + right_m) > _TINY_M or any(spec.body(wheel).pos[0] for wheel in robot.wheels):
        yield (
            f"has wheels at y = {left_m:g} and {right_m:g} m: put {robot.wheels[0]} and {robot.wheels[1]} at x = 0, as "
            f"far to the left as to the right of the {robot.chassis}' origin"
        )


_PLURALS: Final = {"body": "bodies"}
_TINY_M: Final = 1e-6
_LEAN: Final = 0.06  # rad; one that leans more drives at a fraction of its speed


def casters(spec: mujoco.MjSpec, robot: Robot) -> list[Any]:
    """Return the geoms that slide on the floor."""
    return [geom for geom in spec.geoms if geom.name.removeprefix(PREFIX).startswith(robot.caster)]


def locate(model: Any, robot: Robot) -> Addresses:
    """Look up the robot's parts by name: once, since a look-up costs as much as a move's arithmetic."""
    root = model.joint(PREFIX + robot.root_joint)
    left_wheel, right_wheel = (model.joint(PREFIX + name) for name in robot.wheel_joints)
    left_motor, right_motor = (model.actuator(PREFIX + name) for name in robot.motors)
    front_touch, rear_touch = (model.sensor(PREFIX + name) for name in robot.touch_sensors)
    left_tyre, right_tyre = robot.tyres
    return Addresses(
        root_qpos=int(root.qposadr[0]),
        root_dof=int(root.dofadr[0]),
        left_qpos=int(left_wheel.qposadr[0]),
        right_qpos=int(right_wheel.qposadr[0]),
        left_dof=int(left_wheel.dofadr[0]),
        right_dof=int(right_wheel.dofadr[0]),
        left_motor=int(left_motor.id),
        right_motor=int(right_motor.id),
        front_touch=int(front_touch.adr[0]),
        rear_touch=int(rear_touch.adr[0]),
        chassis=int(model.body(PREFIX + robot.chassis).id),
        left_tyre=int(model.geom(PREFIX + left_tyre).id),
        right_tyre=int(model.geom(PREFIX + right_tyre).id),
    )


def measure(model: Any, robot: Robot) -> Dimensions:
    """Return the robot's dimensions in a compiled model.

    Raises:
        SclaError: it would not stand level on its wheels, or its motors have no limits.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    chassis = model.body(PREFIX + robot.chassis).id
    axle_m, wheel_radius_m = data.xpos[chassis], float(model.geom(PREFIX + robot.tyres[0]).size[0])
    left_y_m, right_y_m = (float(model.body(PREFIX + wheel).pos[1]) for wheel in robot.wheels)
    bumpers = [model.geom(PREFIX + bumper) for bumper in robot.bumpers]
    front, rear = (abs(float(model.body_pos[bumper.bodyid[0], 0])) + float(bumper.size[0]) for bumper in bumpers)
    ahead_m, _, above_m = (data.subtree_com[chassis] - axle_m).tolist()
    rolling_m = data.geom(PREFIX + robot.tyres[0]).xpos[2] - wheel_radius_m
    slides = [
        (float(ahead), float(height - model.geom_size[geom, 0] - rolling_m))
        for geom, (ahead, _, height) in enumerate(data.geom_xpos - (axle_m[0], 0.0, 0.0))
        if model.geom(geom).name.startswith(PREFIX + robot.caster)
    ]
    motors = [model.actuator(PREFIX + motor) for motor in robot.motors]
    torques = [float(motor.forcerange[1]) if motor.forcelimited[0] else 0.0 for motor in motors]
    dimensions = Dimensions(
        wheel_radius_m=wheel_radius_m,
        track_m=left_y_m - right_y_m,
        front_reach_m=front,
        rear_reach_m=rear,
        top_wheel_speed_rad_s=min(float(motor.ctrlrange[1]) for motor in motors),
        turning_radius_m=_turning_radius_m(model, data, chassis),
        mass_kg=float(model.body_subtreemass[chassis]),
        com_behind_m=-ahead_m,
        com_height_m=above_m + wheel_radius_m,
        caster_behind_m=max(0.0, *(-x for x, _ in slides)) if slides else 0.0,
        caster_ahead_m=max(0.0, *(x for x, _ in slides)) if slides else 0.0,
        yaw_inertia_kg_m2=_yaw_inertia_kg_m2(model, data, chassis),
        friction=float(model.geom(PREFIX + robot.tyres[0]).friction[0]),
        motor_torque_n_m=min(torques),
        torque_reach_rad_s=min(torques) / min(float(motor.gainprm[0]) for motor in motors),
    )
    _refuse_undrivable(dimensions, robot, slides)
    return dimensions


def _refuse_undrivable(own: Dimensions, robot: Robot, slides: list[tuple[float, float]]) -> None:
    which, off_m, caster_m, side = ("behind", own.com_behind_m, own.caster_behind_m, -1)
    if off_m < 0.0:
        which, off_m, caster_m, side = ("ahead of", -off_m, own.caster_ahead_m, 1)
    if off_m >= caster_m:
        raise SclaError(
            f"the robot of {robot.file} tips over: its centre of mass lies {1000 * off_m:.1f} mm {which} the axle, and "
            f"no {robot.caster} further out; add one there or move the mass"
        )
    gap_m = min(gap_m for x_m, gap_m in slides if side * x_m > off_m)
    if abs(gap_m) > _LEAN * caster_m:
        amiss, move = ("higher", "down") if gap_m > 0.0 else ("lower", "up")
        raise SclaError(
            f"the robot of {robot.file} leans: the {robot.caster} {which} the axle ends {1000 * abs(gap_m):.1f} mm "
            f"{amiss} than the wheels; move it {move} by as much"
        )
    if own.top_wheel_speed_rad_s <= 0.0 or own.motor_torque_n_m <= 0.0:
        raise SclaError(
            f"the robot of {robot.file} has motors without limits: give both a ctrlrange (rad/s) and a forcerange (N m)"
        )


def _turning_radius_m(model: Any, data: Any, chassis: int) -> float:
    """Return how far any corner of the robot that is more than looks lies from the axle's midpoint, seen from above."""
    corners: NDArray[np.float64] = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1)
    radii = [0.0]
    for geom in np.flatnonzero((model.body_rootid[model.geom_bodyid] == chassis) & (model.geom_group != VISUAL_GROUP)):
        centre, half = model.geom_aabb[geom, :3, None], model.geom_aabb[geom, 3:, None]
        placed = data.geom_xmat[geom].reshape(3, 3) @ (centre + half * corners) + data.geom_xpos[geom][:, None]
        radii.append(float(np.hypot(*(placed - data.xpos[chassis][:, None])[:2]).max()))
    return max(radii)


def _yaw_inertia_kg_m2(model: Any, data: Any, chassis: int) -> float:
    total = 0.0
    for body in np.flatnonzero(model.body_rootid == chassis):
        frame = data.ximat[body].reshape(3, 3)
        arm = (data.xipos[body] - data.xpos[chassis])[:2]
        total += float(frame[2] ** 2 @ model.body_inertia[body] + model.body_mass[body] * (arm @ arm))
    return total
