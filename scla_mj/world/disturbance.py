"""The robot as it is, not as its controller believes: what a re-spawn changes in the physical model."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import mujoco
import numpy as np

from scla_mj.world import names
from scla_mj.world.interference import make_interference

if TYPE_CHECKING:
    from scla_mj.disturbances import DisturbanceConfig
    from scla_mj.world.world import World


class Draw(NamedTuple):
    """One robot on one floor: factors on grip, mass and each wheel's radius, and the way that the floor falls."""

    friction: float = 1.0
    mass: float = 1.0
    left_radius: float = 1.0
    right_radius: float = 1.0
    downhill_rad: float = 0.0


class Disturbance:
    """Changes the world's model at each re-spawn, and holds what interferes with a drive.

    Attributes:
        draw: the robot and the floor as they are now.
        interference: what the compiled loop takes, or None where nothing interferes with a drive.
    """

    def __init__(
        self,
        world: World,
        config: DisturbanceConfig,
        *,
        control_period_s: float,
        model_rng: np.random.Generator,
        drive_rng: np.random.Generator,
    ) -> None:
        self._world = world
        self._config = config
        self._changes_model = config.model_changes
        self._rng = model_rng
        self._nominal = _Nominal(world.model)
        self.draw = Draw()
        chassis = world.model.body(names.CHASSIS).id
        self.interference = make_interference(
            config, control_period_s=control_period_s, external_force=world.data.xfrc_applied[chassis], rng=drive_rng
        )

    def renew(self) -> None:
        """Draw another robot and another floor; a spawn must follow, since the robot stands otherwise on them."""
        if self._changes_model:
            self._apply(self._drawn())
        if self.interference is not None:
            self.interference.late[:] = 0.0
            self.interference.push[:] = 0.0
            mass_kg = float(self._world.model.body_mass.sum())
            self.interference.strongest_push_n[0] = self._config.push_n_per_kg * mass_kg

    def state(self) -> dict[str, Any]:
        """Return all that `restore` needs to go on bit for bit."""
        state: dict[str, Any] = {"draw": list(self.draw), "model_rng": self._rng.bit_generator.state}
        if self.interference is not None:
            state["late"] = self.interference.late.copy()
            state["push"] = self.interference.push.copy()
            state["strongest_push_n"] = self.interference.strongest_push_n.copy()
            state["drive_rng"] = self.interference.rng.bit_generator.state
        return state

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from `state`: the model, and what interferes; the world's own state is the world's to restore."""
        self._rng.bit_generator.state = state["model_rng"]
        if self._changes_model:
            self._apply(Draw(*state["draw"]))
        if self.interference is not None:
            self.interference.late[:] = state["late"]
            self.interference.push[:] = state["push"]
            self.interference.strongest_push_n[:] = state["strongest_push_n"]
            self.interference.rng.bit_generator.state = state["drive_rng"]

    def _drawn(self) -> Draw:
        """Draw every factor every time, so that one set's draws do not depend on which others are on."""
        config, rng = self._config, self._rng
        return Draw(
            friction=float(rng.uniform(*config.friction_scale)),
            mass=float(rng.uniform(*config.mass_scale)),
            left_radius=1.0 + config.wheel_mismatch * float(rng.uniform(-1.0, 1.0)),
            right_radius=1.0 + config.wheel_mismatch * float(rng.uniform(-1.0, 1.0)),
            downhill_rad=float(rng.uniform(0.0, math.tau)),
        )

    def _apply(self, draw: Draw) -> None:
        """Make the model that of a draw: always from the nominal one, so that the same draw gives the same bits."""
        model, nominal = self._world.model, self._nominal
        self.draw = draw
        model.body_mass[:] = nominal.body_mass * draw.mass
        model.body_inertia[:] = nominal.body_inertia * draw.mass
        for pair in nominal.tyre_pairs:
            model.pair_friction[pair, :2] = nominal.grip * draw.friction
        for geom, factor in zip(nominal.wheel_geoms, (draw.left_radius, draw.right_radius), strict=True):
            radius_m = nominal.radius_m * factor
            model.geom_size[geom, 0] = radius_m
            model.geom_rbound[geom] = radius_m
            model.geom_aabb[geom, 3:] = radius_m
        slope = math.radians(self._config.tilt_deg)
        along = math.sin(slope)
        model.opt.gravity[:] = nominal.gravity_m_s2 * np.array(
            [along * math.cos(draw.downhill_rad), along * math.sin(draw.downhill_rad), -math.cos(slope)]
        )
        scratch = mujoco.MjData(model)
        mujoco.mj_setConst(model, scratch)
        self._world.settle(scratch)


class _Nominal:
    """The model's own figures, copied before anything changes them."""

    def __init__(self, model: Any) -> None:
        self.body_mass = model.body_mass.copy()
        self.body_inertia = model.body_inertia.copy()
        self.tyre_pairs = [model.pair(f"{wheel}_floor").id for wheel in names.WHEEL_CONTACTS]
        self.grip = float(model.pair_friction[self.tyre_pairs[0], 0])
        self.wheel_geoms = [model.geom(wheel).id for wheel in names.WHEEL_CONTACTS]
        self.radius_m = float(model.geom_size[self.wheel_geoms[0], 0])
        self.gravity_m_s2 = float(np.linalg.norm(model.opt.gravity))
