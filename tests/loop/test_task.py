"""The robot without a brain: its actions are a rollout's, and a seed decides everything."""

import dataclasses

import numpy as np
import pytest

from scla_mj.config import RunConfig, TaskConfig
from scla_mj.disturbances import DisturbanceConfig, with_sets
from scla_mj.engine.build import build_task, simulate
from scla_mj.errors import SclaError
from scla_mj.grid import Action
from scla_mj.signals import Outcome


def everything(seed=0, localisation="sensors"):
    """Return a configuration in which every stream of the task is drawn from."""
    return RunConfig(
        seed=seed,
        brain="random",
        localisation=localisation,
        task=TaskConfig(action_noise=0.2),
        disturbance=with_sets(DisturbanceConfig(), ["all"]),
    )


def drive(task, actions):
    """Act, and return what came of it to the bit."""
    told = []
    for action in actions:
        step = task.act(action)
        told.append((repr(step.feedback), repr(step.move._replace(trajectory=None)), step.move.trajectory.tobytes(),
                     step.started_s, repr(step.localised)))  # fmt: skip
    return told


def actions(number, seed=3):
    return [Action(int(a)) for a in np.random.default_rng(seed).integers(0, 4, number)]


def test_the_decisions_of_a_simulation_carried_out_without_its_brain_are_the_same_to_the_bit():
    config = everything(localisation="truth")
    simulation, task = simulate(config), build_task(config)
    for _ in range(40):
        record = simulation.step()
        step = task.act(record.chosen.action)
        assert (step.feedback.executed, step.feedback.hit, step.started_s) == (
            record.executed,
            record.hit,
            record.time_s,
        )
        assert step.move.trajectory.tobytes() == record.move.trajectory.tobytes()
    assert simulation.task.state()["world"]["physics"].tobytes() == task.state()["world"]["physics"].tobytes()


@pytest.mark.parametrize("localisation", ["truth", "odometry", "sensors"])
def test_a_reseeded_task_is_a_fresh_one_of_that_seed(localisation):
    fresh = build_task(everything(seed=5, localisation=localisation))
    used = build_task(everything(seed=1, localisation=localisation))
    drive(used, actions(15, seed=9))
    assert used.time_s > 5.0
    assert used.reseed(5) == fresh.percept
    assert used.time_s == 0.0
    assert drive(used, actions(15)) == drive(fresh, actions(15))


def test_a_task_continues_from_its_state_to_the_bit():
    whole = build_task(everything())
    before = drive(whole, actions(6, seed=1))
    state = whole.state()
    after = drive(whole, actions(10, seed=2))
    again = build_task(everything())
    assert drive(again, actions(6, seed=1)) == before
    again.restore(state)
    assert drive(again, actions(10, seed=2)) == after


@pytest.mark.parametrize("action", [7, 0, "up", None, 1.0])
def test_what_is_not_an_action_is_refused(action):
    with pytest.raises(SclaError, match="it must be an Action, such as"):
        build_task(RunConfig()).act(action)


@pytest.mark.parametrize("localisation", ["truth", "sensors"])
@pytest.mark.parametrize("disturbed", [False, True])
def test_crossed_wheels_drive_the_body_the_other_way_and_the_brain_hears_of_its_own_action_only(
    localisation, disturbed
):
    disturbance = with_sets(DisturbanceConfig(), ["all"] if disturbed else [])
    task = build_task(
        RunConfig(seed=4, localisation=localisation, disturbance=disturbance, task=TaskConfig(crossed_epoch=1))
    )
    ended = []
    for action in actions(40):
        start = task.percept.cell
        step = task.act(action, observe=False)
        assert (step.feedback.action, step.feedback.executed, step.driven) == (action, action, action.opposite)
        ended.append(step.feedback.outcome)
        if ended[-1] is Outcome.FAILED:
            continue
        opposite = task.grid.after(start, action.opposite)
        assert step.move.after == opposite and step.feedback.hit == (opposite == task.grid.target)
        assert (ended[-1] is Outcome.BLOCKED) == (opposite == start)
        assert step.feedback.after.sensed == task.grid.sensed_from(opposite)
    assert {Outcome.MOVED, Outcome.BLOCKED} <= set(ended) and ended.count(Outcome.FAILED) <= 6


@pytest.mark.parametrize("localisation", ["truth", "sensors"])
def test_what_crossed_wheels_do_is_what_the_opposite_actions_do_to_the_bit_also_after_a_state(localisation):
    config = dataclasses.replace(everything(seed=6, localisation=localisation), task=TaskConfig())
    straight, crossed = build_task(config), build_task(dataclasses.replace(config, task=TaskConfig(crossed_epoch=1)))

    def same(moves):
        for action in moves:
            one, other = straight.act(action.opposite), crossed.act(action)
            assert one.move.trajectory.tobytes() == other.move.trajectory.tobytes() and one.driven == other.driven
            assert one.feedback.after == other.feedback.after and one.feedback.hit == other.feedback.hit

    same(actions(15))
    straight.restore(crossed.state())
    assert straight.crossed
    straight.crossed = False
    same(actions(5))


def test_a_hit_respawns_the_robot_and_a_wall_sends_it_back():
    task = build_task(RunConfig(seed=2))
    grid, outcomes, hits = task.grid, set(), 0
    for action in actions(120):
        before = task.percept
        step = task.act(action, observe=False)
        assert step.feedback.before == before and len(step.move.trajectory) == 0
        assert step.feedback.after.cell == grid.after(before.cell, action) == step.move.after
        assert step.feedback.hit == (step.move.after == grid.target)
        assert (task.percept == step.feedback.after) != step.feedback.hit  # a robot that hit is elsewhere
        outcomes.add(step.feedback.outcome)
        hits += step.feedback.hit
    assert outcomes == {Outcome.MOVED, Outcome.BLOCKED} and hits > 1
