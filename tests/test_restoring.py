"""A state that is handed back and does not fit is refused in a sentence, and nothing is changed."""

import copy

import numpy as np
import pytest

from scla_mj import Action, Network, RunConfig, SclaError, build_task, simulate
from scla_mj.config import TaskConfig
from scla_mj.grid import Cell


def damaged(state):
    """Every state with one thing wrong, as (what, state)."""

    def places(value, path=()):
        yield path
        for key in value if isinstance(value, dict) else ():
            yield from places(value[key], (*path, key))

    for path in places(state):
        for wrong in ({}, None, "x", -1, float("nan"), [1, "a"], np.full((9, 9), np.nan), np.array("a")):
            whole = {"state": copy.deepcopy(state)}
            holder = whole
            *way, key = ("state", *path)
            for step in way:
                holder = holder[step]
            if isinstance(holder[key], list) or (isinstance(holder[key], dict) and not holder[key]):
                continue
            holder[key] = wrong
            yield (*path, wrong), whole["state"]


def same(first, second):
    return repr(first) == repr(second)


@pytest.mark.parametrize("make", [lambda: Network(seed=1), lambda: build_task(RunConfig(seed=1)),
                                  lambda: simulate(RunConfig(seed=1, brain="automaton"))])  # fmt: skip
def test_whatever_is_wrong_with_a_state_it_is_refused_and_nothing_is_changed(make):
    owner = make()
    before = owner.state()
    tried = 0
    for place, state in damaged(before):
        with pytest.raises(SclaError) as refusal:
            owner.restore(state)
        assert "\n" not in str(refusal.value) and len(str(refusal.value)) < 400, place
        tried += 1
    assert tried > 40
    assert same(owner.state(), before)


def test_a_simulation_goes_back_to_before_its_targets_jump():
    config = RunConfig(brain="random", epochs=2, decisions=3, task=TaskConfig(jump_epoch=2, jump_target=(1, 5)))
    simulation = simulate(config)
    states = [simulation.state()]
    came = []
    for _ in range(6):
        came.append(simulation.step())
        states.append(simulation.state())
    simulation.restore(states[1])
    assert simulation.task.grid.target == Cell(3, 3)
    again = [simulation.step() for _ in range(5)]
    assert [(r.time_s, r.move.after, r.hit) for r in again] == [(r.time_s, r.move.after, r.hit) for r in came[1:]]


@pytest.mark.parametrize("seed", ["4", -1, 2**63, 1.0, True, None, np.float64(3)])
def test_a_task_takes_only_seeds_that_a_run_can_have(seed):
    with pytest.raises(SclaError, match=r"seed is .*: it must be a whole number, 0 to 9223372036854775807"):
        build_task(RunConfig()).reseed(seed)


def test_a_task_of_numpys_seed_is_that_of_the_number():
    tasks = [build_task(RunConfig()) for _ in range(2)]
    for task, seed in zip(tasks, (5, np.uint64(5)), strict=True):
        task.reseed(seed)
        task.act(Action.UP)
    assert same(tasks[0].state(), tasks[1].state())


@pytest.mark.parametrize("sensors", [{"a": 3}, {3: len}, [len], "x", 5])
def test_sensors_that_are_no_functions_by_name_are_refused(sensors):
    with pytest.raises(SclaError, match="it must be a dict of functions of the world, by name"):
        build_task(RunConfig(), sensors=sensors)
