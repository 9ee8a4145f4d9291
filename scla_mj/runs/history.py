"""The mean weights over a run's time, thinned so that its memory does not grow with the run."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from scla_mj.signals import DecisionRecord, WeightCurve

CAPACITY: Final = 2048
"""Points kept at most: more than a figure has pixels across."""
FIRST_STRIDE: Final = 4
"""Decisions from one sample to the next in a run of up to 8192: a jump is still seen where it was, give or take 3."""


class WeightHistory:
    """Keeps every stride-th decision's mean weights; when full it drops every other sample and doubles the stride."""

    def __init__(self, capacity: int = CAPACITY, stride: int = FIRST_STRIDE) -> None:
        self._decision = np.zeros(capacity, dtype=np.int64)
        self._time_s = np.zeros(capacity)
        self._means = np.zeros((capacity, 0))
        self._seen = self._kept = 0
        self._stride = stride

    @property
    def is_due(self) -> bool:
        """Whether the next decision is one whose mean weights are kept."""
        return self._seen % self._stride == 0

    def add(self, record: DecisionRecord) -> None:
        """Count a decision, and take the mean weights at its end if it is due; a brain without synapses has none."""
        due = self.is_due
        self._seen += 1
        if not due or record.activity is None or not len(record.activity.mean_weights):
            return
        self._make_room_for(len(record.activity.mean_weights))
        if self._kept == len(self._decision):
            self._thin()
            if (self._seen - 1) % self._stride:
                return
        self._decision[self._kept] = self._seen
        self._time_s[self._kept] = record.time_s
        self._means[self._kept] = record.activity.mean_weights
        self._kept += 1

    def curve(self) -> WeightCurve:
        """Return a copy of the samples so far."""
        kept = slice(0, self._kept)
        return WeightCurve(self._decision[kept].copy(), self._time_s[kept].copy(), self._means[kept].copy())

    def state(self) -> dict[str, Any]:
        """Return everything that `restore` needs to continue from here."""
        return {**self.curve()._asdict(), "seen": self._seen, "stride": self._stride}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a `state`."""
        self._kept = len(state["decision"])
        self._decision[: self._kept] = state["decision"]
        self._time_s[: self._kept] = state["time_s"]
        self._make_room_for(state["mean_weights"].shape[1])
        self._means[: self._kept] = state["mean_weights"]
        self._seen, self._stride = state["seen"], state["stride"]

    def _make_room_for(self, projections: int) -> None:
        if self._means.shape[1] != projections:
            self._means = np.zeros((len(self._means), projections))

    def _thin(self) -> None:
        half = (self._kept + 1) // 2
        for samples in (self._decision, self._time_s, self._means):
            samples[:half] = samples[: self._kept : 2].copy()
        self._kept, self._stride = half, self._stride * 2
