"""The tabular learners: textbook backups, the fixed points of dynamic programming, and what reduces to what."""

import numpy as np
import pytest
from bodiless import build, live, move

from scla_mj.grid import Action, Cell
from scla_mj.markov import hits_per_1000, transition_matrix, uniform_policy
from scla_mj.signals import Outcome, Percept

DISCOUNT = 0.9


def best_values(grid):
    """Return Q* (W, H, 4) by value iteration on the grid, swept until nothing changes."""
    values = np.zeros((*grid.cells, 4))
    while True:
        before = values.copy()
        for cell in grid.open_cells():
            for action in Action:
                after = grid.after(cell, action)
                future = 1.0 if after == grid.target else DISCOUNT * values[after.x - 1, after.y - 1].max()
                values[cell.x - 1, cell.y - 1, action] = 0.0 if cell == grid.target else future
        if (before == values).all():
            return values


def test_optimistic_q_learning_finds_every_shortest_path():
    brain, grid = build("q-learning")
    live(brain, grid, 6_000)
    for cell, distance in grid.distances.items():
        if cell != grid.target:
            assert brain.values[cell.x - 1, cell.y - 1].max() == pytest.approx(0.9 ** (distance - 1))


@pytest.mark.parametrize("brain", ["q-learning", "q-lambda", "dyna-q"])
def test_a_wandering_q_learner_reaches_the_fixed_point_of_value_iteration(brain):
    """Every action is random, so that every state and action is tried again and again."""
    learner, grid = build(brain, brain_settings={"epsilon": 1.0, "initial_value": 0.0})
    live(learner, grid, 2_500 if brain == "dyna-q" else 8_000)
    expected = best_values(grid)
    beside = np.array([cell != grid.target for cell in grid.all_cells()]).reshape(5, 5)
    np.testing.assert_allclose(learner.values[beside], expected[beside], atol=1e-12)


def test_one_backup_of_q_learning_is_the_textbooks():
    brain, grid = build("q-learning", brain_settings={"learning_rate": 0.5, "discount": 0.8, "initial_value": 0.25})
    up = move(grid, Cell(1, 1), Action.UP)
    brain.learn(up)
    assert brain.values[0, 0, Action.UP] == pytest.approx(0.25 + 0.5 * (0.8 * 0.25 - 0.25))
    brain.learn(up._replace(hit=True))
    assert brain.values[0, 0, Action.UP] == pytest.approx(0.225 + 0.5 * (1 - 0.225))
    brain.learn(up._replace(outcome=Outcome.FAILED))
    assert brain.values[0, 0, Action.UP] == pytest.approx(0.225 + 0.5 * (1 - 0.225))


def test_q_learning_learns_of_the_action_that_was_executed():
    brain, grid = build("q-learning")
    brain.learn(move(grid, Cell(1, 1), Action.RIGHT)._replace(action=Action.UP))
    assert brain.values[0, 0].tolist() == [1.0, 1.0, 1.0, 0.9]


@pytest.mark.parametrize(("brain", "off"), [("q-lambda", {"trace_decay": 0.0}), ("dyna-q", {"planning_steps": 0})])
@pytest.mark.parametrize("epsilon", [0.0, 0.2])
def test_without_traces_or_planning_it_is_q_learning_to_the_bit(brain, off, epsilon):
    plain, grid = build("q-learning", brain_settings={"epsilon": epsilon})
    reduced, _ = build(brain, brain_settings={"epsilon": epsilon, **off})
    full, _ = build(brain, brain_settings={"epsilon": epsilon})
    hits = [live(each, grid, 700) for each in (plain, reduced, full)]
    assert plain.values.tobytes() == reduced.values.tobytes() != full.values.tobytes()
    assert hits[0] == hits[1] != hits[2]


WAY = ((Cell(1, 3), Action.RIGHT), (Cell(2, 3), Action.RIGHT))


def walked(way, **settings):
    brain, grid = build("q-lambda", brain_settings={"initial_value": 0.0, **settings})
    for cell, action in way:
        brain.learn(move(grid, cell, action))
    return brain


@pytest.mark.parametrize("trace_decay", [0.25, 1.0])
def test_a_hit_reaches_the_whole_way_weighted_by_the_traces(trace_decay):
    """From zero only the hit has an error, of 1: every Q on the way gets (gamma lambda)^k of it."""
    brain = walked(((Cell(1, 1), Action.UP), (Cell(1, 2), Action.UP), *WAY), trace_decay=trace_decay)
    decay = DISCOUNT * trace_decay
    found = [brain.values[cell.x - 1, cell.y - 1, action] for cell, action in reversed(WAY)]
    assert [*found, brain.values[0, 1, Action.UP], brain.values[0, 0, Action.UP]] == pytest.approx(
        [1.0, decay, decay**2, decay**3]
    )
    assert np.count_nonzero(brain.values) == 4


@pytest.mark.parametrize("cut", ["explored", "failed", "hit"])
def test_an_action_that_is_not_greedy_a_failure_and_a_hit_cut_the_traces(cut):
    brain = walked(((Cell(1, 1), Action.UP),))
    _, grid = build("q-lambda")
    if cut == "explored":
        brain.values[0, 1, Action.LEFT] = 0.5
    if cut == "failed":
        brain.learn(move(grid, Cell(1, 2), Action.UP)._replace(outcome=Outcome.FAILED))
    if cut == "hit":
        brain.learn(move(grid, Cell(3, 2), Action.UP))
        assert brain.values[0, 0, Action.UP] > 0.0
    before = brain.values[0, 0, Action.UP]
    brain.learn(move(grid, Cell(1, 2), Action.UP))
    brain.learn(move(grid, Cell(3, 2), Action.UP))
    assert brain.values[0, 0, Action.UP] == before
    assert brain.values[2, 1, Action.UP] == 1.0


def test_planning_carries_a_hit_back_along_moves_that_were_made_once():
    brain, grid = build("dyna-q", brain_settings={"initial_value": 0.0, "planning_steps": 500})
    for cell, action in ((Cell(1, 1), Action.UP), (Cell(1, 2), Action.UP), *WAY):
        brain.learn(move(grid, cell, action))
    found = [brain.values[0, 0, Action.UP], brain.values[0, 1, Action.UP], brain.values[0, 2, Action.RIGHT]]
    assert [*found, brain.values[1, 2, Action.RIGHT]] == pytest.approx([0.9**3, 0.9**2, 0.9, 1.0])
    brain.learn(move(grid, Cell(2, 3), Action.RIGHT)._replace(hit=False))  # the target has left, and the model says so
    assert brain.values[0, 0, Action.UP] < 0.1


def test_with_a_reflex_it_moves_to_the_target_and_knows_what_that_is_worth():
    for name in ("q-learning", "q-lambda", "dyna-q", "actor-critic"):
        brain, grid = build(name, protocol="sensed-start", brain_settings={"sensing": "reflex"})
        assert live(brain, grid, 100, protocol="sensed-start") == 100
        assert live(brain, grid, 100, protocol="sensed-start", crossed=True) == 0
    brain, grid = build("q-learning", brain_settings={"sensing": "reflex", "initial_value": 0.0})
    brain.learn(move(grid, Cell(1, 3), Action.RIGHT))
    assert brain.values[0, 2, Action.RIGHT] == pytest.approx(0.9)
    assert brain.values[1, 2].tolist() == [0.0, 0.0, 0.0, 1.0]


@pytest.mark.parametrize("name", ["q-learning", "q-lambda", "dyna-q", "actor-critic"])
def test_where_the_sensed_direction_is_the_state_what_was_learned_beside_one_target_holds_beside_another(name):
    """Beside one target a direction is a cell by another name: the same decisions, until the target moves."""
    by_cell, grid = build(name)
    by_sense, _ = build(name, brain_settings={"sensing": "state"})
    assert live(by_cell, grid, 1500) == live(by_sense, grid, 1500)
    for sensed in Action:
        cell = Cell(5, 5).after(sensed.opposite)  # nobody ever sensed a target there
        chosen = [by_sense.decide(Percept(cell, sensed)).action for _ in range(20)]
        assert chosen.count(sensed) >= 19


@pytest.mark.parametrize("name", ["q-learning", "dyna-q"])
def test_q_learning_learns_with_crossed_wheels_what_it_learns_with_straight_ones(name):
    brain, grid = build(name)
    live(brain, grid, 2000, crossed=True)
    assert live(brain, grid, 500, crossed=True) == pytest.approx(200, abs=15)


def test_the_actor_critics_values_rest_at_those_of_its_policy():
    """At V of the uniform policy, from its linear system, the errors of the four actions of a cell add up to zero."""
    brain, grid = build("actor-critic", brain_settings={"critic_rate": 0.5})
    cells = grid.open_cells()
    chain = transition_matrix(grid, uniform_policy(grid)).toarray()
    target = cells.index(grid.target)
    inner = [number for number in range(len(cells)) if number != target]
    between = DISCOUNT * chain[np.ix_(inner, inner)]
    solved = np.linalg.solve(np.eye(len(inner)) - between, chain[inner, target])
    for number, value in zip(inner, solved, strict=True):
        brain.values[cells[number].x - 1, cells[number].y - 1] = value
    fresh = brain.state()
    for number, value in zip(inner, solved, strict=True):
        errors = []
        for action in Action:
            brain.restore(fresh)
            brain.learn(move(grid, cells[number], action))
            errors.append((brain.values[cells[number].x - 1, cells[number].y - 1] - value) / 0.5)
        assert sum(errors) == pytest.approx(0.0, abs=1e-12)
        assert max(map(abs, errors)) > 1e-3


def test_the_actor_follows_the_gradient_of_the_logarithm_of_its_policy():
    brain, grid = build("actor-critic", brain_settings={"actor_rate": 0.7, "critic_rate": 0.0})
    state = brain.state()
    row = brain.row(Percept(Cell(2, 3), Action.RIGHT))
    state["actor"][row] = [0.3, -0.2, 0.5, 0.1]
    brain.restore(state)

    def log_policy(preferences):
        return preferences[Action.LEFT] - np.log(np.exp(preferences).sum())

    steps = 1e-6 * np.eye(4)
    gradient = [(log_policy(state["actor"][row] + h) - log_policy(state["actor"][row] - h)) / 2e-6 for h in steps]
    brain.learn(move(grid, Cell(2, 3), Action.LEFT)._replace(hit=True))  # an error of 1
    changed = brain.state()["actor"] - state["actor"]
    np.testing.assert_allclose(changed[row], 0.7 * np.array(gradient), atol=1e-9)
    assert not np.delete(changed, row, axis=0).any()


def test_the_actor_critic_learns_and_its_snapshot_is_the_policy_that_it_follows():
    brain, grid = build("actor-critic")
    live(brain, grid, 4000)
    policy = brain.snapshot().probabilities
    expected = hits_per_1000(grid, "any-start", policy)
    assert expected > 330
    # A renewal process of some 2.7 moves per hit with a deviation of about 1.2.
    assert live(brain, grid, 1000) == pytest.approx(expected, abs=40)
    brain, _ = build("actor-critic")
    assert brain.snapshot().probabilities.tolist() == np.full((5, 5, 4), 0.25).tolist()
