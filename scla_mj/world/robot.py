"""The robot: its MJCF file, the names in it, what MJCF cannot say, and where its parts are in a compiled model.

Another robot is another MJCF file and another `Robot`; `ROBOT` is the one that runs drive (docs/extending.md).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final, NamedTuple

import mujoco

from scla_mj.errors import SclaError
from scla_mj.paths import assets_folder

PREFIX: Final = "robot/"
"""What the arena puts in front of the robot's names."""


class Robot(NamedTuple):
    """A robot with two driven wheels, casters, and a bumper at either end.

    Its chassis has a free joint, its origin midway between the wheels, +x forwards and +y to the left; the wheels turn
    about +y. Tuples of two are left and right, or front and rear. What is only for looks is massless and in group 2.

    Attributes:
        mjcf: the MJCF file: a name in the package's assets, or a path.
        chassis, root_joint: the body that stands for the robot, and its free joint.
        wheels, wheel_joints, motors: bodies, joints and velocity actuators; the motors' limits are those of the MJCF.
        tyres, casters: the geoms that touch the floor, tyres as spheres.
        bumpers, touch_sensors: the geoms that touch walls, and the touch sensors of the sites around them.
        tyre_friction: sliding along and across, spin, and roll along and across, as MuJoCo's pairs have them.
        tyre_solref, bump_solref: time constant in seconds and damping ratio of a contact with the floor, with a wall.
        rolling_radius: the radius on which a loaded tyre rolls, as a fraction of the nominal one.
        tyre_acceleration_m_s2: what a wheel's rim may gain or lose in speed, turn and drive together.
    """

    mjcf: str | Path
    chassis: str
    root_joint: str
    wheels: tuple[str, str]
    wheel_joints: tuple[str, str]
    motors: tuple[str, str]
    tyres: tuple[str, str]
    casters: tuple[str, ...]
    bumpers: tuple[str, str]
    touch_sensors: tuple[str, str]
    tyre_friction: tuple[float, float, float, float, float]
    tyre_solref: tuple[float, float]
    bump_solref: tuple[float, float]
    rolling_radius: float
    tyre_acceleration_m_s2: float


BURGER: Final = Robot(
    mjcf="burger.xml",
    chassis="chassis",
    root_joint="root",
    wheels=("wheel_left", "wheel_right"),
    wheel_joints=("wheel_left", "wheel_right"),
    motors=("drive_left", "drive_right"),
    tyres=("wheel_left_collision", "wheel_right_collision"),
    casters=("caster_collision",),
    bumpers=("bumper_front_collision", "bumper_rear_collision"),
    touch_sensors=("touch_front", "touch_rear"),
    # Rubber on tile slides at about 1; spin and roll are MuJoCo's defaults (condim 3 leaves them unused).
    tyre_friction=(1.0, 1.0, 0.005, 0.0001, 0.0001),
    # A rubber tyre is overdamped: at critical damping a wheel hops as it speeds up, and a 10 ms step hops differently.
    tyre_solref=(0.02, 2.0),
    # A foam bumper: 0.04 s, critically damped, so that a bump ends without a bounce.
    bump_solref=(0.04, 1.0),
    # Measured over a known distance, as one calibrates a real robot (tests/sense/test_odometry.py drives it); half of
    # how deep the tyre is pressed in is as much.
    rolling_radius=0.988,
    # 40 % of what a grip of 3.1 N gives half a kilogram.
    tyre_acceleration_m_s2=2.5,
)
"""A TurtleBot3 Burger with faster motors and with bumpers: assets/burger.xml has its sources."""

ROBOT: Final = BURGER
"""The robot that runs drive."""


class Addresses(NamedTuple):
    """Where the robot's parts are in the arrays of a compiled model and its data: plain numbers for the compiled loop.

    `chassis` is a body's number, the tyres are geoms', the grips those of the pairs tyre and floor; `root_qpos` and
    `root_dof` are the first of the free joint's seven positions (x y z, quaternion w x y z) and six velocities.
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
    left_grip: int
    right_grip: int


class Dimensions(NamedTuple):
    """The robot's measures, read from the compiled model; reaches are how far bumpers stand out from the axle."""

    wheel_radius_m: float
    track_m: float
    front_reach_m: float
    rear_reach_m: float
    top_wheel_speed_rad_s: float


def floor_pair(geom: str) -> str:
    """Return the name of the contact pair of one of the robot's geoms with the floor."""
    return f"{PREFIX}{geom}_floor"


def one_line(error: Exception) -> str:
    """Return MuJoCo's message, which may have several lines, as one."""
    return "; ".join(str(error).splitlines())


def read(robot: Robot) -> mujoco.MjSpec:
    """Return the robot's MJCF as it stands in its file.

    Raises:
        SclaError: the file cannot be read, or has not every part that the robot names.
    """
    file = assets_folder() / robot.mjcf
    try:
        spec = mujoco.MjSpec.from_file(str(file))
    except (ValueError, OSError) as error:
        raise SclaError(f"cannot read the robot's file {file}: {one_line(error)}") from error
    named = {
        "body": (robot.chassis, *robot.wheels),
        "joint": (robot.root_joint, *robot.wheel_joints),
        "actuator": robot.motors,
        "geom": (*robot.tyres, *robot.casters, *robot.bumpers),
        "sensor": robot.touch_sensors,
    }
    for kind, names in named.items():
        for name in names:
            if getattr(spec, kind)(name) is None:
                raise SclaError(f"the robot's file {file} has no {kind} named {name}: its Robot names one")
    return spec


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
        left_grip=int(model.pair(floor_pair(left_tyre)).id),
        right_grip=int(model.pair(floor_pair(right_tyre)).id),
    )


def measure(model: Any, robot: Robot) -> Dimensions:
    """Return the robot's dimensions in a compiled model."""
    left_y_m, right_y_m = (float(model.body(PREFIX + wheel).pos[1]) for wheel in robot.wheels)
    bumpers = [model.geom(PREFIX + bumper) for bumper in robot.bumpers]
    front, rear = (abs(float(model.body_pos[bumper.bodyid[0], 0])) + float(bumper.size[0]) for bumper in bumpers)
    motors = [model.actuator(PREFIX + motor) for motor in robot.motors]
    return Dimensions(
        wheel_radius_m=float(model.geom(PREFIX + robot.tyres[0]).size[0]),
        track_m=left_y_m - right_y_m,
        front_reach_m=front,
        rear_reach_m=rear,
        top_wheel_speed_rad_s=min(float(motor.ctrlrange[1]) for motor in motors),
    )
