"""SCLA's parts alone: automata without a network, its cell states without automata; and that all resume."""

import numpy as np
import pytest
from bodiless import build, live, move

from scla_mj.brain.registry import BRAINS
from scla_mj.config import AutomatonConfig, GridConfig
from scla_mj.grid import Action, Cell
from scla_mj.signals import Outcome, Percept

NETLESS = [name for name in BRAINS if not name.startswith(("scla", "network"))]


@pytest.mark.parametrize("credit", ["executed", "decided"])
def test_the_automata_hear_in_the_printed_form_exactly_what_they_hear_without_its_network(credit):
    """Bumps, hits, moves astray and failures: with the same moves every probability is the same to the bit."""
    settings = {"automaton": AutomatonConfig(credit=credit)}
    (scla, grid), (alone, _) = build("scla-printed", **settings), build("automata-everywhere", **settings)
    rng = np.random.default_rng(1)
    cell = Cell(1, 1)
    for _ in range(400):
        came = move(grid, cell, Action(int(rng.integers(4))))
        if rng.random() < 0.2:
            came = came._replace(action=Action(int(rng.integers(4))))
        if rng.random() < 0.05:
            came = came._replace(outcome=Outcome.FAILED)
        for brain in (scla, alone):
            brain.learn(came)
        cell = Cell(5, 1) if came.hit else came.after.cell
    assert scla.automata.probabilities.tobytes() == alone.automata.probabilities.tobytes()
    assert alone.automata.probabilities.max() > 0.9


def test_automata_that_decide_everywhere_learn_every_shortest_path():
    brain, grid = build("automata-everywhere")
    live(brain, grid, 2500)
    best = brain.snapshot().probabilities.argmax(axis=2)
    for cell, distance in grid.distances.items():
        if distance:
            assert grid.distances[grid.after(cell, Action(best[cell.x - 1, cell.y - 1]))] == distance - 1
    decision = brain.decide(Percept(Cell(3, 2), Action.UP))
    assert decision.advised == decision.action and decision.motor_spikes is None


def test_a_perfect_reflex_hits_with_every_decision_that_starts_next_to_the_target():
    brain, grid = build("automata-reflex", protocol="sensed-start")
    assert live(brain, grid, 200, protocol="sensed-start") == 200
    assert live(brain, grid, 200, protocol="sensed-start", crossed=True) == 0
    assert brain.decide(Percept(Cell(1, 1), None)).advised is not None


def test_a_coin_chooses_between_the_two_motors_that_are_wired_and_costs_the_way_back():
    """m = 1 + (1 + m) / 2 moves per hit, 3, once the automata know the way back: 333.3 of 1000."""
    brain, grid = build("automata-coin", protocol="sensed-start")
    for sensed in Action:
        chosen = [brain.decide(Percept(Cell(3, 2), sensed)).action for _ in range(400)]
        assert set(chosen) == {sensed, sensed.opposite}
        assert chosen.count(sensed) == pytest.approx(200, abs=50)
    live(brain, grid, 2000, protocol="sensed-start")
    # Misses before a hit are geometric with variance 2, each costing two moves: 2 sqrt(2) moves' deviation per hit.
    hits = live(brain, grid, 9000, protocol="sensed-start")
    assert hits == pytest.approx(3000, abs=5 * np.sqrt(9000 * 8 / 27))


@pytest.mark.parametrize("closed", [(), ((2, 3), (3, 2))])
def test_the_cell_states_rest_at_the_fixed_point_of_value_iteration_and_lead_along_shortest_paths(closed):
    brain, grid = build("cell-states", grid=GridConfig(closed_cells=closed))
    live(brain, grid, 3000)
    for cell, distance in grid.distances.items():
        assert brain.states[cell] == pytest.approx(0.9**distance)
        if distance:
            for _ in range(5):
                action = brain.decide(Percept(cell, grid.sensed_from(cell))).action
                assert grid.distances[grid.after(cell, action)] == distance - 1


@pytest.mark.parametrize("name", NETLESS)
def test_a_brain_continues_from_its_state_as_if_nothing_had_happened(name):
    brain, grid = build(name)
    again, _ = build(name)
    live(brain, grid, 700)
    state = brain.state()
    later = [live(brain, grid, 300, seed=2), repr(brain.state())]
    again.restore(state)
    assert [live(again, grid, 300, seed=2), repr(again.state())] == later


def test_the_cell_states_brain_bumps_into_a_wall_once():
    brain, grid = build("cell-states")
    for action in (Action.LEFT, Action.DOWN):
        brain.learn(move(grid, Cell(1, 1), action))
    chosen = {brain.decide(Percept(Cell(1, 1), None)).action for _ in range(60)}
    assert chosen == {Action.UP, Action.RIGHT}
