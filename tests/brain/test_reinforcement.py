"""The local rule and the distal reward, against the values they must converge to."""

import math

import pytest

from scla_mj.brain.reinforcement import CellStates, PathTrace
from scla_mj.grid import Action, Cell, Grid
from scla_mj.signals import Feedback, Outcome, Percept

GRID = Grid((5, 5), Cell(3, 3), 0.3)


def walk(grid, cell, action):
    after = grid.after(cell, action)
    outcome = Outcome.BLOCKED if after == cell else Outcome.MOVED
    return Feedback(
        Percept(cell, grid.sensed_from(cell)),
        action,
        action,
        outcome,
        Percept(after, grid.sensed_from(after)),
        after == grid.target,
    )


def sweep(states, grid):
    for cell in grid.open_cells():
        if cell != grid.target:
            for action in Action:
                states.judge(walk(grid, cell, action))


def test_cell_states_converge_to_the_discount_to_the_power_of_the_distance():
    states = CellStates(discount=0.9)
    for _ in range(10):
        sweep(states, GRID)
    for cell, distance in GRID.distances.items():
        assert states[cell] == pytest.approx(0.9**distance)


def test_a_move_closer_is_good_and_a_move_away_is_bad_once_states_are_known():
    states = CellStates(discount=0.9)
    for _ in range(10):
        sweep(states, GRID)
    for cell in GRID.open_cells():
        if cell == GRID.target:
            continue
        for action in Action:
            move = walk(GRID, cell, action)
            closer = GRID.distances[cell] - GRID.distances[move.after.cell]
            assert states.judge(move) == closer


def test_where_nothing_is_known_nothing_is_signalled():
    states = CellStates(discount=0.9)
    assert states.judge(walk(GRID, Cell(1, 1), Action.UP)) == 0


def test_a_target_that_has_left_is_forgotten_and_the_new_one_takes_its_place():
    states = CellStates(discount=0.9)
    for _ in range(10):
        sweep(states, GRID)
    moved = Grid((5, 5), Cell(1, 5), 0.3)
    for _ in range(40):
        sweep(states, moved)
    for cell, distance in moved.distances.items():
        assert states[cell] == pytest.approx(0.9**distance)


def test_the_distal_reward_decays_with_the_moves_since():
    path = PathTrace(tau_moves=1.5)
    for cell, action in ((Cell(1, 1), Action.RIGHT), (Cell(2, 1), Action.UP), (Cell(2, 2), Action.UP)):
        path.add(walk(GRID, cell, action))
    eligible = path.collect()
    assert [(e.cell, e.action) for e in eligible] == [
        (Cell(2, 2), Action.UP), (Cell(2, 1), Action.UP), (Cell(1, 1), Action.RIGHT),
    ]  # fmt: skip
    assert [e.trace for e in eligible] == pytest.approx([1.0, math.exp(-1 / 1.5), math.exp(-2 / 1.5)])
    assert path.collect() == []


def test_a_bump_leaves_no_trace_and_a_failed_move_breaks_the_path():
    path = PathTrace(tau_moves=1.5)
    path.add(walk(GRID, Cell(1, 1), Action.RIGHT))
    path.add(walk(GRID, Cell(1, 1), Action.LEFT))
    assert len(path.collect()) == 1
    path.add(walk(GRID, Cell(1, 1), Action.RIGHT))
    path.add(walk(GRID, Cell(2, 1), Action.RIGHT)._replace(outcome=Outcome.FAILED))
    assert path.collect() == []
