"""The learning curve as it grows: hits of the epoch, and of the last hundred decisions."""

from __future__ import annotations

from collections import deque
from typing import Any, Final, NamedTuple

_RECENT: Final = 100
"""Decisions in the rolling mean."""


class EpochTally(NamedTuple):
    """One epoch so far."""

    epoch: int
    decisions: int
    hits: int

    @property
    def hits_per_1000(self) -> float:
        """Hits per 1000 decisions."""
        return 1000 * self.hits / self.decisions


class LearningCurve:
    """Counts the epoch's hits and a rolling mean."""

    def __init__(self) -> None:
        self.tally: EpochTally | None = None
        self._recent: deque[bool] = deque(maxlen=_RECENT)

    def add(self, epoch: int, hit: bool) -> float:
        """Count one decision and return the hits per 1000 over the last hundred."""
        before = self.tally if self.tally and self.tally.epoch == epoch else EpochTally(epoch, 0, 0)
        self.tally = EpochTally(epoch, before.decisions + 1, before.hits + hit)
        self._recent.append(hit)
        return 1000 * sum(self._recent) / len(self._recent)

    def state(self) -> dict[str, Any]:
        """Return everything that `restore` needs to go on from here."""
        return {"tally": None if self.tally is None else self.tally._asdict(), "recent": list(self._recent)}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a `state`."""
        self.tally = None if state["tally"] is None else EpochTally(**state["tally"])
        self._recent = deque(state["recent"], maxlen=_RECENT)
