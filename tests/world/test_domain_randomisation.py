"""Domain randomisation and perturbations against closed forms: what changes acts as physics says, and nothing else
changes."""

from __future__ import annotations

import dataclasses
import math

import mujoco
import numpy as np
import pytest
from numba import njit

from scla_mj.clock import resolve_clock
from scla_mj.config import ClockConfig
from scla_mj.disturbances import PUSH_EVERY_S, PUSH_S, DisturbanceConfig, with_sets
from scla_mj.grid import Cell, Grid
from scla_mj.world.domain_randomisation import DomainRandomisation
from scla_mj.world.perturbation import perturb
from scla_mj.world.world import World

CLOCK = resolve_clock(ClockConfig())
GRAVITY = 9.81


@njit
def compiled_perturb(perturbation, left, right):
    return perturb(perturbation, left, right)


def make(seed=0, cells=(21, 21), **settings):
    world = World(Grid(cells, Cell(3, 3), 0.30), CLOCK)
    return world, randomise(world, seed, **settings)


def randomise(world, seed=0, **settings):
    return DomainRandomisation(
        world,
        DisturbanceConfig(**settings),
        control_period_s=CLOCK.control_period_s,
        model_rng=np.random.default_rng(seed),
        drive_rng=np.random.default_rng(seed + 1),
    )


def respawn(world, randomisation, heading=0.0):
    randomisation.renew()
    world.spawn(Cell(11, 11), heading)


def weight_on_the_floor(world):
    mujoco.mj_step(world.model, world.data, nstep=50)
    force, total = np.zeros(6), 0.0
    for i in range(world.data.ncon):
        mujoco.mj_contactForce(world.model, world.data, i, force)
        total += force[0]
    return total


def load_on_the_tyres(world):
    """The force, in newtons, with which the two tyres press on the floor."""
    force, load = np.zeros(6), 0.0
    for i, contact in enumerate(world.data.contact):
        mujoco.mj_contactForce(world.model, world.data, i, force)
        load += force[0] if contact.geom2 in (world.at.left_tyre, world.at.right_tyre) else 0.0
    return load


def velocity_of_the_mass(world):
    mujoco.mj_subtreeVel(world.model, world.data)
    return world.data.subtree_linvel[0].copy()


@pytest.mark.parametrize("scale", [0.3, 0.6])
def test_a_sliding_robot_loses_the_momentum_that_scaled_friction_takes(scale):
    """Locked wheels slide: m dv = mu times the tyres' load times dt, the caster being free of friction."""
    world, randomisation = make(friction_scale=(scale, scale))
    respawn(world, randomisation)
    world.model.dof_damping[6:8] = 100.0
    world.data.qvel[0] = -2.0
    mujoco.mj_step(world.model, world.data, nstep=20)
    before, impulse = velocity_of_the_mass(world), 0.0
    for _ in range(40):
        mujoco.mj_step(world.model, world.data)
        impulse += scale * load_on_the_tyres(world) * world.model.opt.timestep
    lost = np.linalg.norm((velocity_of_the_mass(world) - before)[:2]) * world.model.body_mass.sum()
    assert lost == pytest.approx(impulse, rel=0.03)
    assert impulse > 0.2


@pytest.mark.parametrize("scale", [0.7, 1.3])
def test_the_floor_carries_the_scaled_weight(scale):
    world, randomisation = make(mass_scale=(scale, scale))
    nominal_kg = world.model.body_mass.sum()
    respawn(world, randomisation)
    assert weight_on_the_floor(world) == pytest.approx(scale * nominal_kg * GRAVITY, rel=1e-6)


def test_a_heavier_robot_is_as_hard_to_turn_as_it_is_heavy():
    """The joint-space inertia is linear in the bodies' masses, rotors and all."""
    world, randomisation = make(mass_scale=(1.3, 1.3))
    plain = World(Grid((21, 21), Cell(3, 3), 0.30), CLOCK)
    respawn(world, randomisation)
    plain.spawn(Cell(11, 11), 0.0)
    accelerations = np.random.default_rng(0).normal(size=world.model.nv)
    heavy, nominal = np.zeros(world.model.nv), np.zeros(world.model.nv)
    mujoco.mj_mulM(world.model, world.data, heavy, accelerations)
    mujoco.mj_mulM(plain.model, plain.data, nominal, accelerations)
    assert heavy == pytest.approx(1.3 * nominal, rel=1e-3)
    assert world.model.body_subtreemass[0] == pytest.approx(1.3 * plain.model.body_subtreemass[0])


def test_a_tilted_floor_pulls_at_g_times_the_sine_of_its_slope():
    world, randomisation = make(tilt_deg=2.0)
    respawn(world, randomisation)
    along, across, down = world.model.opt.gravity
    assert math.hypot(along, across) == pytest.approx(GRAVITY * math.sin(math.radians(2.0)))
    assert down == pytest.approx(-GRAVITY * math.cos(math.radians(2.0)))
    for pair in range(world.model.npair):
        world.model.pair_friction[pair, :2] = 1e-9
    world.data.qvel[:] = 0.0
    mujoco.mj_step(world.model, world.data, nstep=20)
    speed = math.hypot(*world.data.qvel[:2])
    assert speed == pytest.approx(0.2 * GRAVITY * math.sin(math.radians(2.0)), rel=0.02)


def test_the_floor_falls_any_way():
    world, randomisation = make(tilt_deg=2.0)
    ways = []
    for _ in range(400):
        randomisation.renew()
        ways.append(math.atan2(world.model.opt.gravity[1], world.model.opt.gravity[0]))
    assert np.histogram(ways, bins=4, range=(-math.pi, math.pi))[0] == pytest.approx(100, abs=40)


def test_unequal_wheels_drive_the_circle_of_their_radii():
    """Equal wheel speeds on radii r1, r2 a track apart: a circle of radius track / 2 (r2 + r1) / (r2 - r1)."""
    world, randomisation = make(seed=3, wheel_mismatch=0.05)
    respawn(world, randomisation)
    left, right = randomisation.draw.left_radius, randomisation.draw.right_radius
    assert abs(left - right) > 0.02
    world.data.ctrl[:] = 8.0, 8.0
    mujoco.mj_step(world.model, world.data, nstep=100)
    points = []
    for _ in range(900):
        mujoco.mj_step(world.model, world.data)
        points.append(world.pose()[:2])
    x, y = np.array(points).T
    solution, *_ = np.linalg.lstsq(np.column_stack([2 * x, 2 * y, np.ones_like(x)]), x**2 + y**2, rcond=None)
    radius = math.sqrt(solution[2] + solution[0] ** 2 + solution[1] ** 2)
    assert radius == pytest.approx(world.dimensions.track_m / 2 * (right + left) / abs(right - left), rel=0.05)


@pytest.mark.parametrize("seed", range(5))
def test_a_changed_robot_rests_where_it_is_put(seed):
    settings = dataclasses.asdict(with_sets(DisturbanceConfig(), ["friction", "mass", "wheels"]))
    world, randomisation = make(seed=seed, **settings)
    respawn(world, randomisation, heading=1.0)
    assert world.pose()[:3] == pytest.approx((0.0, 0.0, 1.0), abs=1e-9)
    fastest = 0.0
    for _ in range(50):
        mujoco.mj_step(world.model, world.data)
        fastest = max(fastest, np.abs(world.data.qvel).max())
    assert fastest < 2e-3


def test_a_push_gives_a_free_robot_its_force_times_its_time():
    world, randomisation = make(push_n_per_kg=8.0)
    respawn(world, randomisation)
    for pair in range(world.model.npair):
        world.model.pair_friction[pair, :2] = 1e-9
    push, mass_kg, force = randomisation.perturbation, world.model.body_mass.sum(), None
    before = world.data.qvel[:2].copy()
    for _ in range(2000):
        compiled_perturb(push, 0.0, 0.0)
        if push.push[2] > 0:
            force = force if force is not None else push.push[:2].copy()
        elif force is not None:
            break
        mujoco.mj_step(world.model, world.data)
    assert mass_kg * (world.data.qvel[:2] - before) == pytest.approx(force * PUSH_S, rel=0.05, abs=1e-3)
    assert (world.data.xfrc_applied == 0).all()


def test_pushes_come_as_often_as_stated_and_stay_within_their_strength():
    world, randomisation = make(push_n_per_kg=8.0, mass_scale=(1.3, 1.3))
    respawn(world, randomisation)
    push, periods, strengths = randomisation.perturbation, 40_000, []
    for _ in range(periods):
        was = push.push[2]
        compiled_perturb(push, 0.0, 0.0)
        if push.push[2] > was:
            strengths.append(math.hypot(*push.push[:2]))
    mass_kg = world.model.body_mass.sum()
    expected = periods * CLOCK.control_period_s / (PUSH_EVERY_S + PUSH_S)
    assert len(strengths) == pytest.approx(expected, rel=0.25)
    assert 0.9 * 8.0 * mass_kg < max(strengths) <= 8.0 * mass_kg


def test_command_noise_has_the_stated_spread_and_no_bias():
    _, randomisation = make(command_noise=0.3)
    told = np.array([compiled_perturb(randomisation.perturbation, 10.0, -5.0) for _ in range(20_000)])
    assert told.mean(axis=0) == pytest.approx([10.0, -5.0], rel=0.02)
    assert told.std(axis=0) == pytest.approx([3.0, 1.5], rel=0.03)
    assert abs(np.corrcoef(told.T)[0, 1]) < 0.03


@pytest.mark.parametrize("periods", [1, 3])
def test_latency_hands_a_command_on_exactly_that_many_periods_later(periods):
    world, randomisation = make(latency_periods=periods)
    respawn(world, randomisation)
    told = [compiled_perturb(randomisation.perturbation, float(i), -float(i)) for i in range(1, 10)]
    assert told == [(0.0, 0.0)] * periods + [(float(i), -float(i)) for i in range(1, 10 - periods)]


def test_the_same_seed_draws_the_same_robots_and_a_state_restores_one_bit_for_bit():
    settings = dataclasses.asdict(with_sets(DisturbanceConfig(), ["all"]))
    world, randomisation = make(seed=5, **settings)
    twin, other = make(seed=5, **settings)
    for _ in range(3):
        respawn(world, randomisation)
        respawn(twin, other)
        assert other.draw == randomisation.draw
    for _ in range(300):
        compiled_perturb(randomisation.perturbation, 4.0, 5.0)
    saved, late = randomisation.state(), make(seed=9, **settings)
    late[1].restore(saved)
    for array in ("body_mass", "body_inertia", "geom_size", "pair_friction", "dof_M0", "body_invweight0"):
        assert (getattr(late[0].model, array) == getattr(world.model, array)).all(), array
    ahead = [compiled_perturb(randomisation.perturbation, 4.0, 5.0) for _ in range(300)]
    assert [compiled_perturb(late[1].perturbation, 4.0, 5.0) for _ in range(300)] == ahead
    respawn(world, randomisation)
    respawn(late[0], late[1])
    assert (late[0].data.qpos == world.data.qpos).all()


def test_neutral_settings_draw_nothing_and_touch_nothing():
    world, randomisation = make()
    plain = World(Grid((21, 21), Cell(3, 3), 0.30), CLOCK)
    before = randomisation.state()
    respawn(world, randomisation)
    plain.spawn(Cell(11, 11), 0.0)
    assert randomisation.perturbation is None
    assert randomisation.state() == before
    assert (world.data.qpos == plain.data.qpos).all()
    assert (world.model.body_mass == plain.model.body_mass).all()


def test_one_sets_draws_do_not_depend_on_the_others():
    _, alone = make(seed=2, wheel_mismatch=0.05)
    _, together = make(seed=2, **dataclasses.asdict(with_sets(DisturbanceConfig(), ["all"])))
    for _ in range(5):
        alone.renew()
        together.renew()
        assert alone.draw[2:4] == together.draw[2:4]
