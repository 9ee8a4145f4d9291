"""Cellular learning automata: one action-probability vector per cell, and the schemes that change it.

Narendra and Thathachar 1989. With reward rate a, penalty rate b, r actions and action i taken:
reward  p_i += a (1 - p_i),  p_j *= 1 - a;  penalty  p_i *= 1 - b,  p_j = b / (r - 1) + (1 - b) p_j.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scla_mj.config import AutomatonConfig
from scla_mj.errors import SclaError
from scla_mj.grid import ACTIONS, Action, Cell
from scla_mj.validation import shown

_ACTIONS: Final = len(ACTIONS)
_SUM_TOLERANCE: Final = 1e-6
"""Rounding of millions of changes, or of a user's float32."""


class LearningAutomata:
    """One learning automaton per cell; all start with equal probabilities.

    Vectors are plain lists: for four numbers they take a fifth of numpy's time.
    """

    def __init__(self, cells: tuple[int, int], config: AutomatonConfig, *, rng: np.random.Generator) -> None:
        width, height = cells
        self._vectors = [[[1.0 / _ACTIONS] * _ACTIONS for _ in range(height)] for _ in range(width)]
        self._scheme = config.scheme
        self._reward_rate = config.reward_rate
        self._penalty_rate = _penalty_rate(config)
        self._rng = rng

    @property
    def probabilities(self) -> NDArray[np.float64]:
        """The action probabilities of up, down, left, right in every cell, (W, H, 4); a read-only copy.

        To change them, change a copy and assign it.

        Raises:
            SclaError: on assignment, of another shape, or of what is not probabilities.
        """
        probabilities = np.array(self._vectors)
        probabilities.setflags(write=False)
        return probabilities

    @probabilities.setter
    def probabilities(self, probabilities: ArrayLike) -> None:
        wanted = (len(self._vectors), len(self._vectors[0]), _ACTIONS)
        try:
            given = np.asarray(probabilities, np.float64)
        except (TypeError, ValueError) as error:
            raise SclaError(f"probabilities are {shown(probabilities)}: they must be numbers, {wanted}") from error
        if given.shape != wanted:
            raise SclaError(f"probabilities have the shape {given.shape}: it must be {wanted}")
        if not (given >= 0.0).all() or not np.abs(given.sum(axis=2) - 1.0).max() < _SUM_TOLERANCE:
            raise SclaError("probabilities must be 0 or more, and those of every cell add up to 1")
        self._vectors = given.tolist()

    def draw(self, cell: Cell) -> Action:
        """Draw an action from the cell's probabilities."""
        point, reached = self._rng.random(), 0.0
        for action, probability in enumerate(self._vectors[cell.x - 1][cell.y - 1]):
            reached += probability
            if point < reached:
                return ACTIONS[action]
        return self.best(cell)

    def best(self, cell: Cell) -> Action:
        """Return the cell's most probable action."""
        vector = self._vectors[cell.x - 1][cell.y - 1]
        return ACTIONS[vector.index(max(vector))]

    def reward(self, cell: Cell, action: Action, *, weight: float = 1.0) -> None:
        """Reward the action; `weight`, 0 to 1, scales the reward rate."""
        vector, rate = self._vectors[cell.x - 1][cell.y - 1], self._reward_rate * weight
        if self._scheme == "opposite-pair":
            _shift(vector, source=action.opposite, sink=action, fraction=rate)
            return
        vector[:] = [probability * (1.0 - rate) for probability in vector]
        vector[action] += rate

    def penalise(self, cell: Cell, action: Action) -> None:
        """Penalise the action."""
        vector, rate = self._vectors[cell.x - 1][cell.y - 1], self._penalty_rate
        if self._scheme == "opposite-pair":
            _shift(vector, source=action, sink=action.opposite, fraction=rate)
            return
        kept = vector[action] * (1.0 - rate)
        vector[:] = [probability * (1.0 - rate) + rate / (_ACTIONS - 1) for probability in vector]
        vector[action] = kept

    def state(self) -> dict[str, Any]:
        """Return the probabilities and the generator's state."""
        return {"probabilities": self.probabilities, "rng": self._rng.bit_generator.state}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`."""
        self.probabilities = state["probabilities"]
        self._rng.bit_generator.state = state["rng"]


def _penalty_rate(config: AutomatonConfig) -> float:
    if config.scheme == "reward-inaction":
        return 0.0
    if config.scheme == "reward-epsilon-penalty":
        return config.epsilon * config.penalty_rate
    return config.penalty_rate


def _shift(vector: list[float], *, source: Action, sink: Action, fraction: float) -> None:
    """Move a fraction of one action's probability to another; the other two keep theirs (the paper's text)."""
    moved = fraction * vector[source]
    vector[source] -= moved
    vector[sink] += moved
