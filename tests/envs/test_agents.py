"""Our brains in other environments: the feedback that they get, and that they learn."""

import importlib.util
from pathlib import Path

import gymnasium as gym
import pytest

from scla_mj.config import GridConfig, RunConfig
from scla_mj.envs.agents import BrainAgent, play
from scla_mj.errors import SclaError
from scla_mj.grid import Action, Cell
from scla_mj.signals import Outcome

LAKE = Path(__file__).parents[2] / "examples" / "frozen_lake.py"


def agent(brain="q-learning", cells=(3, 2), target=(3, 1), **options):
    config = RunConfig(brain=brain, grid=GridConfig(cells=cells, target=target))
    return BrainAgent(config, cell_of=lambda cell: cell, **options)


def test_the_example_reaches_the_goal_of_a_lake_that_it_knows_nothing_of():
    spec = importlib.util.spec_from_file_location("frozen_lake", LAKE)
    lake = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(lake)
    for brain, decisions in (("scla", 1200), ("q-learning", 600)):
        earned = lake.returns_of(brain, decisions)
        assert sum(earned[:10]) <= 5 and earned[-20:] == [1.0] * 20


def test_a_brain_finds_its_way_along_the_cliff_whose_goal_has_no_positive_reward():
    def cell_of(observation):
        row, column = divmod(int(observation), 12)
        return column + 1, 4 - row

    config = RunConfig(brain="dyna-q", grid=GridConfig(cells=(12, 4), target=(12, 1)))
    walker = BrainAgent(config, cell_of=cell_of, moves=(0, 2, 3, 1), is_hit=lambda reward, terminated: terminated)
    returns = play(gym.make("CliffWalking-v1"), walker, 3000, seed=0)
    assert returns[0] < -100.0 and returns[-5:] == [-13.0] * 5  # the shortest way there


@pytest.mark.parametrize(
    ("came", "outcome", "executed", "after", "hit"),
    [
        (((2, 1), 0.0, False), Outcome.MOVED, Action.RIGHT, Cell(2, 1), False),
        (((1, 2), 0.0, False), Outcome.MOVED, Action.UP, Cell(1, 2), False),  # it slipped
        (((1, 1), 0.0, False), Outcome.BLOCKED, Action.RIGHT, Cell(1, 1), False),
        (((2, 1), 0.0, True), Outcome.BLOCKED, Action.RIGHT, Cell(1, 1), False),  # a hole
        (((3, 2), -9.0, False), Outcome.BLOCKED, Action.RIGHT, Cell(1, 1), False),  # put elsewhere
        (((2, 1), 1.0, True), Outcome.MOVED, Action.RIGHT, Cell(2, 1), True),
    ],
)
def test_a_brain_is_told_what_the_cells_show(came, outcome, executed, after, hit):
    it = agent("shortest-path")
    assert it.act((1, 1)) == Action.RIGHT
    told = it.learn(came[0], came[1], came[2], False, {})
    assert (told.before.cell, told.action) == (Cell(1, 1), Action.RIGHT)
    assert (told.outcome, told.executed, told.after.cell, told.hit) == (outcome, executed, after, hit)
    assert (told.crossed_s is None) == (outcome is not Outcome.MOVED)


def test_the_goal_is_sensed_from_next_to_it_once_it_was_hit_or_if_it_was_named():
    it = agent("shortest-path")
    it.act((2, 1))
    assert it.learn((3, 1), 1.0, True, False, {}).before.sensed is None
    it.act((2, 1))
    assert it.learn((3, 1), 1.0, True, False, {}).before.sensed == Action.RIGHT
    named = agent("shortest-path", goal=(1, 2))
    named.act((1, 1))
    assert named.learn((2, 1), 0.0, False, False, {}).before.sensed == Action.UP


def test_mistakes_are_one_sentence():
    it = agent()
    with pytest.raises(SclaError, match=r"the brain has not acted yet: call act\(observation\)"):
        it.learn((1, 1), 0.0, False, False, {})
    with pytest.raises(SclaError, match=r"cell_of returned \(0, 1\): the brain's --cells are 3 2"):
        it.act((0, 1))
