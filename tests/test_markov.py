"""A policy's exact earnings against the figures of docs/errata.md and a closed form."""

import numpy as np
import pytest

from scla_mj.grid import Action, Cell, Grid
from scla_mj.markov import (
    chance_hits_per_1000,
    coin_policy,
    expected_moves,
    fewest_expected_moves,
    hits_per_1000,
    transition_matrix,
    uniform_policy,
)

PAPER = Grid((5, 5), Cell(3, 3), 0.3)


def greedy_policy(grid: Grid) -> np.ndarray:
    """One action a cell, always one that brings the target nearer."""
    policy = np.zeros((*grid.cells, 4))
    for cell in grid.open_cells():
        if cell != grid.target:
            policy[cell.x - 1, cell.y - 1, min(grid.neighbours(cell), key=lambda step: grid.distances[step[1]])[0]] = (
                1.0
            )
    return policy


def test_a_random_walk_earns_31_58_from_any_start():
    assert hits_per_1000(PAPER, "any-start", uniform_policy(PAPER)) == pytest.approx(31.58, abs=0.005)


def test_a_random_walk_from_next_to_the_target_takes_24_moves_and_earns_41_67():
    assert hits_per_1000(PAPER, "sensed-start", uniform_policy(PAPER)) == pytest.approx(1000 / 24, rel=1e-12)


def test_a_coin_between_the_two_wired_motors_earns_a_third_of_sensed_start():
    """m = 1 + (1 + m) / 2: a miss costs the move back."""
    assert chance_hits_per_1000(PAPER, "sensed-start") == pytest.approx(1000 / 3, rel=1e-12)
    assert chance_hits_per_1000(PAPER, "any-start") == hits_per_1000(PAPER, "any-start", uniform_policy(PAPER))


def test_a_coin_that_bumps_into_a_wall_costs_no_move_back():
    """A target in the middle of three cells: m = 1 + m / 2."""
    assert chance_hits_per_1000(Grid((3, 1), Cell(2, 1), 0.3), "sensed-start") == pytest.approx(500.0)


def test_from_any_start_a_coin_costs_two_moves_per_miss():
    """Beside the target 3 moves instead of 1, so 2 more from everywhere: 4.5 moves per hit instead of 2.5."""
    assert hits_per_1000(PAPER, "any-start", coin_policy(PAPER)) == pytest.approx(1000 / 4.5, rel=1e-12)


def test_where_action_noise_says_everything_chance_is_the_random_walk():
    assert chance_hits_per_1000(PAPER, "sensed-start", action_noise=0.75) == pytest.approx(1000 / 24, rel=1e-9)
    noisy = [chance_hits_per_1000(PAPER, "sensed-start", action_noise=noise) for noise in (0.0, 0.1, 0.3)]
    assert noisy == sorted(noisy, reverse=True)


def test_perfect_next_to_the_target_and_random_elsewhere_is_the_papers_automaton():
    """115 hits and about 9 moves per hit in the paper; exactly 115.38 and 26/3."""
    policy = uniform_policy(PAPER)
    for cell in PAPER.start_cells("sensed-start"):
        policy[cell.x - 1, cell.y - 1] = np.eye(4)[PAPER.sensed_from(cell)]
    hits = hits_per_1000(PAPER, "any-start", policy)
    assert hits == pytest.approx(115.38, abs=0.005)
    assert 1000 / hits == pytest.approx(8.67, abs=0.005)


@pytest.mark.parametrize(
    ("cells", "target"), [((5, 5), (3, 3)), ((5, 5), (1, 1)), ((5, 5), (5, 2)), ((7, 7), (4, 4)), ((4, 2), (1, 2))]
)
@pytest.mark.parametrize("protocol", ["any-start", "sensed-start"])
def test_a_shortest_path_policy_earns_the_ceiling(cells, target, protocol):
    grid = Grid(cells, Cell(*target), 0.3)
    assert hits_per_1000(grid, protocol, greedy_policy(grid)) == pytest.approx(grid.ceiling_hits_per_1000(protocol))


def test_a_random_walk_on_a_corridor_has_the_gamblers_closed_form():
    """Absorbed at 0, kept at the far end n, half of all moves bumping sideways: 2 (k (2 n + 1) - k^2) moves."""
    length = 8
    grid = Grid((length + 1, 1), Cell(1, 1), 0.3)
    moves = expected_moves(grid, uniform_policy(grid))
    for k in range(1, length + 1):
        assert moves[Cell(k + 1, 1)] == pytest.approx(2 * (k * (2 * length + 1) - k * k))


def test_rows_of_the_chain_are_distributions_and_the_target_absorbs():
    chain = transition_matrix(PAPER, uniform_policy(PAPER))
    assert chain.sum(axis=1) == pytest.approx(np.ones(25))
    assert chain[12, 12] == 1.0


def test_a_policy_that_may_lose_its_way_earns_nothing():
    policy = greedy_policy(PAPER)
    policy[0, 0] = np.eye(4)[Action.LEFT]  # into the wall, for ever
    assert hits_per_1000(PAPER, "any-start", policy) == 0.0
    assert hits_per_1000(PAPER, "sensed-start", policy) == 1000.0
    policy[0, 1] = [0.5, 0.5, 0.0, 0.0]  # (1, 2) now falls into that trap half the time
    assert expected_moves(PAPER, policy)[Cell(1, 2)] == np.inf


@pytest.mark.parametrize("noise", [1e-300, 0.75])
def test_the_best_policy_is_found_where_moves_are_almost_never_or_always_chance(noise):
    grid = Grid((1, 3000), Cell(1, 1), 0.3)  # far beyond what value iteration can sweep in a second
    moves = fewest_expected_moves(grid, action_noise=noise)
    far = moves[Cell(1, 3000)]
    if noise == 0.75:  # a walk that stays half the time, between a wall and the target 2999 cells away: n (n + 1) / p
        assert far == pytest.approx(2999 * 3000 / 0.5, rel=1e-9)
    else:
        assert far == 2999
