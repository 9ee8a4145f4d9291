"""One dopamine between body and brain: reward and expectation in, one prediction error out (Schultz et al. 1997)."""

from __future__ import annotations

from typing import Any, Final

from scla_mj.brain.reinforcement import CellStates
from scla_mj.grid import Action
from scla_mj.signals import Feedback, Outcome

_HIT: Final = 1.0
_BUMP: Final = -1.0
"""The two rewards: the target, and a wall."""


class Critic:
    """How far a move differed from what was expected of it.

    Where a target is sensed, the expectation of a hit is learnt for each direction from what came of it (Rescorla and
    Wagner 1972): it depends on the network, and on the wheels. Elsewhere a move is expected to keep the worth of the
    cell, which is its state by the local rule F: Q^m -> B of the paper's Table 1.

    Args:
        discount: of the local rule.
        rate: how fast an expectation follows what comes.
        initial: each direction's expectation before any experience.
        least: a sensed target is never expected to be worth less, so that a miss is always a disappointment.

    Attributes:
        states: what the local rule knows about every cell.
    """

    def __init__(self, *, discount: float, rate: float, initial: float, least: float) -> None:
        self._rate, self._least = rate, least
        self.states = CellStates(discount=discount)
        self._expected = [initial] * len(Action)

    def expected(self, sensed: Action) -> float:
        """Return the expectation of a hit where a target is sensed in that direction."""
        return self._expected[sensed]

    def prediction_error(self, feedback: Feedback, *, expected: float | None = None) -> float:
        """Return what a move brought beyond expectation, and learn from it.

        With a sensed target that is the reward less the expectation, the learnt one unless another is `expected`.
        Elsewhere it is the reward and the rise from one cell's state to the next one's, which is not discounted:
        progress stays worth a little for ever.
        """
        before, after = feedback.before, feedback.after
        self.states.judge(feedback)
        bump = _BUMP if feedback.outcome is Outcome.BLOCKED else 0.0
        if before.sensed is None:
            return bump + self.states[after.cell] - self.states[before.cell]
        hit, learnt = _HIT if feedback.hit else 0.0, self._expected[before.sensed]
        self._expected[before.sensed] = learnt + self._rate * (hit - learnt)
        return bump + hit - max(learnt if expected is None else expected, self._least)

    def state(self) -> dict[str, Any]:
        """Return the expectations and the cells' states."""
        return {"expected": list(self._expected), "states": self.states.state()}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`."""
        self._expected = list(state["expected"])
        self.states.restore(state["states"])
