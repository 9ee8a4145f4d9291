"""Whole decisions of a disturbed robot, of one that finds its own place, and of one whose body or world fails."""

from __future__ import annotations

import dataclasses
import math

import mujoco
import numpy as np
import pytest

from scla_mj.config import ControllerConfig, RunConfig
from scla_mj.control.motion import Gains
from scla_mj.disturbances import SETS, DisturbanceConfig, with_sets
from scla_mj.errors import SclaError
from scla_mj.experiments.assemble import build_trial
from scla_mj.runs.decisions import row
from scla_mj.signals import Outcome


def make(*sets, seed=0, brain="random", timeout_s=10.0, **settings):
    controller = dataclasses.replace(ControllerConfig(), timeout_s=timeout_s)
    disturbance = with_sets(DisturbanceConfig(), sets)
    return build_trial(
        RunConfig(seed=seed, brain=brain, telemetry="off", disturbance=disturbance, controller=controller, **settings)
    )


def steps(trial, count, first=1):
    return [trial.step(epoch=1, decision=first + i) for i in range(count)]


def table(records):
    return [repr(row(record)) for record in records]


@pytest.mark.parametrize("name", SETS)
def test_under_each_disturbance_moves_end_in_the_right_cell_or_are_reported(name):
    trial = make(name, seed=4)
    failed = 0
    for record in steps(trial, 120):
        move = record.move
        failed += move.outcome == Outcome.FAILED
        if move.outcome != Outcome.FAILED:
            assert move.after == trial.world.grid.after(record.percept.cell, record.executed)
        assert trial.world.can_drive()
    assert failed <= 2


def test_under_all_disturbances_and_by_its_own_sensors_the_robot_always_knows_its_cell():
    trial = make("all", seed=1, localisation="sensors")
    records = steps(trial, 150)
    assert np.mean([record.localised.right_cell for record in records]) > 0.97
    assert np.mean([record.localised.error_m for record in records]) < 0.02
    assert np.mean([record.move.outcome == Outcome.FAILED for record in records]) < 0.15


def test_dead_reckoning_drifts_and_says_so():
    def errors(kind):
        return [record.localised.error_m for record in steps(make("wheels", seed=2, localisation=kind), 60)]

    assert max(errors("odometry")) > 2 * max(errors("sensors"))


def test_the_target_is_sensed_where_it_truly_is():
    trial = make(localisation="odometry")
    trial._localiser.odometer.estimate[:2] += 0.30
    pose, percept = trial.world.pose(), trial._sense()
    true, believed = trial._grid.cell_at(pose.x_m, pose.y_m), trial._grid.cell_at(*trial._localiser.position_m())
    assert (percept.cell, percept.sensed) == (believed, trial._grid.sensed_from(true))
    assert not trial._localiser.error().right_cell


@pytest.mark.parametrize("localisation", ["truth", "odometry", "sensors"])
def test_a_disturbed_run_is_the_same_again_and_goes_on_from_a_state(localisation):
    whole = make("all", seed=3, localisation=localisation)
    expected = table(steps(whole, 24))
    trial = make("all", seed=3, localisation=localisation)
    assert table(steps(trial, 12)) == expected[:12]
    resumed = make("all", seed=3, localisation=localisation)
    resumed.restore(trial.state())
    assert table(steps(resumed, 12, first=13)) == expected[12:]


def test_a_disturbance_shifts_no_other_stream():
    """Grip alone does not move a robot that stands: the first decision is that of the undisturbed run."""
    assert table(steps(make("latency"), 1))[0].split(",")[3:9] == table(steps(make(), 1))[0].split(",")[3:9]


def test_a_command_arrives_one_period_late():
    on_time, late = (make(*sets, seed=6, brain="shortest-path") for sets in ((), ("latency",)))
    first, second = (steps(trial, 1)[0].move.trajectory for trial in (on_time, late))
    started = [int(np.flatnonzero(rows[:, 10:].any(axis=1))[0]) for rows in (first, second)]
    assert started[1] == started[0] + 1


@pytest.mark.parametrize("wheel", [6, 7])
def test_a_jammed_wheel_fails_every_move_and_the_robot_is_put_down_elsewhere(wheel):
    trial = make(seed=1, timeout_s=1.0)
    trial.world.model.dof_frictionloss[wheel] = 100.0
    mujoco.mj_setConst(trial.world.model, mujoco.MjData(trial.world.model))
    moves = [record.move for record in steps(trial, 4)]
    assert {move.outcome for move in moves} == {Outcome.FAILED}
    assert [move.fallen for move in moves] == [False, False, True, False]
    assert all(move.duration_s <= 1.0 for move in moves)


def test_a_robot_that_is_tipped_over_is_reported_and_drives_on_from_elsewhere():
    trial = make(seed=1)
    trial.world.data.xfrc_applied[1, 3:5] = 5.0
    first, second = steps(trial, 2)
    assert (first.move.outcome, first.move.fallen, first.hit) == (Outcome.FAILED, True, False)
    assert second.move.outcome != Outcome.FAILED


def while_thinking(trial, happens):
    """Let something happen to the robot once, while it makes up its mind."""
    decide = trial.brain.decide

    def decide_and_suffer(percept):
        trial.brain.decide = decide
        happens()
        return decide(percept)

    trial.brain.decide = decide_and_suffer


@pytest.mark.parametrize(("array", "index"), [("qvel", 0), ("qvel", 6), ("qpos", 0), ("qpos", 2), ("qpos", 4)])
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_state_that_is_not_a_number_is_reported_and_recovered_from(array, index, value):
    trial = make(seed=1)
    steps(trial, 2)
    while_thinking(trial, lambda: getattr(trial.world.data, array).__setitem__(index, value))
    broken, sound = steps(trial, 2)
    assert (broken.move.outcome, broken.move.fallen, broken.hit) == (Outcome.FAILED, True, False)
    assert sound.move.outcome != Outcome.FAILED
    assert trial.world.faults() == []


def test_a_robot_that_has_lost_its_place_is_reported_and_told_a_new_one():
    trial = make(seed=1, localisation="sensors")
    while_thinking(trial, lambda: trial._localiser.odometer.estimate.__setitem__(0, math.nan))
    lost, found = steps(trial, 2)
    assert (lost.move.outcome, lost.move.fallen) == (Outcome.FAILED, True)
    assert found.move.outcome != Outcome.FAILED
    assert found.localised.error_m < 1e-9


def test_a_command_that_is_not_a_number_fails_and_reaches_no_wheel():
    trial = make(seed=1)
    gains = trial._driver._robot[-1]
    gains[Gains._fields.index("wheel_radius_m")] = math.nan
    record = steps(trial, 1)[0]
    assert record.move.outcome == Outcome.FAILED
    assert not np.isnan(trial.world.data.ctrl).any()


def test_a_warning_of_mujoco_stops_the_run_with_a_sentence():
    trial = make(seed=1)
    trial.world.data.warning[int(mujoco.mjtWarning.mjWARN_CONTACTFULL)].number = 1
    with pytest.raises(SclaError, match="CONTACTFULL"):
        steps(trial, 1)


def test_mujoco_resetting_itself_stops_the_run_with_a_sentence():
    trial = make(seed=1)
    mujoco.mj_resetData(trial.world.model, trial.world.data)
    trial.world.data.qpos[:] = trial.world._resting_qpos
    trial.world.steps = 500
    with pytest.raises(SclaError, match="reset itself"):
        steps(trial, 1)
