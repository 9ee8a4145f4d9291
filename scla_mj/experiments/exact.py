"""Figures that need no run: what the grid itself allows, by search and by solving Markov chains."""

from __future__ import annotations

import numpy as np

from scla_mj.experiments import paper
from scla_mj.grid import Action, Cell, Grid, StartProtocol
from scla_mj.markov import coin_policy, hits_per_1000, uniform_policy

_CELL_M = 1.0  # arithmetic on cells: their size does not matter


def grid_of(cells: tuple[int, int], target: tuple[int, int]) -> Grid:
    """Return an arena without closed cells."""
    return Grid(cells, Cell(*target), _CELL_M)


def paper_grid() -> Grid:
    """Return the paper's arena."""
    return grid_of(paper.CELLS, paper.TARGET)


def random_walk(protocol: StartProtocol, grid: Grid | None = None) -> float:
    """Return a random walk's hits per 1000, by default in the paper's arena."""
    grid = grid or paper_grid()
    return hits_per_1000(grid, protocol, uniform_policy(grid))


def coin(protocol: StartProtocol) -> float:
    """Return the hits per 1000 of a network that chooses by a coin and automata that are perfect."""
    return hits_per_1000(paper_grid(), protocol, coin_policy(paper_grid()))


def next_to_the_target() -> float:
    """Return the hits per 1000, any-start, of a policy that is perfect next to the target and random elsewhere."""
    grid = paper_grid()
    policy = uniform_policy(grid)
    for action, cell in (
        (action, cell) for cell in grid.open_cells() if (action := grid.sensed_from(cell)) is not None
    ):
        policy[cell.x - 1, cell.y - 1] = np.eye(len(Action))[action]
    return hits_per_1000(grid, "any-start", policy)
