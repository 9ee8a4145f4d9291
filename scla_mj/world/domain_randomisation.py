"""Domain randomisation: grip, mass, wheel radii and tilt of the ground, drawn for every episode."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import mujoco
import numpy as np

from scla_mj.disturbances import DisturbanceConfig
from scla_mj.world.perturbation import make_perturbation
from scla_mj.world.world import World

_SURELY: Final = 0.99
"""Of a motor's torque, so that rounding does not reach its limit."""


class Draw(NamedTuple):
    """The parameters of one episode: factors on grip, mass and each wheel's radius, and the downhill direction."""

    friction: float = 1.0
    mass: float = 1.0
    left_radius: float = 1.0
    right_radius: float = 1.0
    downhill_rad: float = 0.0


class DomainRandomisation:
    """Draws the world's physical parameters for each episode; the controller keeps the nominal ones.

    Attributes:
        draw: the parameters as they are now.
        perturbation: what perturbs the drives of an episode, for the compiled loop; None where nothing does.
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
        self._nominal = _Nominal(world)
        self.draw = Draw()
        self.perturbation = make_perturbation(
            config,
            control_period_s=control_period_s,
            external_force=world.data.xfrc_applied[world.at.chassis],
            torque_reach_rad_s=_SURELY * world.dimensions.torque_reach_rad_s,
            rng=drive_rng,
        )

    def renew(self) -> None:
        """Draw new physical parameters; call spawn afterwards, as the robot then rests at another height."""
        if self._changes_model:
            self._apply(self._drawn())
        if self.perturbation is not None:
            self.perturbation.late[:] = 0.0
            self.perturbation.push[:] = 0.0
            mass_kg = float(self._world.model.body_mass.sum())
            self.perturbation.strongest_push_n[0] = self._config.push_n_per_kg * mass_kg

    def state(self) -> dict[str, Any]:
        """Return all that `restore` needs."""
        state: dict[str, Any] = {"draw": list(self.draw), "model_rng": self._rng.bit_generator.state}
        if self.perturbation is not None:
            state["late"] = self.perturbation.late.copy()
            state["push"] = self.perturbation.push.copy()
            state["strongest_push_n"] = self.perturbation.strongest_push_n.copy()
            state["drive_rng"] = self.perturbation.rng.bit_generator.state
        return state

    def restore(self, state: dict[str, Any]) -> None:
        """Resume from a `state`, bit-identically: the model and the perturbation; the world restores its own state."""
        self._rng.bit_generator.state = state["model_rng"]
        if self._changes_model:
            self._apply(Draw(*state["draw"]))
        if self.perturbation is not None:
            self.perturbation.late[:] = state["late"]
            self.perturbation.push[:] = state["push"]
            self.perturbation.strongest_push_n[:] = state["strongest_push_n"]
            self.perturbation.rng.bit_generator.state = state["drive_rng"]

    def _drawn(self) -> Draw:
        """Draw every parameter every time, so that the draws of one set do not depend on the others."""
        config, rng = self._config, self._rng
        return Draw(
            friction=float(rng.uniform(*config.friction_scale)),
            mass=float(rng.uniform(*config.mass_scale)),
            left_radius=1.0 + config.wheel_mismatch * float(rng.uniform(-1.0, 1.0)),
            right_radius=1.0 + config.wheel_mismatch * float(rng.uniform(-1.0, 1.0)),
            downhill_rad=float(rng.uniform(0.0, math.tau)),
        )

    def _apply(self, draw: Draw) -> None:
        """Set the model to a draw, always from the nominal model, so that the same draw gives the same bits."""
        model, nominal = self._world.model, self._nominal
        self.draw = draw
        model.body_mass[:] = nominal.body_mass * draw.mass
        model.body_inertia[:] = nominal.body_inertia * draw.mass
        model.pair_friction[nominal.grips, :2] = nominal.grip * draw.friction
        for geom, factor in zip(nominal.tyres, (draw.left_radius, draw.right_radius), strict=True):
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
    """The nominal parameters of the model, copied before anything changes them."""

    def __init__(self, world: World) -> None:
        model, at = world.model, world.at
        self.body_mass = model.body_mass.copy()
        self.body_inertia = model.body_inertia.copy()
        self.tyres = (at.left_tyre, at.right_tyre)
        self.grips = np.flatnonzero(np.isin(model.pair_geom2, self.tyres))
        self.grip = model.pair_friction[self.grips, :2].copy()
        self.radius_m = float(model.geom_size[at.left_tyre, 0])
        self.gravity_m_s2 = float(np.linalg.norm(model.opt.gravity))
