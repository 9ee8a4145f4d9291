"""Whole decisions of a disturbed robot, of one that finds its own place, and of one whose body or world fails."""

from __future__ import annotations

import dataclasses
import math

import mujoco
import numpy as np
import pytest

from scla_mj.config import ControllerConfig, GridConfig, RunConfig
from scla_mj.control.motion import RETURNED, Gains
from scla_mj.disturbances import SETS, DisturbanceConfig, with_sets
from scla_mj.engine.account import Account
from scla_mj.engine.build import simulate
from scla_mj.errors import SclaError
from scla_mj.grid import Cell
from scla_mj.runs.decisions import row
from scla_mj.signals import Outcome


def make(*sets, seed=0, brain="random", timeout_s=10.0, **settings):
    controller = dataclasses.replace(ControllerConfig(), timeout_s=timeout_s)
    disturbance = with_sets(DisturbanceConfig(), sets)
    return simulate(
        RunConfig(seed=seed, brain=brain, telemetry="off", disturbance=disturbance, controller=controller, **settings)
    )


def steps(simulation, count):
    """Make decisions; whatever happens to the robot, each takes its brain's window at least."""
    records, ends_s = [], []
    for _ in range(count):
        records.append(simulation.step())
        ends_s.append(simulation.time_s)
    window_s = simulation.config.clock.thinking_window_s
    durations_s = np.diff([records[0].time_s, *ends_s])
    assert np.allclose(durations_s, [window_s + record.move.duration_s for record in records])
    assert (durations_s >= window_s - 1e-9).all()
    assert [record.time_s for record in records[1:]] == ends_s[:-1]
    return records


def table(records):
    return [repr(row(record)) for record in records]


@pytest.mark.parametrize("name", SETS)
def test_under_each_disturbance_moves_end_in_the_right_cell_or_are_reported(name):
    simulation = make(name, seed=4)
    failed = 0
    for record in steps(simulation, 120):
        move = record.move
        failed += move.outcome == Outcome.FAILED
        if move.outcome != Outcome.FAILED:
            assert move.after == simulation.world.grid.after(record.percept.cell, record.executed)
        assert simulation.world.can_drive()
    assert failed <= 2


@pytest.mark.parametrize("localisation", ["truth", "sensors"])
def test_under_all_disturbances_the_robot_knows_its_cell_and_one_move_in_a_hundred_may_fail(localisation):
    """At the measured one failure in 1500 moves, two or more in 200 have a chance of 1 in 130."""
    simulation = make("all", seed=1, brain="shortest-path", localisation=localisation)
    records = steps(simulation, 200)
    assert sum(record.move.outcome == Outcome.FAILED for record in records) <= 1
    if localisation == "sensors":
        assert all(record.localised.right_cell for record in records)
        assert np.mean([record.localised.error_m for record in records]) < 0.01


def test_a_wheel_that_spins_on_ice_follows_its_command():
    """It has nothing to turn it faster: its rim stays between the floor's speed and the commanded one."""
    settings = DisturbanceConfig(friction_scale=(0.3, 0.3), mass_scale=(0.7, 0.7), command_noise=0.3)
    simulation = simulate(RunConfig(seed=1, brain="random", telemetry="off", disturbance=settings))
    for record in steps(simulation, 20):
        rows = record.move.trajectory
        turning = np.abs(np.diff(rows[:, 8:10], axis=0)) / np.diff(rows[:, 0])[:, None]
        assert turning.max() < 1.2 * max(np.abs(rows[:, 10:]).max(), 1.0)


@pytest.mark.parametrize("side_deg", range(0, 360, 45))
def test_the_strongest_push_tips_over_no_robot_that_stands(side_deg):
    simulation = make("pushes", seed=1, localisation="sensors")
    perturbation, heading = simulation.task._randomisation.perturbation, simulation.world.pose().heading_rad
    side = heading + math.radians(side_deg)
    perturbation.push[:] = *(perturbation.strongest_push_n[0] * np.array([math.cos(side), math.sin(side)])), 10
    record = steps(simulation, 1)[0]
    assert not record.move.fallen
    assert record.move.outcome != Outcome.FAILED


def test_a_robot_that_leans_stands_until_it_can_measure():
    simulation = make(localisation="sensors")
    driver, world = simulation.task._driver, simulation.world
    lean = math.radians(8.0)
    world.data.qpos[3:7] = math.cos(lean / 2), 0.0, math.sin(lean / 2), 0.0
    driver.hold(1)
    assert world.pose().upright < math.cos(math.radians(3.0))
    assert 0 < driver._stand_level(100) < 50
    assert world.pose().upright >= math.cos(math.radians(3.0))


def test_a_touch_of_a_robot_that_was_astray_is_not_taken_for_a_wall_in_its_way(monkeypatch):
    """The rays move its place by more than a twelfth of a cell: it may have brushed the wall beside it."""
    driver, cell = (simulation := make(localisation="sensors")).task._driver, simulation.task.percept.cell
    action = next(action for action, _ in simulation.task.grid.neighbours(cell))
    driven, corrections, run = [], iter([0.06, 0.0]), driver._run

    def touch_first(goal, limit, *, standing=0):
        periods, status = run(goal, limit, standing=standing)
        if limit:
            driven.append(goal)
        return periods, RETURNED if limit and len(driven) == 1 else status

    monkeypatch.setattr(driver, "_look", lambda: next(corrections))
    monkeypatch.setattr(driver, "_run", touch_first)
    move = driver.drive(action, cell)
    assert driven == [driven[0]] * 2
    assert move.outcome is Outcome.MOVED


def test_dead_reckoning_drifts_and_says_so():
    def errors(kind):
        return [record.localised.error_m for record in steps(make("wheels", seed=2, localisation=kind), 60)]

    assert max(errors("odometry")) > 2 * max(errors("sensors"))


def test_the_target_is_sensed_where_it_truly_is():
    simulation = make(localisation="odometry")
    simulation.task._localiser.odometer.estimate[:2] += 0.30
    pose, percept = simulation.world.pose(), simulation.task._sense()
    true, believed = (
        simulation.task.grid.cell_at(pose.x_m, pose.y_m),
        simulation.task.grid.cell_at(*simulation.task._localiser.position_m()),
    )
    assert (percept.cell, percept.sensed) == (believed, simulation.task.grid.sensed_from(true))
    assert not simulation.task._localiser.error().right_cell


@pytest.mark.parametrize("localisation", ["truth", "odometry", "sensors"])
def test_a_disturbed_run_is_the_same_again_and_goes_on_from_a_state(localisation):
    whole = make("all", seed=3, localisation=localisation)
    expected = table(steps(whole, 24))
    simulation = make("all", seed=3, localisation=localisation)
    assert table(steps(simulation, 12)) == expected[:12]
    resumed = make("all", seed=3, localisation=localisation)
    resumed.restore(simulation.state())
    assert table(steps(resumed, 12)) == expected[12:]


def test_a_disturbance_shifts_no_other_stream():
    """Grip alone does not move a robot that stands: the first decision is that of the undisturbed run."""
    assert table(steps(make("latency"), 1))[0].split(",")[3:9] == table(steps(make(), 1))[0].split(",")[3:9]


def test_a_command_arrives_one_period_late():
    on_time, late = (make(*sets, seed=6, brain="shortest-path") for sets in ((), ("latency",)))
    first, second = (steps(simulation, 1)[0].move.trajectory for simulation in (on_time, late))
    started = [int(np.flatnonzero(rows[:, 10:].any(axis=1))[0]) for rows in (first, second)]
    assert started[1] == started[0] + 1


@pytest.mark.parametrize("wheel", [6, 7])
def test_a_jammed_wheel_fails_every_move_and_the_robot_is_put_down_elsewhere(wheel):
    simulation = make(seed=1, timeout_s=1.0)
    simulation.world.model.dof_frictionloss[wheel] = 100.0
    mujoco.mj_setConst(simulation.world.model, mujoco.MjData(simulation.world.model))
    moves = [record.move for record in steps(simulation, 4)]
    assert {move.outcome for move in moves} == {Outcome.FAILED}
    assert [move.fallen for move in moves] == [False, False, True, False]
    assert all(move.duration_s <= 1.0 for move in moves)


def test_a_robot_that_is_tipped_over_is_reported_and_drives_on_from_elsewhere():
    simulation = make(seed=1)
    simulation.world.data.xfrc_applied[1, 3:5] = 5.0
    first, second = steps(simulation, 2)
    assert (first.move.outcome, first.move.fallen, first.hit) == (Outcome.FAILED, True, False)
    assert second.move.outcome != Outcome.FAILED


@pytest.mark.parametrize("localisation", ["truth", "sensors"])
def test_a_robot_that_lies_when_it_is_put_down_fails_after_its_brains_window(localisation):
    simulation = make(seed=0, localisation=localisation)
    window_s = simulation.config.clock.thinking_window_s
    for _ in range(3):
        simulation.world.data.qpos[3:7] = (0.7, 0.7, 0.0, 0.0)
        (lying,) = steps(simulation, 1)
        assert (lying.move.outcome, lying.move.fallen, lying.move.duration_s) == (Outcome.FAILED, True, 0.0)
    assert simulation.time_s == pytest.approx(3 * window_s)


def while_thinking(simulation, happens):
    """Let something happen to the robot once, while it makes up its mind."""
    decide = simulation.brain.decide

    def decide_and_suffer(percept):
        simulation.brain.decide = decide
        happens()
        return decide(percept)

    simulation.brain.decide = decide_and_suffer


@pytest.mark.parametrize(("array", "index"), [("qvel", 0), ("qvel", 6), ("qpos", 0), ("qpos", 2), ("qpos", 4)])
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_state_that_is_not_a_number_is_reported_and_recovered_from(array, index, value):
    simulation = make(seed=1)
    steps(simulation, 2)
    while_thinking(simulation, lambda: getattr(simulation.world.data, array).__setitem__(index, value))
    broken, sound = steps(simulation, 2)
    assert (broken.move.outcome, broken.move.fallen, broken.hit) == (Outcome.FAILED, True, False)
    assert sound.move.outcome != Outcome.FAILED
    assert simulation.world.faults() == []


def test_a_robot_that_has_lost_its_place_is_reported_and_told_a_new_one():
    simulation = make(seed=1, localisation="sensors")
    while_thinking(simulation, lambda: simulation.task._localiser.odometer.estimate.__setitem__(0, math.nan))
    lost, found = steps(simulation, 2)
    assert (lost.move.outcome, lost.move.fallen) == (Outcome.FAILED, True)
    assert found.move.outcome != Outcome.FAILED
    assert found.localised.error_m < 1e-9


def test_a_robot_that_believes_to_be_inside_a_wall_moves_on_and_counts_for_nothing_as_it_falls():
    closed = tuple((x, y) for x in (1, 2, 3) for y in (1, 2, 3))
    grid = GridConfig(target=(5, 5), closed_cells=closed)
    simulation = simulate(RunConfig(brain="shortest-path", localisation="odometry", grid=grid))
    account = Account(simulation.config)
    for falls in (False, True):
        simulation.task._localiser.odometer.estimate[:2] = simulation.task.grid.centre_m(Cell(2, 2))
        simulation.task._percept = None
        simulation.world.data.qpos[3:7] = (0.7, 0.7, 0.0, 0.0) if falls else (1.0, 0.0, 0.0, 0.0)
        record = simulation.step()
        account.add(record, simulation.time_s)
        assert (record.percept.cell, record.move.fallen) == ((2, 2), falls)
    assert account.epoch(1).moves_beyond >= 1


def test_a_command_that_is_not_a_number_fails_and_reaches_no_wheel():
    simulation = make(seed=1)
    gains = simulation.task._driver._robot[-1]
    gains[Gains._fields.index("wheel_radius_m")] = math.nan
    record = steps(simulation, 1)[0]
    assert record.move.outcome == Outcome.FAILED
    assert not np.isnan(simulation.world.data.ctrl).any()


def test_a_warning_of_mujoco_stops_the_run_with_a_sentence():
    simulation = make(seed=1)
    simulation.world.data.warning[int(mujoco.mjtWarning.mjWARN_CONTACTFULL)].number = 1
    with pytest.raises(SclaError, match="CONTACTFULL"):
        steps(simulation, 1)


def test_mujoco_resetting_itself_stops_the_run_with_a_sentence():
    simulation = make(seed=1)
    mujoco.mj_resetData(simulation.world.model, simulation.world.data)
    simulation.world.data.qpos[:] = simulation.world._resting_qpos
    simulation.world.steps = 500
    with pytest.raises(SclaError, match="reset itself"):
        steps(simulation, 1)
