"""GridMove-v0 and its twin: Gymnasium's contract, and a rollout to the bit."""

import dataclasses
import importlib
import sys

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import scla_mj
from scla_mj.checked import check
from scla_mj.config import GridConfig, RunConfig, TaskConfig
from scla_mj.disturbances import DisturbanceConfig, with_sets
from scla_mj.engine.build import simulate
from scla_mj.envs.agents import BrainAgent
from scla_mj.envs.episodes import OUTCOMES
from scla_mj.errors import SclaError
from scla_mj.grid import ACTIONS

HARD = TaskConfig(action_noise=0.2, jump_epoch=2, jump_target=(1, 5), crossed_epoch=3)
DISTURBED = with_sets(DisturbanceConfig(), ["all"])


def make(name="GridMove", **options):
    return gym.make(f"scla_mj.envs:scla_mj/{name}-v0", max_episode_steps=-1, **options)


def actions(number, seed=0):
    return np.random.default_rng(seed).integers(0, 4, number).tolist()


def seen(percept):
    return [percept.cell.x - 1, percept.cell.y - 1, 4 if percept.sensed is None else int(percept.sensed)]


@pytest.mark.parametrize("observation", ["sensing", "cell", "index"])
@pytest.mark.parametrize("name", ["GridMove", "GridTwin"])
def test_gymnasiums_checker_finds_nothing(name, observation):
    check_env(make(name, observation=observation).unwrapped, skip_render_check=True)


@pytest.mark.parametrize(
    "config",
    [
        RunConfig(seed=3, brain="dyna-q"),
        RunConfig(seed=4, brain="dyna-q", epochs=3, decisions=40, task=HARD),
        RunConfig(seed=5, brain="random", localisation="sensors", disturbance=DISTURBED),
    ],
    ids=["plain", "noise, jump and crossed wheels", "disturbed"],
)
def test_the_decisions_of_a_run_carried_out_in_the_environment_come_to_the_same_to_the_bit(config):
    run, env = simulate(config), make(config=config)
    observation, info = env.reset(seed=config.seed)
    for _ in range(120):
        record = run.step(observe=False)
        assert observation.tolist() == seen(record.percept) and info["time_s"] == record.time_s
        observation, reward, hit, fallen, info = env.step(int(record.chosen.action))
        move = record.move
        assert (reward, hit, fallen) == (float(record.hit), record.hit, move.fallen)
        assert repr(info["position_error_m"]) == repr(move.position_error_m)
        assert (info["duration_s"], OUTCOMES[info["outcome"]]) == (move.duration_s, move.outcome)
        if hit or fallen:
            observation, info = env.reset()
    assert run.world.state()["physics"].tobytes() == env.unwrapped.task.world.state()["physics"].tobytes()


@pytest.mark.parametrize("brain", ["scla-printed", "scla-dopamine"])
def test_a_brain_as_the_environments_agent_decides_and_fires_as_in_a_run(brain):
    config = RunConfig(seed=6, brain=brain, protocol="sensed-start")
    run, env, agent = simulate(config), make(protocol="sensed-start"), BrainAgent.of_grid_move(config)
    observation, _ = env.reset(seed=6)
    for _ in range(60):
        record = run.step(observe=False)
        assert ACTIONS[agent.act(observation)] == record.chosen.action
        observation, *came = env.step(int(record.chosen.action))
        agent.learn(observation, *came)
        if came[1] or came[2]:
            observation, _ = env.reset()
    assert np.array_equal(agent.brain.network.weights, run.network.weights)
    assert np.array_equal(agent.brain.automata.probabilities, run.automata.probabilities)


def test_a_seed_decides_everything_whatever_came_before():
    env, other = make(config=RunConfig(epochs=3, decisions=5, task=HARD)), None
    told = []
    for before in (0, 17):
        env.reset(seed=8)
        for action in actions(before):
            _, _, hit, fallen, _ = env.step(action)
            if hit or fallen:
                env.reset()
        told.append([env.reset(seed=9), *[env.step(action) for action in actions(4, seed=1)]])
        state = env.unwrapped.task.world.state()["physics"].tobytes()
        assert state == (other or state)
        other = state
    assert repr(told[0]) == repr(told[1])


def test_a_reset_without_a_seed_draws_one_at_first_and_goes_on_later():
    env, again = make("GridTwin"), make("GridTwin")
    starts = [[e.reset()[0].tolist() for _ in range(30)] for e in (env, again)]
    assert starts[0] != starts[1] and len({tuple(start) for start in starts[0]}) > 8


def test_episodes_are_cut_after_200_moves():
    env = gym.make("scla_mj.envs:scla_mj/GridTwin-v0")
    env.reset(seed=0)
    ends = [env.step(0)[2:4] for _ in range(200)]
    assert ends[-2:] == [(False, False), (False, True)]


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"action_noise": 2.0}, "--task.action-noise is 2.0: it must be"),
        ({"speed": 1}, "speed is no setting of this environment: choose from protocol, "),
        ({"disturb": ["mud"]}, "--disturb is \\['mud'\\]: it must be a list of friction, "),
        ({"disturb": "mass"}, "--disturb is 'mass'"),
        ({"closed_cells": ((3, 3),)}, "the target \\(3, 3\\) is a closed cell"),
        ({"observation": "all"}, "observation is 'all': it must be sensing, cell, index"),
        ({"render_mode": "ansi"}, "render_mode is 'ansi': it must be None or 'rgb_array' or 'human'"),
        ({"camera": "side"}, "camera is 'side': it must be angled or top"),
        ({"config": {"seed": 1}}, "config is .*: it must be a RunConfig"),
    ],
)
def test_what_cannot_be_is_refused_with_the_sentence_of_the_command_line(options, sentence):
    with pytest.raises(SclaError, match=sentence):
        scla_mj.envs.GridMoveEnv(**options)


def test_a_stored_runs_map_and_robot_give_way_to_those_that_are_named(tmp_path):
    (tmp_path / "old.txt").write_text("S . T\n")
    (tmp_path / "new.txt").write_text("T . . S\n")
    stored = check(RunConfig(grid=GridConfig(floor=str(tmp_path / "old.txt")))).config
    stored = dataclasses.replace(stored, robot=str(tmp_path / "gone.xml"), robot_sha256="0" * 64)
    env = scla_mj.envs.GridTwinEnv(config=stored, floor=str(tmp_path / "new.txt"), robot="burger")
    assert env.task.grid.cells == (4, 1) and env.task.grid.target == (1, 1)


def test_a_twin_has_nothing_to_disturb_or_to_draw():
    for options in ({"disturb": ["mass"]}, {"localisation": "odometry"}, {"render_mode": "rgb_array"}):
        with pytest.raises(SclaError, match=r"disturbed|render_mode"):
            scla_mj.envs.GridTwinEnv(**options)


def test_without_gymnasium_the_sentence_names_the_command(monkeypatch):
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    envs = importlib.reload(scla_mj.envs)
    with pytest.raises(SclaError, match=r"run pip install 'scla-mj\[gym\]'"):
        _ = envs.GridMoveEnv
    assert envs.BrainAgent is BrainAgent


def test_human_without_a_display_is_one_sentence(monkeypatch):
    monkeypatch.setattr(sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(SclaError, match='needs a display, and there is none: choose "rgb_array"'):
        make(render_mode="human")


def test_a_picture_shows_the_robot_where_it_is_and_changes_nothing():
    pytest.importorskip("OpenGL")
    env, blind = make(render_mode="rgb_array", camera="top", width=160, height=120), make()
    pictures = []
    for seed in (0, 1):
        env.reset(seed=seed)
        pictures.append(env.render().astype(int))
    assert pictures[0].shape == (120, 160, 3)
    assert np.abs(pictures[0] - pictures[1]).max() > 60  # it stands elsewhere
    blind.reset(seed=1)
    assert repr(env.step(0)) == repr(blind.step(0))
    env.close()
