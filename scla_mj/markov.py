"""What a fixed policy earns, exactly: the grid as a Markov chain, solved and not sampled."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from scla_mj.grid import Action, Cell, Grid, StartProtocol

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_CONVERGED: Final = 1e-12
_SAME: Final = 1e-6
"""What is solved for in two ways differs by less, in shares of itself."""
_MOST_SWEEPS: Final = 2000
"""Value iteration in the paper's arena takes 1500 at most; a hundred times the cells would take hours."""


def uniform_policy(grid: Grid) -> NDArray[np.float64]:
    """Return the random walk's action probabilities (W, H, 4)."""
    return np.full((*grid.cells, len(Action)), 1.0 / len(Action))


def coin_policy(grid: Grid) -> NDArray[np.float64]:
    """Return the policy (W, H, 4) of SCLA whose network has learned nothing, and whose automata are perfect.

    Where the target is sensed a coin chooses between the two wired moves, towards it and straight away; everywhere else
    every shortest path is as likely.
    """
    policy = np.zeros((*grid.cells, len(Action)))
    for cell in grid.open_cells():
        sensed = grid.sensed_from(cell)
        if sensed is not None:
            good = [sensed, sensed.opposite]
        else:
            good = [action for action, beyond in grid.neighbours(cell) if grid.distances[beyond] < grid.distances[cell]]
        policy[cell.x - 1, cell.y - 1, good] = 1.0 / max(len(good), 1)
    return policy


def chance_hits_per_1000(grid: Grid, protocol: StartProtocol, *, action_noise: float = 0.0) -> float:
    """Return what is earned by a brain that has learned nothing of what the protocol asks for.

    From any start that is the random walk. From next to the target it is `coin_policy`: there only the choice between
    two wired motors is asked for, and one bit by chance is right every other time (1000 / 3 in the open).
    """
    policy = uniform_policy(grid) if protocol == "any-start" else coin_policy(grid)
    return hits_per_1000(grid, protocol, policy @ _executed(action_noise))


def hits_per_1000(grid: Grid, protocol: StartProtocol, policy: NDArray[np.float64]) -> float:
    """Return the long-run hits per 1000 decisions of a policy: 1000 over the mean number of moves to a hit.

    `policy` holds the action probabilities (W, H, 4) of every cell; a bump stays where it is and counts as a move. A
    policy that may stop reaching the target from some start earns 0.
    """
    moves = expected_moves(grid, policy)
    return 1000.0 / float(np.mean([moves[cell] for cell in grid.start_cells(protocol)]))


def expected_moves(grid: Grid, policy: NDArray[np.float64]) -> dict[Cell, float]:
    """Return the mean number of moves from every open cell to the target, infinite where it may never be reached.

    Solves m = 1 + P m over the cells from which the target is reached with certainty (Kemeny and Snell 1960, 3.2.4).
    """
    from scipy.sparse import identity
    from scipy.sparse.linalg import spsolve  # slow to import, and not every run wants it

    cells = grid.open_cells()
    chain = transition_matrix(grid, policy)
    targets = np.isin(np.arange(len(cells)), [cells.index(target) for target in grid.targets])
    certain = _surely_absorbed(chain, targets)
    inner = np.flatnonzero(certain & ~targets)
    moves = np.where(certain, 0.0, np.inf)
    if len(inner):
        moves[inner] = spsolve((identity(len(inner)) - chain[inner][:, inner]).tocsc(), np.ones(len(inner)))
    return dict(zip(cells, moves.tolist(), strict=True))


def transition_matrix(grid: Grid, policy: NDArray[np.float64]) -> csr_array:
    """Return the chain, sparse (n, n), over `grid.open_cells()`; the targets are absorbing."""
    from scipy.sparse import csr_array

    cells = grid.open_cells()
    index = {cell: number for number, cell in enumerate(cells)}
    entries = [
        (index[cell], index[grid.after(cell, action)], policy[cell.x - 1, cell.y - 1, action])
        for cell in cells
        if cell not in grid.targets
        for action in Action
    ]
    entries += [(index[target], index[target], 1.0) for target in grid.targets]
    rows, columns, values = (np.array(part) for part in zip(*entries, strict=True))
    chain = csr_array((values, (rows, columns)), shape=(len(cells), len(cells)))
    chain.eliminate_zeros()
    return chain


def _surely_absorbed(chain: csr_array, targets: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return for every state whether it reaches a target with certainty: every state reachable from it can."""
    backwards = chain.T.tocsr()
    lost = ~_reached(backwards, targets)
    return ~_reached(backwards, lost)


def _reached(edges: csr_array, start: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return every state that some state of `start` leads to, `start` included."""
    reached = start.copy()
    front = list(np.flatnonzero(start))
    while front:
        state = front.pop()
        for beyond in edges.indices[edges.indptr[state] : edges.indptr[state + 1]]:
            if not reached[beyond]:
                reached[beyond] = True
                front.append(beyond)
    return reached


def ceiling_hits_per_1000(grid: Grid, protocol: StartProtocol, *, action_noise: float = 0.0) -> float:
    """Return what the best policy earns: by search where moves are certain, else by value iteration on the same MDP.

    With probability `action_noise` the executed direction is one of the three others, each as likely.
    """
    if action_noise == 0.0:
        return grid.ceiling_hits_per_1000(protocol)
    moves = fewest_expected_moves(grid, action_noise=action_noise)
    return 1000.0 / float(np.mean([moves[cell] for cell in grid.start_cells(protocol)]))


def fewest_expected_moves(grid: Grid, *, action_noise: float) -> dict[Cell, float]:
    """Return the best policy's mean number of moves from every open cell: m(s) = 1 + min_a sum_s' P(s' | s, a) m(s').

    Value iteration (Bellman 1957) until no cell changes by more than 1e-12 of its value; where that is slow, as moves
    in a large arena are hardly more than chance, policy iteration (Howard 1960) from the shortest paths.
    """
    cells = grid.open_cells()
    index = {cell: number for number, cell in enumerate(cells)}
    after = np.array([[index[grid.after(cell, action)] for action in Action] for cell in cells])
    chance = _executed(action_noise)
    moves = np.zeros(len(cells))
    for _ in range(_MOST_SWEEPS):
        improved = 1.0 + (moves[after] @ chance).min(axis=1)
        improved[[index[target] for target in grid.targets]] = 0.0
        if np.max(np.abs(improved - moves) / np.maximum(improved, 1.0)) < _CONVERGED:
            return dict(zip(cells, improved.tolist(), strict=True))
        moves = improved
    shortest = np.array([grid.distances[cell] for cell in cells])[after].argmin(axis=1)
    return _by_policies(grid, after, chance, shortest)


def has_room(chance: Any, ceiling: Any) -> Any:
    """Return whether any policy earns more than chance, of numbers or arrays: with action noise of 3/4 none does."""
    return ceiling - chance > _SAME * ceiling


def _executed(action_noise: float) -> NDArray[np.float64]:
    """Return the probability of each executed action (columns) by the chosen one (rows)."""
    chance = np.full((len(Action), len(Action)), action_noise / (len(Action) - 1))
    np.fill_diagonal(chance, 1.0 - action_noise)
    return chance


def _by_policies(
    grid: Grid, after: NDArray[np.int64], chance: NDArray[np.float64], chosen: NDArray[np.int64]
) -> dict[Cell, float]:
    """Improve the policy, an action for each open cell, until no cell gains by another one."""
    cells, rows = grid.open_cells(), np.arange(len(chosen))
    policy = np.zeros((*grid.cells, len(Action)))
    while True:
        for cell, action in zip(cells, chosen, strict=True):
            policy[cell.x - 1, cell.y - 1] = chance[action]
        expected = expected_moves(grid, policy)
        moves = np.array([expected[cell] for cell in cells])
        costs = moves[after] @ chance
        best = costs.argmin(axis=1)
        gains = costs[rows, chosen] - costs[rows, best] > _CONVERGED * np.maximum(moves, 1.0)
        gains[[cells.index(target) for target in grid.targets]] = False
        if not gains.any():
            return expected
        chosen = np.where(gains, best, chosen)
