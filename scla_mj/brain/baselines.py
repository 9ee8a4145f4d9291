"""Brains to compare SCLA with: the random walk, a shortest path, learning automata alone, tabular Q-learning."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from annotated_types import Interval
from numpy.typing import NDArray

from scla_mj.brain.automata import LearningAutomata
from scla_mj.brain.base import Brain
from scla_mj.checked import CheckedConfig
from scla_mj.config import Fraction
from scla_mj.errors import SclaError
from scla_mj.grid import Action, Cell
from scla_mj.randomness import Consumer, generator
from scla_mj.signals import Decision, Feedback, Outcome, Percept, Snapshot
from scla_mj.validation import Section


class RandomBrain(Brain):
    """The random walk: the lower end of the scale."""

    reads = ()

    def __init__(self, checked: CheckedConfig) -> None:
        self._rng = generator(checked.config.seed, Consumer.BRAIN)

    def decide(self, percept: Percept) -> Decision:
        """Choose each action with probability 1/4."""
        return Decision(Action(int(self._rng.integers(len(Action)))))

    def learn(self, feedback: Feedback) -> None:
        """Learn nothing."""

    def state(self) -> dict[str, Any]:
        """Return the generator's state."""
        return {"rng": self._rng.bit_generator.state}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`."""
        self._rng.bit_generator.state = state["rng"]


class ShortestPathBrain(Brain):
    """Knows the map and follows a shortest path: the ceiling, driven by the robot.

    Raises:
        SclaError: the target jumps or the wheels are crossed, which this brain cannot know.
    """

    reads = ()

    def __init__(self, checked: CheckedConfig) -> None:
        task = checked.config.task
        if task.jump_epoch:
            raise SclaError("--brain shortest-path knows one target only: leave out --task.jump-epoch")
        if task.crossed_epoch:
            raise SclaError("--brain shortest-path knows its wheels: leave out --task.crossed-epoch")
        self._grid = checked.grid()

    def decide(self, percept: Percept) -> Decision:
        """Move to the neighbour closest to the target; of equals, the first in the order up, down, left, right."""
        distances = self._grid.distances
        action, _ = min(self._grid.neighbours(percept.cell), key=lambda neighbour: distances[neighbour[1]])
        return Decision(action)

    def learn(self, feedback: Feedback) -> None:
        """Learn nothing."""

    def state(self) -> dict[str, Any]:
        """Return an empty state: nothing changes during a run."""
        return {}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`, which is empty."""


class AutomatonBrain(Brain):
    """The paper's baseline: cellular learning automata without a network.

    The only reward is for the move into the target, and only the target's four neighbours can make it. Its limit is
    therefore exact: perfect next to the target, random elsewhere, 115.38 hits per 1000 decisions from any start on the
    paper's grid (the paper reports 115).
    """

    reads = ("automaton.scheme", "automaton.reward-rate")

    def __init__(self, checked: CheckedConfig) -> None:
        config = checked.config
        self.automata = LearningAutomata(
            config.grid.cells, config.automaton, rng=generator(config.seed, Consumer.BRAIN)
        )

    def decide(self, percept: Percept) -> Decision:
        """Draw from the cell's action probabilities."""
        action = self.automata.draw(percept.cell)
        return Decision(action, advised=action)

    def learn(self, feedback: Feedback) -> None:
        """Reward the move that reached the target."""
        if feedback.hit:
            self.automata.reward(feedback.before.cell, feedback.action)

    def snapshot(self) -> Snapshot:
        """Return a copy of the action probabilities."""
        return Snapshot(probabilities=self.automata.probabilities)

    def state(self) -> dict[str, Any]:
        """Return the state of the automata."""
        return {"automata": self.automata.state()}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`."""
        self.automata.restore(state["automata"])


class QLearningBrain(Brain):
    """Tabular Q-learning (Watkins 1989), reward 1 for a hit, which ends the episode.

    Q(s, a) += alpha (r + gamma max Q(s', .) - Q(s, a))

    Attributes:
        values: Q, (W, H, 4) float64.
    """

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
        """Choose a best action, ties broken at random; with probability epsilon any action."""
        if self._rng.random() < self._settings.epsilon:
            return Decision(Action(int(self._rng.integers(len(Action)))))
        values = self._values(percept.cell)
        return Decision(Action(int(self._rng.choice(np.flatnonzero(values == values.max())))))

    def learn(self, feedback: Feedback) -> None:
        """Make one backup; a failed move is ignored."""
        if feedback.outcome is Outcome.FAILED:
            return
        future = 1.0 if feedback.hit else self._settings.discount * float(self._values(feedback.after.cell).max())
        values = self._values(feedback.before.cell)
        values[feedback.action] += self._settings.learning_rate * (future - values[feedback.action])

    def state(self) -> dict[str, Any]:
        """Return the table and the generator's state."""
        return {"values": self.values.copy(), "rng": self._rng.bit_generator.state}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`."""
        self.values[:] = state["values"]
        self._rng.bit_generator.state = state["rng"]

    def _values(self, cell: Cell) -> NDArray[np.float64]:
        values: NDArray[np.float64] = self.values[cell.x - 1, cell.y - 1]
        return values
