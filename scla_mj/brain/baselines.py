"""Brains that mark the ends of the scale: chance and the ceiling."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from scla_mj.brain.base import Brain
from scla_mj.errors import SclaError
from scla_mj.grid import Action
from scla_mj.randomness import Consumer, generator
from scla_mj.signals import Decision, Feedback, Percept

if TYPE_CHECKING:
    from scla_mj.checked import CheckedConfig


class RandomBrain(Brain):
    """The random walk."""

    reads = ()

    def __init__(self, checked: CheckedConfig) -> None:
        self._rng = generator(checked.config.seed, Consumer.BRAIN)

    def decide(self, percept: Percept) -> Decision:
        """Choose each action with probability 1/4."""
        return Decision(Action(int(self._rng.integers(len(Action)))))

    def learn(self, feedback: Feedback) -> None:
        """Learn nothing."""

    def state(self) -> dict[str, Any]:
        """Return the generator."""
        return {"rng": self._rng.bit_generator.state}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a `state`."""
        self._rng.bit_generator.state = state["rng"]


class ShortestPathBrain(Brain):
    """Knows the map and follows a shortest path: the ceiling, driven.

    Raises:
        SclaError: the target jumps, which this brain cannot know.
    """

    reads = ()

    def __init__(self, checked: CheckedConfig) -> None:
        if checked.config.task.jump_epoch:
            raise SclaError("--brain shortest-path knows one target only: leave out --task.jump-epoch")
        self._grid = checked.grid()

    def decide(self, percept: Percept) -> Decision:
        """Move to the neighbour closest to the target, the first of equals in the order up, down, left, right."""
        distances = self._grid.distances
        action, _ = min(self._grid.neighbours(percept.cell), key=lambda neighbour: distances[neighbour[1]])
        return Decision(action)

    def learn(self, feedback: Feedback) -> None:
        """Learn nothing: it knows."""

    def state(self) -> dict[str, Any]:
        """Return nothing: nothing changes."""
        return {}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on as it is."""
