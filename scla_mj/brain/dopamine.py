"""One dopamine between body and brain: reward and expectation in, one prediction error out (Schultz et al. 1997)."""

from __future__ import annotations

from typing import Any, Final

from scla_mj.grid import Cell, around
from scla_mj.signals import Feedback, Outcome, Percept

_HIT: Final = 1.0
_BUMP: Final = -1.0
"""The two rewards: the target, and a wall."""


class Critic:
    """What every cell is expected to be worth, and how far a move differed from that.

    Next to a target the expectation is learnt from what its cell has earned (Rescorla and Wagner 1972): whether the
    move that is made there hits depends on the network, and on the wheels. Elsewhere it follows from the neighbours by
    the local rule F: Q^m -> B of the paper's Table 1: the best of theirs times a discount. No other cell than the
    robot's own is ever updated.

    Args:
        discount: what one more move costs.
        rate: how fast an expectation follows what is earned.
        initial: what a cell is expected to earn in which a target is sensed for the first time.
        least: a target that is sensed is never expected to be worth less, so that a miss is always a disappointment.
    """

    def __init__(self, *, discount: float, rate: float, initial: float, least: float) -> None:
        self._discount, self._rate, self._initial, self._least = discount, rate, initial, least
        self._beside: dict[Cell, float] = {}
        self._elsewhere: dict[Cell, float] = {}

    def __getitem__(self, cell: Cell) -> float:
        return self._beside.get(cell, self._elsewhere.get(cell, 0.0))

    def prediction_error(self, feedback: Feedback) -> float:
        """Return what a move earned or gained beyond expectation, and update the expectations of both its cells.

        Next to a target that is the reward less the expectation; elsewhere the reward and the rise from the cell's
        worth to the next one's. A rise is not discounted: progress stays worth a little for ever.
        """
        reward = _HIT if feedback.hit else _BUMP if feedback.outcome is Outcome.BLOCKED else 0.0
        before = self._observe(feedback.before)
        if feedback.before.sensed is not None:
            self._beside[feedback.before.cell] = before + self._rate * (max(reward, 0.0) - before)
            if not feedback.hit:
                self._observe(feedback.after)
            return reward - max(before, self._least)
        if feedback.hit:  # of a target that was not sensed
            return reward
        return reward + self._observe(feedback.after) - before

    def state(self) -> dict[str, Any]:
        """Return the expectations, as rows x, y, worth: next to a target, and elsewhere."""
        tables = {"beside": self._beside, "elsewhere": self._elsewhere}
        return {name: [[cell.x, cell.y, worth] for cell, worth in table.items()] for name, table in tables.items()}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`."""
        self._beside = {Cell(x, y): worth for x, y, worth in state["beside"]}
        self._elsewhere = {Cell(x, y): worth for x, y, worth in state["elsewhere"]}

    def _observe(self, percept: Percept) -> float:
        """Update the worth of the cell that the robot is in, and return it."""
        cell = percept.cell
        if percept.sensed is not None:
            return self._beside.setdefault(cell, self._initial)
        self._beside.pop(cell, None)  # the target has left
        self._elsewhere[cell] = self._discount * max([self[neighbour] for neighbour in around(cell)])
        return self._elsewhere[cell]
