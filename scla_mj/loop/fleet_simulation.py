"""Many robots with a brain each: one decision of all of them at a time, in threads that share one process."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from scla_mj.brain.base import Brain
from scla_mj.grid import ACTIONS, Cell
from scla_mj.loop.fleet import Came, Fleet
from scla_mj.signals import Decision, Feedback, Outcome, Percept

_OUTCOMES: Final = tuple(Outcome)


class FleetSimulation:
    """A fleet joined with its brains: each `step()` is one decision of every robot, driven to its end.

    Every robot is a `Simulation` of its own seed, to the bit. Both the physics and the networks are compiled code that
    does not hold the interpreter's lock, so that threads run them at the same time.

    Attributes:
        fleet: the robots: `fleet.cells`, `fleet.time_s`, `fleet.qpos(robot)`.
        brains: what decides, one for each robot.
        decisions: how many each has made so far.
        chosen: what they decided last.
    """

    def __init__(self, fleet: Fleet, brains: Sequence[Brain]) -> None:
        self.fleet, self.brains = fleet, tuple(brains)
        self.decisions = 0
        self.chosen: list[Decision] = []

    def step(self) -> Came:
        """Let every robot make one decision and drive it; return what came of it.

        Raises:
            SclaError: the physics has gone wrong, or what a brain answered is no decision.
        """
        fleet = self.fleet
        fleet.begin_decisions()
        before = self._percepts()
        self.chosen = self._decide(before)
        came = fleet.act(np.array([decision.action for decision in self.chosen]))
        self._learn(self._feedbacks(before, came), came.duration_s.tolist())
        for robot in np.flatnonzero(came.hit | came.fallen).tolist():
            fleet.respawn(robot)
        self.decisions += 1
        return came

    def close(self) -> None:
        """End the threads."""
        self.fleet.close()

    def _decide(self, before: list[Percept]) -> list[Decision]:
        brains = self.brains
        chosen: list[Decision | None] = [None] * len(brains)

        def decide(first: int, last: int) -> None:
            for robot in range(first, last):
                chosen[robot] = brains[robot].decide(before[robot])

        self.fleet.in_chunks(decide)
        return [decision for decision in chosen if decision is not None]

    def _learn(self, feedbacks: list[Feedback], durations_s: list[float]) -> None:
        def learn(first: int, last: int) -> None:
            for robot in range(first, last):
                self.brains[robot].elapse(durations_s[robot])
                self.brains[robot].learn(feedbacks[robot])

        self.fleet.in_chunks(learn)

    def _percepts(self) -> list[Percept]:
        directions = (*ACTIONS, None)
        cells, sensed = self.fleet.cells.tolist(), self.fleet.sensed.tolist()
        return [Percept(Cell(x, y), directions[side]) for (x, y), side in zip(cells, sensed, strict=True)]

    def _feedbacks(self, before: list[Percept], came: Came) -> list[Feedback]:
        each = zip(before, self.chosen, self._percepts(), *(part.tolist() for part in came), strict=True)
        return [
            Feedback(
                was,
                decision.action,
                ACTIONS[executed],
                _OUTCOMES[outcome],
                was if fallen else now,
                hit,
                crossed_s if _OUTCOMES[outcome] is Outcome.MOVED else None,
            )
            for was, decision, now, executed, outcome, hit, fallen, _, crossed_s, _ in each
        ]
