"""Tabular reinforcement learners to compare SCLA with: Q-learning with traces and planning, actor-critic.

Sutton and Barto 2018, Reinforcement Learning, second edition. A hit earns 1, every other move 0, and a hit ends the
episode. Each learner may have SCLA's sense of a target in a neighbouring cell, in one of two forms (`Sensing`).
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal

import numpy as np
from annotated_types import Interval
from numpy.typing import NDArray

from scla_mj.brain.base import Brain
from scla_mj.checked import CheckedConfig
from scla_mj.config import Fraction
from scla_mj.grid import ACTIONS, Action
from scla_mj.randomness import Consumer, generator
from scla_mj.signals import Decision, Feedback, Outcome, Percept, Snapshot
from scla_mj.validation import Section

Sensing = Literal["none", "state", "reflex"]
"""What a learner makes of a sensed target: nothing; the sensed direction is its state, whatever the cell, as SCLA's
network has it; it moves there, and knows that the move is worth 1."""
Value = Annotated[float, Interval(ge=-1000.0, le=1000.0)]
_REWARD: Final = 1.0
_UNKNOWN: Final = -1


class TabularBrain(Brain):
    """A brain whose states are the rows of a table: one per cell, by columns, and one per sensed direction."""

    reads = ()

    def __init__(self, checked: CheckedConfig, sensing: Sensing) -> None:
        config = checked.config
        self._sensing = sensing
        self._cells = config.grid.cells
        self._states = self._cells[0] * self._cells[1] + len(ACTIONS)
        self._rng = generator(config.seed, Consumer.BRAIN)

    def decide(self, percept: Percept) -> Decision:
        """Move to a sensed target by reflex, or as the table says."""
        if self._sensing == "reflex" and percept.sensed is not None:
            return Decision(percept.sensed)
        return Decision(self.choose(self.row(percept)))

    @abstractmethod
    def choose(self, row: int) -> Action:
        """Choose an action in a state."""

    def row(self, percept: Percept) -> int:
        """Return the state's row."""
        if self._sensing == "state" and percept.sensed is not None:
            return self._states - len(ACTIONS) + percept.sensed
        return (percept.cell.x - 1) * self._cells[1] + percept.cell.y - 1

    def of_cells(self, table: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return a table's rows that are cells, (W, H, ...); a view."""
        return table[: -len(ACTIONS)].reshape(*self._cells, *table.shape[1:])


class QLearningBrain(TabularBrain):
    """Tabular Q-learning (Watkins 1989; Sutton and Barto 6.5), with traces and planning if its settings say so.

    Q(s, a) += alpha (r + gamma max Q(s', .) - Q(s, a)), for the executed action, as the body reports it.
    """

    @dataclass(frozen=True)
    class Settings(Section):
        """The defaults are the best on this task: optimistic and greedy."""

        learning_rate: Fraction = 1.0
        """alpha; 1 is right where moves are deterministic."""
        discount: Fraction = 0.9
        """gamma."""
        initial_value: Value = 1.0
        """Every Q at the start; 1, the reward of a hit, is optimistic and makes greedy choices explore."""
        epsilon: Fraction = 0.0
        """Probability of a random action."""
        trace_decay: Fraction = 0.0
        """lambda of Watkins's Q(lambda): replacing traces, cut by an action that is not greedy; 0 is Q-learning."""
        planning_steps: Annotated[int, Interval(ge=0, le=10_000)] = 0
        """Backups of remembered moves after each real one (Dyna-Q); 0 is Q-learning."""
        sensing: Sensing = "none"
        """What it makes of a sensed target: none; state: the direction is the state; reflex: it moves there."""

    def __init__(self, checked: CheckedConfig, settings: Settings) -> None:
        super().__init__(checked, settings.sensing)
        self._settings = settings
        self._table = np.full((self._states, len(ACTIONS)), settings.initial_value)
        self._traces = np.zeros_like(self._table)
        self._model = np.full(self._table.size, _UNKNOWN)
        self._seen: list[int] = []

    @property
    def values(self) -> NDArray[np.float64]:
        """Q of the cells, (W, H, 4); a view."""
        return self.of_cells(self._table)

    def choose(self, row: int) -> Action:
        """Choose a best action, ties broken at random; with probability epsilon any action."""
        if self._rng.random() < self._settings.epsilon:
            return Action(int(self._rng.integers(len(ACTIONS))))
        values = self._table[row]
        return Action(int(self._rng.choice(np.flatnonzero(values == values.max()))))

    def learn(self, feedback: Feedback) -> None:
        """Back up the move, then remembered ones; a failed move is ignored, and ends the traces."""
        if feedback.outcome is Outcome.FAILED:
            self._traces[:] = 0.0
            return
        if self._sensing == "reflex":
            self._value_reflexes(feedback)
        row, action = self.row(feedback.before), feedback.executed
        after = self._states if feedback.hit else self.row(feedback.after)
        if self._settings.trace_decay:
            self._back_up_along_the_traces(row, action, after)
        else:
            self._back_up(row, action, after)
        if self._settings.planning_steps:
            self._plan(row * len(ACTIONS) + action, after)

    def snapshot(self) -> Snapshot:
        """Return the value of every cell, that of its best action."""
        return Snapshot(values=self.values.max(axis=2))

    def state(self) -> dict[str, Any]:
        """Return the table, the traces, the model with its moves in the order of their discovery, and the generator."""
        arrays = {"values": self._table.copy(), "traces": self._traces.copy(), "model": self._model.copy()}
        return {**arrays, "seen": list(self._seen), "rng": self._rng.bit_generator.state}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`."""
        for array, name in ((self._table, "values"), (self._traces, "traces"), (self._model, "model")):
            array[:] = state[name]
        self._seen = list(state["seen"])
        self._rng.bit_generator.state = state["rng"]

    def _value_reflexes(self, feedback: Feedback) -> None:
        percepts = (feedback.before,) if feedback.hit else (feedback.before, feedback.after)
        for percept in percepts:
            if percept.sensed is not None:
                self._table[self.row(percept), percept.sensed] = _REWARD

    def _error(self, row: int, action: int, after: int) -> float:
        """Return r + gamma max Q(s', .) - Q(s, a); the row after a hit is beyond the table."""
        future = _REWARD if after == self._states else self._settings.discount * float(self._table[after].max())
        return future - float(self._table[row, action])

    def _back_up(self, row: int, action: int, after: int) -> None:
        self._table[row, action] += self._settings.learning_rate * self._error(row, action, after)

    def _back_up_along_the_traces(self, row: int, action: int, after: int) -> None:
        settings = self._settings
        if self._table[row, action] < self._table[row].max():  # what follows is not what the greedy policy does
            self._traces[:] = 0.0
        error = self._error(row, action, after)
        self._traces[row, action] = 1.0
        self._table += settings.learning_rate * error * self._traces
        self._traces *= 0.0 if after == self._states else settings.discount * settings.trace_decay

    def _plan(self, move: int, after: int) -> None:
        """Remember a move, and back up some that were ever made (Sutton and Barto 8.2)."""
        if self._model[move] == _UNKNOWN:
            self._seen.append(move)
        self._model[move] = after
        for choice in self._rng.integers(len(self._seen), size=self._settings.planning_steps):
            remembered = self._seen[choice]
            row, action = divmod(remembered, len(ACTIONS))
            self._back_up(row, action, int(self._model[remembered]))


class QLambdaBrain(QLearningBrain):
    """Watkins's Q(lambda) (Watkins 1989; Sutton and Barto 1998, 7.6): a backup reaches all moves that led here."""

    @dataclass(frozen=True)
    class Settings(QLearningBrain.Settings):
        """Q-learning's, with traces."""

        trace_decay: Fraction = 0.5
        """lambda, chosen on seeds 100 to 105, which the report does not use; 0.7 is as good where it has a reflex."""


class DynaQBrain(QLearningBrain):
    """Dyna-Q (Sutton 1990; Sutton and Barto 8.2): Q-learning that also learns from the moves it remembers."""

    @dataclass(frozen=True)
    class Settings(QLearningBrain.Settings):
        """Q-learning's, with planning."""

        planning_steps: Annotated[int, Interval(ge=0, le=10_000)] = 20
        """Backups of remembered moves after each real one."""


class ActorCriticBrain(TabularBrain):
    """One-step actor-critic with a softmax over preferences (Barto, Sutton and Anderson 1983; Sutton and Barto 13.5).

    delta = r + gamma V(s') - V(s),  V(s) += alpha delta,  h(s, .) += beta delta (e_a - pi(s, .)); the factor gamma^t of
    the textbook's episodic form is left out, as is usual.
    """

    @dataclass(frozen=True)
    class Settings(Section):
        """Rates chosen on seeds 100 to 104, which the report does not use."""

        critic_rate: Fraction = 0.2
        """alpha."""
        actor_rate: Annotated[float, Interval(ge=0.0, le=1000.0)] = 10.0
        """beta, of preferences."""
        initial_value: Value = 0.0
        """Every V at the start; above 0 it is optimistic: what was tried in vain is tried less."""
        discount: Fraction = 0.9
        """gamma."""
        sensing: Sensing = "none"
        """What it makes of a sensed target: none; state: the direction is the state; reflex: it moves there."""

    def __init__(self, checked: CheckedConfig, settings: Settings) -> None:
        super().__init__(checked, settings.sensing)
        self._settings = settings
        self._critic = np.full(self._states, settings.initial_value)
        self._actor = np.zeros((self._states, len(ACTIONS)))

    @property
    def values(self) -> NDArray[np.float64]:
        """V of the cells, (W, H); a view. Can be written to."""
        return self.of_cells(self._critic)

    def choose(self, row: int) -> Action:
        """Draw from the softmax of the state's preferences."""
        reached = np.cumsum(_softmax(self._actor[row]))
        return ACTIONS[min(int(np.searchsorted(reached, self._rng.random(), side="right")), len(ACTIONS) - 1)]

    def learn(self, feedback: Feedback) -> None:
        """Change value and preferences by the error of the value; a failed move is ignored."""
        if feedback.outcome is Outcome.FAILED:
            return
        settings, row = self._settings, self.row(feedback.before)
        future = _REWARD if feedback.hit else settings.discount * self._value(feedback.after)
        error = future - self._value(feedback.before)
        self._critic[row] += settings.critic_rate * error
        policy = _softmax(self._actor[row])
        self._actor[row] -= settings.actor_rate * error * policy
        self._actor[row, feedback.action] += settings.actor_rate * error

    def snapshot(self) -> Snapshot:
        """Return the policy of every cell, and its value."""
        return Snapshot(None, self.of_cells(_softmax(self._actor)), self.values.copy())

    def state(self) -> dict[str, Any]:
        """Return values, preferences and the generator's state."""
        return {"critic": self._critic.copy(), "actor": self._actor.copy(), "rng": self._rng.bit_generator.state}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`."""
        self._critic[:], self._actor[:] = state["critic"], state["actor"]
        self._rng.bit_generator.state = state["rng"]

    def _value(self, percept: Percept) -> float:
        reflex = self._sensing == "reflex" and percept.sensed is not None
        return _REWARD if reflex else float(self._critic[self.row(percept)])


def _softmax(preferences: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the probabilities along the last axis."""
    odds = np.exp(preferences - preferences.max(axis=-1, keepdims=True))
    probabilities: NDArray[np.float64] = odds / odds.sum(axis=-1, keepdims=True)
    return probabilities
