"""The vector environments: each robot is a single environment to the bit, and the twin decides what a robot does."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode

from scla_mj.config import RunConfig, TaskConfig
from scla_mj.envs.vector import GridMoveVectorEnv, GridTwinVectorEnv
from scla_mj.errors import SclaError

HARD = {"action_noise": 0.2, "jump_epoch": 2, "jump_target": (1, 5), "crossed_epoch": 3, "epochs": 3, "decisions": 15,
        "closed_cells": ((2, 2),), "protocol": "sensed-start"}  # fmt: skip


def both(name, robots, threads=2, **options):
    spec, same = f"scla_mj.envs:scla_mj/{name}-v0", {"autoreset_mode": AutoresetMode.SAME_STEP}
    single = gym.make_vec(spec, robots, vectorization_mode="sync", vector_kwargs=same, **options)
    return gym.make_vec(spec, robots, threads=threads, **options), single


@pytest.mark.parametrize(
    ("name", "observation"), [("GridMove", "sensing"), ("GridTwin", "sensing"), ("GridTwin", "index")]
)
@pytest.mark.parametrize("options", [{}, HARD], ids=["plain", "hard"])
def test_many_robots_in_one_call_are_the_single_environments_to_the_bit(name, options, observation):
    vector, single = both(name, 5, max_episode_steps=12, observation=observation, **options)
    assert data_equivalence(vector.reset(seed=7), single.reset(seed=7))
    single.action_space.seed(1)
    for step in range(50):
        if step == 30:
            seeds = [3, None, 5, None, 7]
            assert data_equivalence(vector.reset(seed=seeds), single.reset(seed=seeds))
        actions = single.action_space.sample()
        ours, theirs = vector.step(actions), single.step(actions)
        assert data_equivalence(ours, theirs), (step, ours, theirs)
    if name == "GridMove":
        for i, env in enumerate(single.envs):
            assert vector.fleet.qpos(i).tobytes() == env.unwrapped.task.world.data.qpos.tobytes()
    vector.close()
    single.close()


def test_the_number_of_threads_changes_no_bit():
    told = []
    for threads in (1, 3):
        env = GridMoveVectorEnv(7, threads=threads)
        told.append([env.reset(seed=1), *[env.step(np.arange(7) % 4) for _ in range(3)]])
        env.close()
    assert repr(told[0]) == repr(told[1])


def test_the_twin_goes_where_the_robot_goes():
    robots, twins = GridMoveVectorEnv(8, threads=2), GridTwinVectorEnv(8)
    assert np.array_equal(robots.reset(seed=4)[0], twins.reset(seed=4)[0])
    rng = np.random.default_rng(0)
    hits = 0
    for _ in range(60):
        actions = rng.integers(0, 4, 8)
        driven, thought = robots.step(actions), twins.step(actions)
        assert all(np.array_equal(a, b) for a, b in zip(driven[:4], thought[:4], strict=True))
        assert np.array_equal(driven[4]["outcome"], thought[4]["outcome"])
        hits += driven[1].sum()
    assert hits > 5
    robots.close()


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"disturb": ["mass"]}, "a fleet of robots can neither be disturbed nor localise itself"),
        ({"localisation": "sensors"}, "a fleet of robots can neither"),
        ({"num_envs": 0}, "the number of robots is 0: it must be a whole number, 1 to"),
        ({"threads": 0}, "threads is 0"),
        ({"max_episode_steps": 0}, "max_episode_steps is 0: it must be a whole number, 1 to"),
        ({"max_episode_steps": -2}, "max_episode_steps is -2"),
        ({"max_episode_steps": "many"}, "max_episode_steps is 'many'"),
        ({"config": RunConfig(task=TaskConfig(jump_epoch=11))}, "the run ends after epoch 10"),
    ],
)
def test_what_a_fleet_cannot_be_is_refused(options, sentence):
    with pytest.raises(SclaError, match=sentence):
        GridMoveVectorEnv(**options)


def test_numpys_integers_are_integers():
    ours, numpys = (
        GridTwinVectorEnv(2, max_episode_steps=4),
        GridTwinVectorEnv(np.int64(2), max_episode_steps=np.int8(4)),
    )
    for seed in (3, [5, 6]):
        assert data_equivalence(ours.reset(seed=seed), numpys.reset(seed=np.array(seed)[()]))
        assert data_equivalence(ours.step([0, 1]), numpys.step([0, 1]))
    single = gym.make("scla_mj.envs:scla_mj/GridTwin-v0")
    assert data_equivalence(single.reset(seed=3), single.reset(seed=np.int64(3)))


def test_actions_and_seeds_that_do_not_fit_are_refused():
    env = GridTwinVectorEnv(3)
    with pytest.raises(SclaError, match="there are 2 seeds: 3 robots need as many"):
        env.reset(seed=[1, 2])
    single = gym.make("scla_mj.envs:scla_mj/GridTwin-v0")
    for seed in (-1, True, 2.0, "seven"):
        for wrong in (seed, [0, 1, seed]):
            with pytest.raises(SclaError, match=f"seed is {seed!r}: it must be a whole number, 0 to"):
                env.reset(seed=wrong)
        with pytest.raises(SclaError, match=f"seed is {seed!r}: it must be a whole number, 0 to"):
            single.reset(seed=seed)
    env.reset(seed=0)
    for actions in ([0, 1], [0, 1, 4], [0, 1, -1], [0.0, 1.0, 2.0]):
        with pytest.raises(SclaError, match="they must be 3 numbers, 0 to 3"):
            env.step(np.array(actions))
