"""The sources of the automata's reinforcement signal: a local rule over cell states, and dopamine on arrival."""

from __future__ import annotations

import math
from collections import deque
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.brain.automata import LearningAutomata
from scla_mj.config import AutomatonConfig
from scla_mj.grid import Action, Cell, around
from scla_mj.signals import Feedback, Outcome, Percept

# A trace below this share moves no probability by more than a thousandth.
_LEAST_TRACE: Final = 1e-3


class CellStates:
    """The local rule F: Q^m -> B of the paper's Table 1.

    A cell's state is how good the robot has found it to be: 1 for the target, otherwise the best of its neighbours'
    states times a discount, 0 while nothing is known. Only the robot's own cell and the neighbours
    that it senses are ever updated.
    """

    def __init__(self, *, discount: float) -> None:
        self._discount = discount
        self._targets: set[Cell] = set()
        self._states: dict[Cell, float] = {}
        self._observed: Percept | None = None

    def __getitem__(self, cell: Cell) -> float:
        return self._states.get(cell, 0.0)

    def values(self, cells: tuple[int, int]) -> NDArray[np.float64]:
        """Return the states of an arena of W, H `cells`, (W, H)."""
        return np.array([[self[Cell(x, y)] for y in range(1, cells[1] + 1)] for x in range(1, cells[0] + 1)])

    def judge(self, feedback: Feedback) -> int:
        """Update the states of both cells of a move; return 1 if it led to a better one, -1 to a worse one, else 0."""
        self._observe(feedback.before)
        if feedback.hit:
            self._believe(feedback.after.cell)
            self._observed = None
        else:
            self._observe(feedback.after)
        before, after = self[feedback.before.cell], self[feedback.after.cell]
        return (after > before) - (after < before)

    def state(self) -> dict[str, Any]:
        """Return the cells' states, as rows x, y, state, and the cells believed to be targets."""
        rows = [[cell.x, cell.y, value] for cell, value in self._states.items()]
        return {"states": rows, "targets": [list(cell) for cell in sorted(self._targets)]}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`."""
        self._states = {Cell(x, y): value for x, y, value in state["states"]}
        self._targets = {Cell(*cell) for cell in state["targets"]}
        self._observed = None

    def _observe(self, percept: Percept) -> None:
        """Set the state of the robot's own cell from its four neighbours; correct a target that has left."""
        if percept is self._observed:  # nothing has changed since
            return
        cell, states, neighbours = percept.cell, self._states, around(percept.cell)
        sensed = None if percept.sensed is None else neighbours[percept.sensed]
        for target in self._targets.intersection(neighbours):
            if target != sensed:  # the target has left
                self._targets.remove(target)
                states[target] = 0.0
        if sensed is not None:
            self._believe(sensed)
        self._targets.discard(cell)
        states[cell] = self._discount * max([states.get(neighbour, 0.0) for neighbour in neighbours])
        self._observed = percept

    def _believe(self, cell: Cell) -> None:
        self._targets.add(cell)
        self._states[cell] = 1.0


class Eligible(NamedTuple):
    """A cell on the path, the action taken there, and its trace, decayed from 1."""

    cell: Cell
    action: Action
    trace: float


class PathTrace:
    """The automata that are eligible for a distal reward: the last moves, each with a decaying trace."""

    def __init__(self, *, tau_moves: float) -> None:
        self._decay = math.exp(-1.0 / tau_moves)
        length = 1 + int(-tau_moves * math.log(_LEAST_TRACE))
        self._moves: deque[tuple[Cell, Action]] = deque(maxlen=length)

    def add(self, feedback: Feedback) -> None:
        """Add a completed move; a blocked one is ignored, and a failed one clears the path."""
        if feedback.outcome is Outcome.MOVED:
            self._moves.append((feedback.before.cell, feedback.action))
        elif feedback.outcome is Outcome.FAILED:
            self._moves.clear()

    def collect(self) -> list[Eligible]:
        """Return the eligible automata, the latest first, and clear the path, which has ended."""
        moves = [Eligible(cell, action, self._decay**age) for age, (cell, action) in enumerate(reversed(self._moves))]
        self._moves.clear()
        return moves

    def state(self) -> dict[str, Any]:
        """Return the moves, as rows x, y, action."""
        return {"moves": [[cell.x, cell.y, int(action)] for cell, action in self._moves]}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`."""
        self._moves = deque(((Cell(x, y), Action(action)) for x, y, action in state["moves"]), self._moves.maxlen)


class Reinforcement:
    """Everything that scla-printed's automata are taught by: the local rule, the distal reward, the penalty for a bump.

    No spike, weight or dopamine concentration enters here.

    Attributes:
        states: what the local rule knows about every cell.
    """

    def __init__(self, automata: LearningAutomata, config: AutomatonConfig) -> None:
        self.states = CellStates(discount=config.discount)
        self._automata, self._config = automata, config
        self._path = PathTrace(tau_moves=config.trace_tau_moves)

    def credited(self, feedback: Feedback) -> tuple[Feedback, bool]:
        """Return the feedback with the action that signals are for, and whether the automaton chose what was done."""
        chosen = feedback.executed == feedback.action
        if not chosen and self._config.credit == "executed":
            feedback = feedback._replace(action=feedback.executed)
        return feedback, chosen

    def signal(self, feedback: Feedback, *, punish: bool) -> None:
        """Reward or penalise the cell's automaton, if `punish` allows that, and after a hit those on the way."""
        self._path.add(feedback)
        config, cell, action = self._config, feedback.before.cell, feedback.action
        judgement = self.states.judge(feedback) if config.local_rule else 0
        if feedback.outcome is Outcome.BLOCKED:
            if config.bump_penalty and punish:
                self._automata.penalise(cell, action)
        elif feedback.outcome is Outcome.MOVED:
            if judgement > 0:
                self._automata.reward(cell, action)
            elif judgement < 0 and punish:
                self._automata.penalise(cell, action)
        if feedback.hit:
            self._reward_path()

    def state(self) -> dict[str, Any]:
        """Return what the signals come from; the automata have a state of their own."""
        return {"states": self.states.state(), "path": self._path.state()}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`."""
        self.states.restore(state["states"])
        self._path.restore(state["path"])

    def _reward_path(self) -> None:
        path = self._path.collect()
        if self._config.distal_reward:
            for cell, action, trace in path:
                self._automata.reward(cell, action, weight=trace)
