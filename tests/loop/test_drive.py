"""Whole moves in real physics."""

from __future__ import annotations

import dataclasses
import math

import mujoco
import numpy as np
import pytest

from scla_mj.clock import resolve_clock
from scla_mj.config import ClockConfig, ControllerConfig
from scla_mj.grid import Action, Cell, Grid
from scla_mj.loop.drive import Driver
from scla_mj.signals import TRAJECTORY_COLUMNS, Outcome
from scla_mj.world.world import World

CLOCK = resolve_clock(ClockConfig())
GRID = Grid((5, 5), Cell(3, 3), 0.30)


def make_driver(grid=GRID, clock=CLOCK, **controller):
    world = World(grid, clock)
    return world, Driver(world, clock, dataclasses.replace(ControllerConfig(), **controller))


def yaw(qpos):
    w, x, y, z = qpos[3:7]
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def random_walk(driver, world, count, seed=0):
    rng = np.random.default_rng(seed)
    cell = Cell(3, 3)
    world.spawn(cell, 0.0)
    for _ in range(count):
        action = Action(int(rng.integers(4)))
        driver.hold(CLOCK.thinking_controls)
        move = driver.drive(action, cell)
        yield action, move
        cell = move.after


def test_the_axle_crosses_when_its_trajectory_first_lies_in_the_next_cell_and_a_wall_is_never_crossed():
    world, driver = make_driver()
    for _, move in random_walk(driver, world, 30):
        driven = move.trajectory[-round(move.duration_s / CLOCK.control_period_s) :]
        cells = [GRID.cell_at(x, y) for x, y in driven[:, 1:3]]
        if move.outcome is Outcome.BLOCKED:
            assert move.crossed_s is None and set(cells) == {move.before}
        else:
            period = round(move.crossed_s / CLOCK.control_period_s)
            assert cells[period - 1 :] == [move.after] * (len(cells) - period + 1)
            assert set(cells[: period - 1]) == {move.before}


@pytest.mark.parametrize("heading", [0.0, math.pi / 2])
def test_every_action_from_every_cell_ends_in_the_right_cell(heading):
    world, driver = make_driver()
    for cell in GRID.open_cells():
        for action in Action:
            world.spawn(cell, heading)
            driver.hold(CLOCK.thinking_controls)
            move = driver.drive(action, cell)
            beyond = GRID.after(cell, action)
            assert (move.before, move.after) == (cell, beyond)
            assert move.outcome == (Outcome.MOVED if beyond != cell else Outcome.BLOCKED)
            assert move.position_error_m <= 0.003
            assert abs(move.heading_error_rad) < 0.02
            assert not move.fallen
            assert world.faults() == []


def test_errors_do_not_add_up_over_a_long_walk():
    world, driver = make_driver()
    moves = [move for _, move in random_walk(driver, world, 600)]
    assert all(move.outcome in (Outcome.MOVED, Outcome.BLOCKED) for move in moves)
    assert max(move.position_error_m for move in moves) <= 0.003
    assert np.mean([move.duration_s for move in moves]) < 0.92
    assert world.faults() == []


def test_a_closed_cell_blocks_like_a_wall():
    grid = Grid((3, 3), Cell(3, 3), 0.30, frozenset({Cell(2, 2)}))
    world, driver = make_driver(grid)
    for action, cell in (
        (Action.RIGHT, Cell(1, 2)),
        (Action.UP, Cell(2, 1)),
        (Action.LEFT, Cell(3, 2)),
        (Action.DOWN, Cell(2, 3)),
    ):
        for heading in (0.0, math.pi / 2, math.pi, -math.pi / 2):
            world.spawn(cell, heading)
            move = driver.drive(action, cell)
            assert (move.outcome, move.after) == (Outcome.BLOCKED, cell)
            assert move.position_error_m <= 0.003


def test_a_move_on_the_axis_it_stands_on_needs_no_turn():
    world, driver = make_driver()
    for action in (Action.RIGHT, Action.LEFT):
        world.spawn(Cell(3, 3), 0.0)
        move = driver.drive(action, Cell(3, 3))
        headings = [yaw(row[1:8]) for row in move.trajectory]
        assert np.abs(headings).max() < 0.01
        assert move.outcome == Outcome.MOVED


def test_moves_turn_as_they_would_at_a_half_millisecond_step():
    world, driver = make_driver()
    fine_clock = resolve_clock(ClockConfig(base_step_ms=0.5, physics_step_ms=0.5))
    fine = World(GRID, fine_clock)
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(world.model, kind))
    rng, cell, slips = np.random.default_rng(1), Cell(3, 3), []
    world.spawn(cell, 0.0)
    for _ in range(60):
        mujoco.mj_getState(world.model, world.data, state, kind)
        driver.hold(CLOCK.thinking_controls)
        move = driver.drive(Action(int(rng.integers(4))), cell)
        mujoco.mj_setState(fine.model, fine.data, state, kind)
        for row in move.trajectory:
            fine.data.ctrl[:] = row[10:12]
            mujoco.mj_step(fine.model, fine.data, nstep=fine_clock.physics_steps_per_control)
        slips.append(math.remainder(yaw(fine.data.qpos) - yaw(world.data.qpos), math.tau))
        cell = move.after
    assert math.degrees(np.abs(slips).mean()) < 0.05


def test_the_trajectory_covers_thinking_and_driving_and_time_never_falls():
    world, driver = make_driver()
    periods = 0
    for _, move in random_walk(driver, world, 5):
        rows = move.trajectory
        drive_periods = round(move.duration_s / CLOCK.control_period_s)
        assert rows.shape == (CLOCK.thinking_controls + drive_periods, len(TRAJECTORY_COLUMNS))
        assert rows[:, 0] == pytest.approx((np.arange(len(rows)) + periods + 1) * CLOCK.control_period_s)
        assert (rows[: CLOCK.thinking_controls, 10:] == 0).all()
        assert (rows[-1, 1:10] == world.data.qpos).all()
        periods += len(rows)
    assert driver.periods == periods
    world.spawn(Cell(1, 1), 0.0)
    driver.hold(3)
    assert driver.time_s == pytest.approx((periods + 3) * CLOCK.control_period_s)


def test_the_compiled_loop_steps_physics_like_mujoco_itself():
    world, driver = make_driver()
    world.spawn(Cell(2, 2), 0.0)
    move = driver.drive(Action.UP, Cell(2, 2))
    oracle = World(GRID, CLOCK)
    oracle.spawn(Cell(2, 2), 0.0)
    for row in move.trajectory:
        oracle.data.ctrl[:] = row[10:12]
        mujoco.mj_step(oracle.model, oracle.data)
        assert (oracle.data.qpos == row[1:10]).all()
    assert oracle.data.time == world.data.time


def test_the_same_calls_give_the_same_bits():
    walks = []
    for _ in range(2):
        world, driver = make_driver()
        walks.append(np.vstack([move.trajectory for _, move in random_walk(driver, world, 20)]))
    assert (walks[0] == walks[1]).all()


def test_a_spawn_forgets_everything_that_came_before_it():
    world, driver = make_driver()
    world.spawn(Cell(2, 2), 0.0)
    first = driver.drive(Action.UP, Cell(2, 2)).trajectory[:, 1:]
    list(random_walk(driver, world, 7))
    world.spawn(Cell(2, 2), 0.0)
    assert (driver.drive(Action.UP, Cell(2, 2)).trajectory[:, 1:] == first).all()


def test_a_move_that_takes_too_long_has_failed():
    world, driver = make_driver(timeout_s=0.2)
    world.spawn(Cell(3, 3), 0.0)
    move = driver.drive(Action.RIGHT, Cell(3, 3))
    assert (move.outcome, move.after, move.fallen) == (Outcome.FAILED, Cell(3, 3), False)
    assert move.duration_s == pytest.approx(0.2)


def test_a_fallen_robot_fails_and_says_so():
    world, driver = make_driver()
    world.spawn(Cell(3, 3), 0.0)
    world.data.qpos[2:7] = 0.12, math.cos(math.pi / 4), math.sin(math.pi / 4), 0, 0
    move = driver.drive(Action.RIGHT, Cell(3, 3))
    assert (move.outcome, move.fallen, move.duration_s) == (Outcome.FAILED, True, 0.0)


def test_a_state_that_is_not_a_number_fails_and_commands_nothing():
    world, driver = make_driver()
    world.spawn(Cell(3, 3), 0.0)
    world.data.qvel[:] = math.nan
    move = driver.drive(Action.RIGHT, Cell(3, 3))
    assert move.outcome == Outcome.FAILED
    assert not np.isnan(world.data.ctrl).any()


def test_a_pushed_robot_aims_again_and_arrives():
    world, driver = make_driver()
    world.spawn(Cell(3, 3), 0.0)
    world.data.qpos[:2] += 0.29, 0.05  # beside the end of its line, where steering alone cannot help
    mujoco.mj_forward(world.model, world.data)
    move = driver.drive(Action.RIGHT, Cell(3, 3))
    assert (move.outcome, move.after) == (Outcome.MOVED, Cell(4, 3))
    assert move.position_error_m < 0.08 * 0.30


@pytest.mark.parametrize("control_period_ms", [20.0, 50.0])
def test_a_slower_controller_still_arrives(control_period_ms):
    clock = resolve_clock(ClockConfig(control_period_ms=control_period_ms, thinking_window_ms=100.0))
    world, driver = make_driver(clock=clock)
    for action in Action:
        world.spawn(Cell(3, 3), 0.0)
        move = driver.drive(action, Cell(3, 3))
        assert (move.outcome, move.after) == (Outcome.MOVED, GRID.after(Cell(3, 3), action))
