"""What may disturb the robot and by how much: the settings, and the named sets that fill them.

Only the physics is disturbed: the controller keeps the nominal robot's parameters, and the brain is not informed.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal

from annotated_types import Interval

from scla_mj.errors import SclaError
from scla_mj.validation import Section, shown

DisturbanceSet = Literal["friction", "mass", "wheels", "noise", "pushes", "latency", "tilt", "all"]

FrictionScale = Annotated[float, Interval(ge=0.05, le=5.0)]
MassScale = Annotated[float, Interval(ge=0.2, le=5.0)]

PUSH_S: Final = 0.1
"""How long a push lasts: a short shove. 8 N/kg over 0.1 s would send a free robot off at 0.8 m/s, its own top speed."""
PUSH_EVERY_S: Final = 2.0
"""Mean time between two pushes, which come at random: a move takes some 0.85 s, so that about every other one meets
a push."""


@dataclass(frozen=True)
class DisturbanceConfig(Section):
    """What is not as the controller believes; neutral by default. A range is drawn from, uniformly, at each
    re-spawn."""

    friction_scale: tuple[FrictionScale, FrictionScale] = (1.0, 1.0)
    """Range of the factor on the tyres' grip; 1 1 for none."""
    mass_scale: tuple[MassScale, MassScale] = (1.0, 1.0)
    """Range of the factor on the robot's mass and inertia; 1 1 for none."""
    wheel_mismatch: Annotated[float, Interval(ge=0.0, le=0.2)] = 0.0
    """Each wheel's true radius is off by up to this fraction either way, drawn at each re-spawn."""
    command_noise: Annotated[float, Interval(ge=0.0, le=2.0)] = 0.0
    """Relative standard deviation of each wheel's speed command, drawn anew each control period."""
    push_n_per_kg: Annotated[float, Interval(ge=0.0, le=100.0)] = 0.0  # ten times its weight
    """Strongest push, per kilogram of robot; each is of a random strength up to it, from a random side."""
    latency_periods: Annotated[int, Interval(ge=0, le=100)] = 0
    """Control periods by which a command reaches the wheels late."""
    tilt_deg: Annotated[float, Interval(ge=0.0, le=20.0)] = 0.0
    """Slope of the ground; its direction is drawn at each respawn. Above 20 a robot at rest is close to fallen."""

    @property
    def model_changes(self) -> bool:
        """Return whether a re-spawn changes the physical model."""
        neutral = DisturbanceConfig()
        names = ("friction_scale", "mass_scale", "wheel_mismatch", "tilt_deg")
        return any(getattr(self, name) != getattr(neutral, name) for name in names)


SETS: Final[dict[str, dict[str, Any]]] = {
    "friction": {"friction_scale": (0.3, 1.5)},  # a wet tile to clean rubber
    "mass": {"mass_scale": (0.7, 1.3)},  # without its battery to a payload of 0.3 kg
    "wheels": {"wheel_mismatch": 0.05},  # 1.6 mm of wear or of a bad cast on a radius of 33 mm
    "noise": {"command_noise": 0.30},  # ten times what a cheap motor's own regulation leaves
    "pushes": {"push_n_per_kg": 8.0},  # more than a tyre's grip of 0.6 of the weight can hold
    "latency": {"latency_periods": 1},  # a message that misses its control period
    "tilt": {"tilt_deg": 2.0},  # 10 mm over one cell
}
"""What each named set fills in."""
ALL: Final = "all"


def figures_of(names: Sequence[str]) -> dict[str, Any]:
    """Return what the named sets fill in, by the name of the setting.

    Raises:
        SclaError: there is no set of that name.
    """
    unknown = [name for name in names if name not in (*SETS, ALL)]
    if unknown or isinstance(names, str):
        raise SclaError(f"--disturb is {shown(names)}: it must be a list of {', '.join(SETS)} or {ALL}")
    chosen = SETS if ALL in names else [name for name in SETS if name in names]
    return {setting: value for name in chosen for setting, value in SETS[name].items()}


def with_sets(config: DisturbanceConfig, names: Sequence[DisturbanceSet]) -> DisturbanceConfig:
    """Return the settings with the named sets' figures filled in.

    Raises:
        SclaError: there is no set of that name.
    """
    return dataclasses.replace(config, **figures_of(names))
