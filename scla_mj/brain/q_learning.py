"""Tabular Q-learning (Watkins 1989), the reinforcement learner that readers will ask about."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from scla_mj.brain.base import Brain
from scla_mj.grid import Action, Cell
from scla_mj.randomness import Consumer, generator
from scla_mj.signals import Decision, Feedback, Outcome, Percept

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from scla_mj.clock import Clock
    from scla_mj.config import RunConfig


class QLearningBrain(Brain):
    """Q(s, a) += alpha (r + gamma max Q(s', .) - Q(s, a)), r = 1 for a hit, which ends the episode."""

    def __init__(self, config: RunConfig, clock: Clock) -> None:
        self._settings = config.q_learning
        self.values = np.full((*config.grid.cells, len(Action)), config.q_learning.initial_value)
        self._rng = generator(config.seed, Consumer.BRAIN)

    def decide(self, percept: Percept) -> Decision:
        """Choose a best action, ties broken at random; with probability epsilon any."""
        if self._rng.random() < self._settings.epsilon:
            return Decision(Action(int(self._rng.integers(len(Action)))))
        values = self._values(percept.cell)
        return Decision(Action(int(self._rng.choice(np.flatnonzero(values == values.max())))))

    def learn(self, feedback: Feedback) -> None:
        """Make one backup; a failed move says nothing."""
        if feedback.outcome is Outcome.FAILED:
            return
        future = 1.0 if feedback.hit else self._settings.discount * float(self._values(feedback.after.cell).max())
        values = self._values(feedback.before.cell)
        values[feedback.action] += self._settings.learning_rate * (future - values[feedback.action])

    def state(self) -> dict[str, Any]:
        """Return the table and the generator."""
        return {"values": self.values.copy(), "rng": self._rng.bit_generator.state}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a `state`."""
        self.values[:] = state["values"]
        self._rng.bit_generator.state = state["rng"]

    def _values(self, cell: Cell) -> NDArray[np.float64]:
        values: NDArray[np.float64] = self.values[cell.x - 1, cell.y - 1]
        return values
