"""What a run has earned and what it took, up to its last whole decision."""

from __future__ import annotations

import time
from typing import Any

from scla_mj.checked import CheckedConfig
from scla_mj.runs.history import WeightHistory
from scla_mj.runs.summary import Summary, Tally
from scla_mj.signals import DecisionRecord


class Account:
    """Counts decisions, and time on both clocks; a resumed run's wall time is that of all its parts."""

    def __init__(self, checked: CheckedConfig) -> None:
        self.tally, self.history = Tally(checked), WeightHistory()
        self._decisions_per_epoch = checked.config.decisions
        self._started = time.perf_counter()
        self._simulated_s = 0.0

    def wants_activity(self, decision: int) -> bool:
        """Return whether the next decision, the epoch's `decision`-th, is one whose mean weights are kept."""
        return self.history.is_due or decision == self._decisions_per_epoch

    def add(self, record: DecisionRecord, time_s: float) -> None:
        """Count one decision, after which the run's time is `time_s`; an activity that is not wanted is not looked at.

        So no figure depends on whether somebody else wants to see every decision's.
        """
        if record.activity is not None and not self.wants_activity(record.decision):
            record = record._replace(activity=None)
        self.tally.add(record)
        self.history.add(record)
        self._simulated_s = time_s

    def summary(self) -> Summary:
        """Return the figures so far."""
        return self.tally.summary(simulated_s=self._simulated_s, wall_s=self._wall_s())

    def state(self) -> dict[str, Any]:
        """Return everything that `restore` needs to continue from here."""
        return {
            "tally": self.tally.state(),
            "history": self.history.state(),
            "simulated_s": self._simulated_s,
            "wall_s": self._wall_s(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a `state`."""
        self.tally.restore(state["tally"])
        self.history.restore(state["history"])
        self._simulated_s = state["simulated_s"]
        self._started = time.perf_counter() - state["wall_s"]

    def _wall_s(self) -> float:
        return time.perf_counter() - self._started
