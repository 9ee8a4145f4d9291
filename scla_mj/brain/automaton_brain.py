"""The paper's baseline: cellular learning automata without a network."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from scla_mj.brain.automata import LearningAutomata
from scla_mj.brain.base import Brain
from scla_mj.randomness import Consumer, generator
from scla_mj.signals import Decision, Feedback, Percept, Snapshot

if TYPE_CHECKING:
    from scla_mj.checked import CheckedConfig


class AutomatonBrain(Brain):
    """Rewarded only for the move into the target, which only the four cells beside it can make.

    Its limit is therefore exact: perfect beside the target, random elsewhere, 115.38 hits per 1000 from any start on
    the paper's grid (the paper reports 115).
    """

    reads = ("automaton.scheme", "automaton.reward-rate")

    def __init__(self, checked: CheckedConfig) -> None:
        config = checked.config
        self.automata = LearningAutomata(
            config.grid.cells, config.automaton, rng=generator(config.seed, Consumer.BRAIN)
        )

    def decide(self, percept: Percept) -> Decision:
        """Draw from the cell's probabilities."""
        action = self.automata.draw(percept.cell)
        return Decision(action, advised=action)

    def learn(self, feedback: Feedback) -> None:
        """Reward the move that reached the target; nothing else is ever signalled."""
        if feedback.hit:
            self.automata.reward(feedback.before.cell, feedback.action)

    def snapshot(self) -> Snapshot:
        """Return a copy of the action probabilities."""
        return Snapshot(probabilities=self.automata.probabilities)

    def state(self) -> dict[str, Any]:
        """Return the automata."""
        return {"automata": self.automata.state()}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a `state`."""
        self.automata.restore(state["automata"])
