"""The spiking actor-critic: its race and rates in closed form, TD's fixed point, and what its one dopamine reaches."""

import math

import numpy as np
import pytest
from bodiless import build, move

from scla_mj.brain.potjans import ACTOR, ACTORS, current_at, rate_hz
from scla_mj.grid import Action, Cell
from scla_mj.signals import Feedback, Outcome, Percept

DRIVE_S, CROSSED_S = 0.9, 0.45


def built(**settings):
    return build("potjans", brain_settings=settings)


def lived(brain, came):
    """Let the brain decide and learn of what came of it, whatever it decided."""
    chosen = brain.decide(came.before)
    brain.elapse(DRIVE_S)
    brain.learn(came._replace(action=chosen.action, executed=chosen.action, crossed_s=CROSSED_S))
    return chosen.action


def live(brain, grid, decisions, seed=0):
    """Return whether each decision came nearer to the target."""
    rng = np.random.default_rng(seed)
    starts = grid.start_cells("any-start")
    cell, nearer = starts[rng.integers(len(starts))], []
    for _ in range(decisions):
        action = brain.decide(Percept(cell, None)).action
        came = move(grid, cell, action)
        brain.elapse(DRIVE_S)
        brain.learn(came._replace(crossed_s=CROSSED_S if came.outcome is Outcome.MOVED else None))
        nearer.append(grid.distances[came.after.cell] < grid.distances[cell])
        cell = starts[rng.integers(len(starts))] if came.hit else came.after.cell
    return np.array(nearer)


def weights_of(brain):
    return {name: weights.copy() for name, weights in brain.snapshot().weights.items()}


def bits_of(brain):
    return b"".join(weights.tobytes() for weights in weights_of(brain).values())


def test_an_actor_under_a_constant_current_fires_when_its_equation_says():
    brain, _ = built(actor_noise=0.0)
    theta, suppressed = ACTOR.threshold_mv - ACTOR.rest_mv, brain.network.memory.v[brain.network.populations[1].start]
    begin = suppressed - ACTOR.rest_mv
    assert begin < -60.0
    currents = np.array([23.0, 31.0, 44.0, 72.0])
    drive = np.zeros(brain.network.description.size)
    actors = brain.network.populations[1:5]
    for population, current in zip(actors, currents, strict=True):
        drive[population.start] = current
    brain.network.advance(45, drive)
    spikes = brain.network.spikes()
    for population, current in zip(actors, currents, strict=True):
        charged_ms = ACTOR.tau_ms * math.log((current - begin) / (current - theta))
        first = spikes.step[spikes.neuron == population.start][0]
        assert first == math.ceil(charged_ms) - 1  # the spike of the step that ends at or after it


@pytest.mark.parametrize("favourite", list(Action))
def test_the_first_actor_to_fire_decides_and_all_four_are_silent_from_then_on(favourite):
    brain, _ = built()
    weights = brain.network.weights("statetoactor_up")
    for action, name in zip(Action, ACTORS, strict=True):
        brain.network.set_weights(f"stateto{name}", weights * (2.0 if action == favourite else 0.7))
    for cell in (Cell(1, 1), Cell(3, 4), Cell(5, 5)):
        chosen = brain.decide(Percept(cell, None))
        assert chosen.action == favourite
        assert chosen.motor_spikes == tuple(int(action == favourite) for action in Action)
        lived(brain, Feedback(Percept(cell, None), favourite, favourite, Outcome.FAILED, Percept(cell, None), False))


@pytest.mark.parametrize("current", [21.0, 35.0, 90.0])
def test_the_current_for_a_rate_is_the_inverse_of_the_rate_for_a_current(current):
    assert current_at(rate_hz(current)) == pytest.approx(current)
    assert rate_hz(19.9) == 0.0


@pytest.mark.parametrize("discount", [0.5, 0.8])
def test_in_a_chain_of_two_cells_the_critics_rate_is_the_fixed_point_of_td(discount):
    brain, grid = built(discount=discount, critic_rate=0.8)
    seen = []
    for _ in range(90):
        for cell in (Cell(1, 3), Cell(2, 3)):
            lived(brain, move(grid, cell, Action.RIGHT))
            seen.append(brain.values[0])
    first, second = np.array(seen[-60:]).reshape(-1, 2).mean(axis=0)
    assert second == pytest.approx(1.0, abs=0.03)
    assert first == pytest.approx(discount, abs=0.03)


def test_without_dopamine_no_weight_changes_by_a_bit():
    (silent, grid), (heard, _) = built(release=0.0), built()
    before = bits_of(silent)
    for brain in (silent, heard):
        live(brain, grid, 60)
    assert bits_of(silent) == before != bits_of(heard)


def test_a_clipped_dip_changes_nothing_and_a_rise_what_it_changes_unclipped():
    (clipped, grid), (whole, _) = (built(clip_dips=clip) for clip in (True, False))
    before = bits_of(clipped)
    bump, hit = move(grid, Cell(1, 1), Action.LEFT), move(grid, Cell(2, 3), Action.RIGHT)
    for brain in (clipped, whole):
        for _ in range(3):
            lived(brain, bump)
            assert brain.error < 0.0
    assert bits_of(clipped) == before != bits_of(whole)
    fresh, _ = built()
    for brain in (again := built(clip_dips=True)[0], fresh):
        lived(brain, hit)
        assert brain.error > 0.0
    assert bits_of(again) == bits_of(fresh) != before


def test_a_hit_strengthens_the_cells_synapses_onto_the_critic_and_onto_the_actor_that_fired_alone():
    brain, grid = built()
    before = weights_of(brain)
    chosen = lived(brain, move(grid, Cell(2, 3), Action.RIGHT))
    assert sum(brain.network.spikes().counts[1:5]) == 1
    neurons = (1 * 5 + 2) * 20 + np.arange(20)
    for name, weights in weights_of(brain).items():
        risen = weights > before[name]
        expected = np.zeros_like(risen)
        expected[neurons] = name in (f"statetoactor_{chosen.label}", "statetocritic")
        assert (risen == expected).all() and (weights == before[name])[~expected].all()


def test_a_move_that_failed_teaches_nothing():
    brain, grid = built()
    before = bits_of(brain)
    lived(brain, move(grid, Cell(2, 3), Action.RIGHT)._replace(outcome=Outcome.FAILED))
    assert brain.error == 0.0 and bits_of(brain) == before


def test_it_continues_from_its_state_as_if_nothing_had_happened():
    (brain, grid), (again, _) = built(), built()
    live(brain, grid, 40)
    again.restore(brain.state())
    assert (live(brain, grid, 40, seed=1) == live(again, grid, 40, seed=1)).all()
    assert bits_of(brain) == bits_of(again) and repr(brain.state()) == repr(again.state())


def test_it_learns_shortest_paths_from_the_reward_alone():
    brain, grid = built()
    nearer = live(brain, grid, 800)
    assert nearer[:100].mean() < 0.7 and nearer[-200:].mean() > 0.9


def test_its_snapshot_has_the_value_of_every_cell_which_begins_as_it_was_set():
    brain, _ = built()
    np.testing.assert_allclose(brain.snapshot().values, np.full((5, 5), 0.6), atol=0.01)


def test_its_anatomy_is_that_of_its_network():
    brain, _ = built(state_neurons=3, critic_neurons=7)
    network, anatomy = brain.network, brain.anatomy
    assert [(p.name, p.start, p.stop) for p in network.populations] == [p[:3] for p in anatomy.populations]
    assert [p.name for p in anatomy.of_role("motor")] == list(ACTORS)
    assert {p.name: p.shape for p in anatomy.projections} == {k: w.shape for k, w in weights_of(brain).items()}
