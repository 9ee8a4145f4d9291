"""The schemes against their closed forms."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scla_mj.brain.automata import LearningAutomata
from scla_mj.config import AutomatonConfig
from scla_mj.errors import SclaError
from scla_mj.grid import Action, Cell

CELL = Cell(2, 4)


def build(**settings):
    return LearningAutomata((5, 5), AutomatonConfig(**settings), rng=np.random.default_rng(0))


def vector(automata):
    return automata.probabilities[CELL.x - 1, CELL.y - 1]


def test_n_rewards_leave_the_other_actions_one_minus_a_to_the_n():
    automata = build(reward_rate=0.1)
    for _ in range(7):
        automata.reward(CELL, Action.LEFT)
    assert vector(automata)[Action.LEFT] == pytest.approx(1 - 0.75 * 0.9**7)
    assert vector(automata)[Action.UP] == pytest.approx(0.25 * 0.9**7)


def test_a_penalty_shares_what_it_takes_among_the_other_actions():
    automata = build(penalty_rate=0.3)
    automata.penalise(CELL, Action.DOWN)
    assert vector(automata) == pytest.approx([0.25 * 0.7 + 0.1, 0.25 * 0.7, 0.25 * 0.7 + 0.1, 0.25 * 0.7 + 0.1])


def test_a_weight_scales_the_reward_rate():
    automata = build(reward_rate=0.4)
    automata.reward(CELL, Action.UP, weight=0.25)
    assert vector(automata)[Action.UP] == pytest.approx(0.25 + 0.1 * 0.75)


def test_reward_inaction_ignores_penalties_and_epsilon_penalty_scales_them():
    inaction, epsilon = build(scheme="reward-inaction"), build(scheme="reward-epsilon-penalty", epsilon=0.1)
    for automata in (inaction, epsilon):
        automata.penalise(CELL, Action.RIGHT)
    assert vector(inaction).tolist() == [0.25] * 4
    assert vector(epsilon)[Action.RIGHT] == pytest.approx(0.25 * (1 - 0.1 * 0.2))


def test_the_opposite_pair_scheme_leaves_the_actions_on_either_side_unchanged():
    automata = build(scheme="opposite-pair", reward_rate=0.5, penalty_rate=0.2)
    automata.reward(CELL, Action.UP)
    assert vector(automata) == pytest.approx([0.375, 0.125, 0.25, 0.25])
    automata.penalise(CELL, Action.UP)
    assert vector(automata) == pytest.approx([0.3, 0.2, 0.25, 0.25])


def test_only_the_named_cell_changes():
    automata = build()
    automata.reward(CELL, Action.UP)
    automata.penalise(CELL, Action.DOWN)
    changed = (automata.probabilities != 0.25).any(axis=2)
    assert np.argwhere(changed).tolist() == [[CELL.x - 1, CELL.y - 1]]


@given(
    st.sampled_from(["reward-penalty", "reward-inaction", "reward-epsilon-penalty", "opposite-pair"]),
    st.floats(0, 1),
    st.floats(0, 1),
    st.lists(st.tuples(st.booleans(), st.sampled_from(list(Action))), max_size=60),
)
def test_probabilities_stay_probabilities(scheme, reward_rate, penalty_rate, signals):
    automata = build(scheme=scheme, reward_rate=reward_rate, penalty_rate=penalty_rate)
    for good, action in signals:
        (automata.reward if good else automata.penalise)(CELL, action)
    assert (vector(automata) >= 0).all()
    assert vector(automata).sum() == pytest.approx(1)


def test_actions_are_drawn_as_often_as_they_are_probable():
    automata, draws = build(), 20_000
    probabilities = np.array([0.5, 0.05, 0.3, 0.15])
    every = automata.probabilities.copy()
    every[CELL.x - 1, CELL.y - 1] = probabilities
    automata.probabilities = every
    counts = np.bincount([automata.draw(CELL) for _ in range(draws)], minlength=4)
    margin = 5 * np.sqrt(draws * probabilities * (1 - probabilities))
    assert (np.abs(counts - draws * probabilities) < margin).all()


def test_a_certain_automaton_never_draws_anything_else():
    automata = build(reward_rate=1.0)
    automata.reward(CELL, Action.RIGHT)
    assert {automata.draw(CELL) for _ in range(200)} == {Action.RIGHT}
    assert math.isclose(vector(automata).sum(), 1)


def test_probabilities_are_changed_by_assignment_only_and_only_to_probabilities():
    automata = build()
    with pytest.raises(ValueError, match="read-only"):
        automata.probabilities[0, 0] = 1.0
    good = automata.probabilities
    for wrong in (good[:1], good * 2, good - 0.5, good * np.nan, "a", None):
        with pytest.raises(SclaError, match=r"probabilities (are|have|must)"):
            automata.probabilities = wrong
    np.testing.assert_array_equal(automata.probabilities, good)
