"""One dopamine: the critic in closed form, and what the brain that it teaches does with it."""

import numpy as np
import pytest

from scla_mj.brain.dopamine import Critic
from scla_mj.brain.registry import build_brain
from scla_mj.checked import check
from scla_mj.config import RunConfig
from scla_mj.grid import Action, Cell, Grid
from scla_mj.signals import Feedback, Outcome, Percept

MOVE_S, CROSSED_S = 0.9, 0.45
GRID = Grid((5, 5), Cell(3, 3), 0.3)
RATE, INITIAL, LEAST, DISCOUNT = 0.2, 0.5, 0.2, 0.9


def critic():
    return Critic(discount=DISCOUNT, rate=RATE, initial=INITIAL, least=LEAST)


def build(**settings):
    return build_brain(check(RunConfig(brain="scla-dopamine", brain_settings=settings)))


def percept(cell, grid=GRID):
    return Percept(cell, grid.sensed_from(cell))


def moved(cell, action, grid=GRID, *, crossed=False):
    """The feedback of a move on the grid, which crossed wheels carry out the other way round."""
    after = grid.after(cell, action.opposite if crossed else action)
    outcome = Outcome.BLOCKED if after == cell else Outcome.MOVED
    crossed_s = CROSSED_S if outcome is Outcome.MOVED else None
    return Feedback(percept(cell), action, action, outcome, percept(after), after == grid.target, crossed_s)


def live(brain, decisions, *, seed, crossed=False):
    """Let a brain decide next to the target without a body; returns for each sensed decision whether it hit."""
    rng, starts, hits = np.random.default_rng(seed), GRID.start_cells("sensed-start"), []
    cell = starts[rng.integers(len(starts))]
    for _ in range(decisions):
        sensed = percept(cell)
        came = moved(cell, brain.decide(sensed).action, crossed=crossed)
        brain.elapse(MOVE_S)
        brain.learn(came)
        if sensed.sensed is not None:
            hits.append(came.hit)
        cell = starts[rng.integers(len(starts))] if came.hit else came.after.cell
    return hits


def test_expectation_next_to_the_target_follows_rescorla_and_wagner():
    taught, errors = critic(), []
    for _ in range(20):
        errors.append(taught.prediction_error(moved(Cell(3, 2), Action.UP)))
    assert errors == pytest.approx([(1 - INITIAL) * (1 - RATE) ** n for n in range(20)])
    assert taught.expected(Action.UP) == pytest.approx(1 - (1 - INITIAL) * (1 - RATE) ** 20)


def test_a_miss_next_to_the_target_is_always_a_disappointment():
    taught = critic()
    errors = [taught.prediction_error(moved(Cell(3, 2), Action.DOWN)) for _ in range(30)]
    assert errors == sorted(errors) and errors[0] == -INITIAL and errors[-1] == -LEAST


def test_elsewhere_a_move_is_worth_the_change_of_the_discounted_distance():
    taught, rng, cell = critic(), np.random.default_rng(0), Cell(1, 1)
    for move in range(4000):
        came = moved(cell, Action(int(rng.integers(4))))
        error = taught.prediction_error(came)
        if move > 3000 and came.before.sensed is None:
            away, then = (abs(c.x - 3) + abs(c.y - 3) for c in (cell, came.after.cell))
            bump = -1.0 if came.outcome is Outcome.BLOCKED else 0.0
            assert error == pytest.approx(bump + DISCOUNT**then - DISCOUNT**away)
        cell = Cell(1, 1) if came.hit else came.after.cell


@pytest.mark.parametrize("action", [Action.UP, Action.DOWN])
def test_dopamine_is_the_same_at_all_projections_whatever_was_sensed_and_done(action):
    brain = build()
    brain.decide(percept(Cell(3, 2)))
    brain.elapse(MOVE_S)
    brain.learn(moved(Cell(3, 2), action))
    left = brain.network.dopamine
    decayed = 0.35 * brain.prediction_error * np.exp(-(MOVE_S - CROSSED_S) / 0.2)
    assert left == pytest.approx(np.full(8, decayed), rel=0.01)  # one of 200 steps of rounding
    assert np.sign(left[0]) == (1 if action is Action.UP else -1)


def test_no_dopamine_reaches_the_network_where_no_sensory_population_was_driven():
    brain = build()
    for cell, action in ((Cell(1, 1), Action.UP), (Cell(1, 1), Action.DOWN), (Cell(3, 1), Action.UP)):
        brain.decide(percept(cell))
        brain.elapse(MOVE_S)
        brain.learn(moved(cell, action))
        assert not brain.network.dopamine.any()


def test_dopamine_is_the_only_teacher():
    brain = build(release=0.0)
    weights, probabilities = brain.network.weights, brain.automata.probabilities
    live(brain, 60, seed=1)
    assert (brain.network.weights == weights).all() and (brain.automata.probabilities == probabilities).all()


@pytest.mark.parametrize("crossed", [False, True])
def test_it_learns_which_way_the_wheels_turn(crossed):
    hits = live(build(), 160, seed=3, crossed=crossed)
    chance, decisions = 0.5, 60
    margin = 5 * (chance * (1 - chance) / decisions) ** 0.5  # five standard deviations of a coin
    assert np.mean(hits[-decisions:]) > chance + margin


def test_a_dip_penalises_the_way_and_rewards_the_way_back():
    brain = build()
    brain.decide(percept(Cell(3, 2)))
    brain.elapse(MOVE_S)
    brain.learn(moved(Cell(3, 2), Action.DOWN))
    assert brain.automata.probabilities[2, 1, Action.DOWN] == pytest.approx(0.25 * 0.8)
    assert brain.automata.probabilities[2, 0, Action.UP] == pytest.approx(0.25 + 0.5 * 0.75)
    kept = build(undo=False)
    kept.learn(moved(Cell(3, 2), Action.DOWN))
    assert (kept.automata.probabilities[2, 0] == 0.25).all()


def test_a_move_that_went_astray_is_not_held_against_any_action():
    brain = build()
    astray = moved(Cell(3, 2), Action.DOWN)._replace(action=Action.UP)
    brain.learn(astray)
    assert brain.prediction_error < 0 and (brain.automata.probabilities == 0.25).all()


def test_a_failed_move_teaches_nothing():
    brain = build()
    brain.learn(moved(Cell(3, 2), Action.UP)._replace(outcome=Outcome.FAILED))
    assert brain.prediction_error == 0.0 and (brain.automata.probabilities == 0.25).all()


def test_the_winners_own_rate_can_be_the_expectation():
    brain = build(expectation="rate", least_expectation=0.0)
    decided = brain.decide(percept(Cell(3, 2)))
    brain.learn(moved(Cell(3, 2), Action.UP))
    spikes_per_neuron = max(decided.motor_spikes) / 100
    assert brain.prediction_error == pytest.approx(1 - (spikes_per_neuron - 1))
    assert np.mean(live(brain, 120, seed=4)[-60:]) == 1.0
