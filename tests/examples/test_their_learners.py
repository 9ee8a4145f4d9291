"""Learners of others: tabular Q-learning, and Stable-Baselines3's where it is installed, learn the task."""

import importlib.util
from pathlib import Path

import gymnasium as gym
import pytest

from scla_mj.envs import HitRecorder

EXAMPLES = Path(__file__).parents[2] / "examples"
CEILING = 400


def example(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def twin(**options):
    return HitRecorder(gym.make("scla_mj.envs:scla_mj/GridTwin-v0", max_episode_steps=-1, **options))


def test_a_table_in_thirty_lines_drives_shortest_paths_in_its_second_thousand():
    env = twin(observation="index")
    example("tabular_q").learn(env, 2000, seed=3)
    first, second = env.per_1000()
    assert 250 < first < 350 and abs(second - CEILING) < 30
    assert len((EXAMPLES / "tabular_q.py").read_text(encoding="utf-8").splitlines()) <= 35


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # torch's own
@pytest.mark.parametrize("algorithm", ["dqn", "ppo"])
def test_stable_baselines_learns_with_our_settings_the_same_from_the_same_seed_and_not_with_its_own(algorithm):
    pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.env_checker import check_env

    check_env(twin())
    module = example("stable_baselines")
    earned = []
    for settings in (module.TUNED[algorithm], module.TUNED[algorithm], {}):
        env = twin()
        module.learn(env, 2000, 1, algorithm, **settings)
        earned.append(env.per_1000()[:2])
    assert earned[0] == earned[1]
    assert earned[0][1] > 0.8 * CEILING > earned[2][1]


def test_a_hit_is_a_rewarded_end_and_nothing_else():
    class Ends(gym.Env):
        action_space = observation_space = gym.spaces.Discrete(4)

        def step(self, action):
            return 0, *((1.0, True, False), (0.0, True, False), (1.0, False, False), (0.0, False, True))[action], {}

    env = HitRecorder(Ends())
    for action in range(4):
        env.step(action)
    assert env.hits == [True, False, False, False] and env.per_1000() == []
