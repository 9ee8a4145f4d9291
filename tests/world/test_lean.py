"""The lean model that runs step is the full one without its looks: the same physics, bit for bit."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from scla_mj.clock import resolve_clock
from scla_mj.config import ClockConfig, ControllerConfig
from scla_mj.disturbances import DisturbanceConfig, with_sets
from scla_mj.grid import Action, Cell, Grid
from scla_mj.loop.drive import Driver
from scla_mj.signals import Outcome
from scla_mj.world import names
from scla_mj.world.domain_randomisation import DomainRandomisation
from scla_mj.world.world import World

CLOCK = resolve_clock(ClockConfig())
OPEN = Grid((3, 3), Cell(3, 3), 0.30)
CLOSED = Grid((3, 3), Cell(3, 3), 0.30, frozenset({Cell(2, 2)}))
STATE = mujoco.mjtState.mjSTATE_INTEGRATION


def walk(world, sets=()):
    """Drive 40 random moves in two episodes; return their outcomes, and the bits of their trajectories and states."""
    randomisation = DomainRandomisation(
        world,
        with_sets(DisturbanceConfig(), sets),
        control_period_s=CLOCK.control_period_s,
        model_rng=np.random.default_rng(1),
        drive_rng=np.random.default_rng(2),
    )
    driver = Driver(world, CLOCK, ControllerConfig(), perturbation=randomisation.perturbation)
    rng, outcomes, bits = np.random.default_rng(0), [], []
    for cell in (Cell(1, 1), Cell(3, 1)):
        randomisation.renew()
        world.spawn(cell, 0.0)
        for _ in range(20):
            move = driver.drive(Action(int(rng.integers(4))), cell, standing=CLOCK.thinking_controls)
            outcomes.append(move.outcome)
            bits += [move.trajectory.tobytes(), world.state()["physics"].tobytes()]
            cell = move.after
    return outcomes, bits


@pytest.mark.parametrize(
    ("grid", "sets"), [(OPEN, ()), (CLOSED, ()), (OPEN, ["all"])], ids=["open", "closed", "disturbed"]
)
def test_lean_and_full_models_move_to_the_same_bits(grid, sets):
    outcomes, bits = walk(World(grid, CLOCK), sets)
    assert {Outcome.MOVED, Outcome.BLOCKED} <= set(outcomes)
    assert (outcomes, bits) == walk(World(grid, CLOCK, lean=False), sets)


@pytest.mark.parametrize("grid", [OPEN, CLOSED], ids=["open", "closed"])
def test_a_world_compiles_nothing_that_is_only_for_looks(grid):
    lean, full = World(grid, CLOCK).model, World(grid, CLOCK, lean=False).model
    assert (lean.ntex, lean.nmat, lean.nlight, lean.ncam) == (0, 0, 0, 0)
    assert [lean.geom(int(i)).name for i in np.flatnonzero(lean.geom_group == names.VISUAL_GROUP)] == [names.FLOOR]
    assert (full.ntex, full.nmat, full.nlight, full.ncam) == (2, 17, 2, 2)
    assert lean.nbuffer < full.nbuffer / 50


@pytest.mark.parametrize("grid", [OPEN, CLOSED], ids=["open", "closed"])
def test_a_lean_model_has_the_mass_the_inertia_and_the_contacts_of_the_full_one(grid):
    lean, full = World(grid, CLOCK).model, World(grid, CLOCK, lean=False).model
    for array in ("body_mass", "body_inertia", "body_ipos", "body_iquat", "dof_M0", "body_invweight0", "qpos0"):
        assert (getattr(lean, array) == getattr(full, array)).all(), array
    assert contacts(lean) == contacts(full)
    touchable = {full.geom(i).name for i in range(full.ngeom) if full.geom_contype[i] | full.geom_conaffinity[i]}
    kept = {lean.geom(i).name for i in range(lean.ngeom) if lean.geom_contype[i] | lean.geom_conaffinity[i]}
    assert kept == (touchable if grid.closed else set())  # where nothing has a contact type, nothing meets an affinity
    assert bool(full.geom_contype.any()) == bool(grid.closed)


def contacts(model):
    """Every pair that can touch, by name, with its parameters."""
    pairs = [model.pair(i) for i in range(model.npair)]
    arrays = ("dim", "friction", "solref", "solimp", "margin", "gap")
    return {
        (pair.name, model.geom(pair.geom1[0]).name, model.geom(pair.geom2[0]).name): [
            np.array(getattr(model, f"pair_{array}")[pair.id]).tolist() for array in arrays
        ]
        for pair in pairs
    }


def test_the_model_to_draw_takes_the_worlds_states_and_has_the_target_where_it_is_now():
    world = World(OPEN, CLOCK)
    world.move_target(Grid(OPEN.cells, Cell(1, 2), OPEN.cell_size_m))
    drawable = world.drawable_model()
    assert mujoco.mj_stateSize(drawable, STATE) == mujoco.mj_stateSize(world.model, STATE)
    for name in (names.TARGET_DISC, names.TARGET_RING):
        assert drawable.geom(name).pos[:2] == pytest.approx(OPEN.centre_m(Cell(1, 2)))
    assert drawable.camera(names.TOP_CAMERA).id >= 0
