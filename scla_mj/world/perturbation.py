"""Perturbations of a drive, one control period at a time inside the compiled loop: noise and latency between the
controller's command and the wheels, and pushes on the chassis."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from scla_mj.disturbances import PUSH_EVERY_S, PUSH_S, DisturbanceConfig


class Perturbation(NamedTuple):
    """What perturbs a drive, as the compiled loop takes it; the arrays are what it remembers.

    `late` holds the commands on their way to the wheels, shape (latency_periods, 2), the oldest first. `push` is the
    horizontal force in newtons and the periods it still lasts, `strongest_push_n` (one value) the most it may be, and
    `external_force` MuJoCo's view of the force and torque on the chassis, shape (6,). `torque_reach_rad_s` is by how
    much a command may differ from its wheel's speed before the motor's torque is at its limit.
    """

    rng: np.random.Generator
    command_noise: float
    late: NDArray[np.float64]
    push: NDArray[np.float64]
    strongest_push_n: NDArray[np.float64]
    push_chance: float
    push_periods: int
    external_force: NDArray[np.float64]
    torque_reach_rad_s: float


def make_perturbation(
    config: DisturbanceConfig,
    *,
    control_period_s: float,
    external_force: NDArray[np.float64],
    torque_reach_rad_s: float,
    rng: np.random.Generator,
) -> Perturbation | None:
    """Return what perturbs a drive, or None where nothing does."""
    if not (config.command_noise or config.push_n_per_kg or config.latency_periods):
        return None
    return Perturbation(
        rng=rng,
        command_noise=float(config.command_noise),
        late=np.zeros((config.latency_periods, 2)),
        push=np.zeros(3),
        strongest_push_n=np.zeros(1),
        push_chance=min(1.0, control_period_s / PUSH_EVERY_S) if config.push_n_per_kg else 0.0,
        push_periods=max(1, round(PUSH_S / control_period_s)),
        external_force=external_force,
        torque_reach_rad_s=torque_reach_rad_s,
    )


@njit(inline="always")
def perturb(perturbation: Perturbation, left: float, right: float) -> tuple[float, float]:
    """Return the commands that reach the wheels in this period, in rad/s, and set the push that acts during it."""
    left, right = _late(perturbation.late, left, right)
    if perturbation.command_noise > 0.0:
        left *= 1.0 + perturbation.command_noise * perturbation.rng.standard_normal()
        right *= 1.0 + perturbation.command_noise * perturbation.rng.standard_normal()
    if perturbation.push_chance > 0.0:
        _push(perturbation)
    return left, right


@njit(inline="always")
def within_reach(perturbation: Perturbation, command: float, speed: float) -> float:
    """Return a command that asks a wheel of this speed for no more torque than its motor has.

    The torque is the same: MuJoCo limits it too. But where it does, it integrates the servo explicitly, and a wheel
    whose tyre does not grip overshoots its command by 40 rad/s in a 10 ms step, back and forth, so that the tyre does
    not grip again. In 1 ms steps it does not.
    """
    return min(max(command, speed - perturbation.torque_reach_rad_s), speed + perturbation.torque_reach_rad_s)


@njit(inline="always")
def _late(late: NDArray[np.float64], left: float, right: float) -> tuple[float, float]:
    """Queue a command and return the one that is due."""
    last = len(late) - 1
    if last < 0:
        return left, right
    due_left, due_right = late[0, 0], late[0, 1]
    for i in range(last):
        late[i, 0], late[i, 1] = late[i + 1, 0], late[i + 1, 1]
    late[last, 0], late[last, 1] = left, right
    return due_left, due_right


@njit(inline="always")
def _push(perturbation: Perturbation) -> None:
    """Continue a push, end it, or start one at random."""
    push, rng = perturbation.push, perturbation.rng
    push[2] = max(push[2] - 1.0, 0.0)
    if push[2] == 0.0:
        push[0], push[1] = 0.0, 0.0
        if rng.random() < perturbation.push_chance:
            strength_n = rng.random() * perturbation.strongest_push_n[0]
            side_rad = rng.random() * 2.0 * math.pi
            push[0], push[1] = strength_n * math.cos(side_rad), strength_n * math.sin(side_rad)
            push[2] = perturbation.push_periods
    perturbation.external_force[0], perturbation.external_force[1] = push[0], push[1]
