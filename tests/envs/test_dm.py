"""dm_env: its own conformance tests, and the same episodes as Gymnasium's."""

import sys

import numpy as np
import pytest
from absl.testing import absltest
from dm_env import test_utils

import scla_mj
from scla_mj.config import RunConfig
from scla_mj.engine.build import build_task, simulate
from scla_mj.envs.control import make_physics
from scla_mj.envs.dm import TASKS
from scla_mj.envs.grid_move import GridMoveEnv
from scla_mj.envs.wheels import WheelsEnv
from scla_mj.errors import SclaError
from scla_mj.grid import ACTIONS, Cell


class TestGridMove(test_utils.EnvironmentTestMixin, absltest.TestCase):
    def make_object_under_test(self):
        return scla_mj.load("grid_move", "disturbed", {"random": 1}, {"time_limit": 5.0})

    def make_action_sequence(self):
        yield from np.random.default_rng(0).integers(0, 4, 20)


class TestWheels(test_utils.EnvironmentTestMixin, absltest.TestCase):
    def make_object_under_test(self):
        return scla_mj.load("wheels", "reach", {"random": 1, "rays": 3}, {"time_limit": 0.5})

    def make_action_sequence(self):
        yield from np.random.default_rng(0).uniform(-1.0, 1.0, (120, 2))


def test_random_resets_and_steps_are_those_of_gymnasium_and_of_a_simulation_to_the_bit():
    rng, seed = np.random.default_rng(5), 11
    env, gym_env, task = (
        scla_mj.load("grid_move", "any_start", {"random": seed}),
        GridMoveEnv(),
        simulate(RunConfig(seed=seed, brain="random")).task,
    )
    observed, first, percept = gym_env.reset(seed=seed)[0], env.reset(), task.percept
    assert first.first()
    over = False
    for _ in range(250):
        if over or rng.random() < 0.1:
            observed, step, percept = gym_env.reset()[0], env.reset(), task.respawn()
            over = False
        else:
            action = int(rng.integers(4))
            observed, reward, over, _, _ = gym_env.step(action)
            step, came = env.step(np.int32(action)), task.act(ACTIONS[action], respawn=False)
            percept = came.feedback.after
            assert step.reward == reward == float(came.feedback.hit)
            assert step.last() == over == came.feedback.hit and step.discount == (0.0 if over else 1.0)
        sensed = 4 if percept.sensed is None else int(percept.sensed)
        assert (
            observed.tolist() == [*step.observation["cell"], sensed] == [percept.cell.x - 1, percept.cell.y - 1, sensed]
        )
        assert step.observation["sensed"].argmax() == sensed
        states = {
            world.state()["physics"].tobytes()
            for world in (gym_env.task.world, task.world, env.task.episodes.task.world)
        }
        assert len(states) == 1


def test_wheel_speeds_come_to_the_same_as_in_gymnasium():
    env, gym_env = scla_mj.load("wheels", "reach", {"random": 4}), WheelsEnv()
    rng = np.random.default_rng(1)
    step, (observed, _) = env.reset(), gym_env.reset(seed=4)
    for _ in range(300):
        assert np.concatenate(list(step.observation.values())).tobytes() == observed.tobytes()
        speeds = rng.uniform(-0.3, 1.0, 2)
        observed, reward, over, _, _ = gym_env.step(speeds)
        step = env.step(speeds)
        assert (step.reward, step.last()) == (reward, over)
        if over:
            step, (observed, _) = env.reset(), gym_env.reset()


def test_pixels_come_by_dm_controls_own_wrapper_and_drawing_changes_nothing():
    from dm_control.suite.wrappers import pixels

    env = pixels.Wrapper(
        scla_mj.load("wheels", "reach", {"random": 4}),
        render_kwargs={"height": 60, "width": 80, "camera_id": "top"},
    )
    plain = scla_mj.load("wheels", "reach", {"random": 4})
    assert env.reset().observation["pixels"].std() > 5.0
    plain.reset()
    for _ in range(3):
        env.step([0.5, 0.4])
        plain.step([0.5, 0.4])
    assert env.physics.data.qpos.tobytes() == plain.physics.data.qpos.tobytes()
    axle = env.physics.named.data.xpos["robot/chassis"]
    assert np.array_equal(axle, env.physics.data.qpos[:3])  # what is named is up to date


@pytest.mark.parametrize(("domain", "task"), TASKS)
def test_every_named_task_starts(domain, task):
    env = scla_mj.load(domain, task, {"random": 0})
    assert env.reset().first()


@pytest.mark.parametrize(
    ("names", "options", "sentence"),
    [
        (("grid_move", "run"), {}, "grid_move/run is no task: choose from grid_move/any_start, "),
        (("wheels", "reach"), {"action_noise": 0.1}, "action_noise is no setting"),
        (("grid_move", "any_start"), {"cells": (0, 5)}, "--cells"),
        (("grid_move", "any_start"), {"random": -1}, "seed is -1: it must be a whole number"),
    ],
)
def test_what_cannot_be_loaded_is_refused(names, options, sentence):
    with pytest.raises(SclaError, match=sentence):
        scla_mj.load(*names, options)


def test_dm_control_sees_the_very_same_model_and_data():
    world = build_task(RunConfig()).world
    physics = make_physics(world.data)
    assert physics.model.ptr is world.model
    assert physics.data.ptr is world.data
    world.spawn(Cell(1, 2), 0.0)
    assert physics.named.data.qpos["robot/root"][:2] == pytest.approx([-0.60, -0.30])
    before = world.data.time
    physics.step()
    assert world.data.time == pytest.approx(before + world.model.opt.timestep)


@pytest.mark.parametrize("action", [7, -1, 1.5, "up", [1, 2]])
def test_a_move_that_is_none_of_the_four_is_refused(action):
    env = scla_mj.load("grid_move", "any_start")
    env.reset()
    with pytest.raises(SclaError, match="it must be 0 to 3"):
        env.step(action)


def test_without_dm_control_the_sentence_names_the_command(monkeypatch):
    monkeypatch.setitem(sys.modules, "dm_control", None)
    with pytest.raises(SclaError, match=r"scla_mj.load needs dm_control.*: run pip install 'scla-mj\[dm\]'"):
        scla_mj.load("wheels", "reach")
