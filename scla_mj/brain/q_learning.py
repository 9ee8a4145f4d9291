"""Tabular Q-learning (Watkins 1989), the reinforcement learner that readers will ask about."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from annotated_types import Interval

from scla_mj.brain.base import Brain
from scla_mj.config import Fraction
from scla_mj.grid import Action, Cell
from scla_mj.randomness import Consumer, generator
from scla_mj.signals import Decision, Feedback, Outcome, Percept
from scla_mj.validation import Section

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from scla_mj.checked import CheckedConfig


class QLearningBrain(Brain):
    """Q(s, a) += alpha (r + gamma max Q(s', .) - Q(s, a)), r = 1 for a hit, which ends the episode."""

    reads = ()

    @dataclass(frozen=True)
    class Settings(Section):
        """The defaults are the best on this task: optimistic and greedy."""

        learning_rate: Fraction = 1.0
        """alpha; 1 is right where moves are deterministic."""
        discount: Fraction = 0.9
        """gamma."""
        initial_value: Annotated[float, Interval(ge=-1000.0, le=1000.0)] = 1.0
        """Every Q at the start; 1, the reward of a hit, is optimistic and makes greedy choices explore."""
        epsilon: Fraction = 0.0
        """Probability of a random action."""

    def __init__(self, checked: CheckedConfig, settings: Settings) -> None:
        config = checked.config
        self._settings = settings
        self.values = np.full((*config.grid.cells, len(Action)), settings.initial_value)
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
