"""The decisions that wait to be sent: copies of what is kept of each record, until there are enough for a column."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.clock import Clock
from scla_mj.config import Telemetry
from scla_mj.signals import Activity, DecisionRecord, Outcome
from scla_mj.telemetry.poses import end_time_s, keep_rows
from scla_mj.telemetry.spikes import Strip, count_by_population


class DecisionRow(NamedTuple):
    """One decision's numbers; `decision` counts over the whole run, `rolling` is hits per 1000 of late."""

    start_s: float
    end_s: float
    decision: int
    epoch: int
    hit: bool
    outcome: Outcome
    duration_s: float
    position_error_m: float
    rolling: float
    trajectory: NDArray[np.float64]


class ActivityRow(NamedTuple):
    """What is kept of a spiking brain's decision; counts are per population, `steps` and `neurons` the kept spikes."""

    steps: NDArray[np.int32]
    neurons: NDArray[np.int32]
    kept_counts: NDArray[np.int64]
    thinking_counts: NDArray[np.int64]
    whole_counts: NDArray[np.int64]
    whole_steps: int
    mean_weights: NDArray[np.float64]
    dopamine: NDArray[np.float64]
    origin_ms: float


class Buffer:
    """Gathers rows; `clear` after they were sent."""

    def __init__(self, *, mode: Telemetry, clock: Clock, pose_stride: int) -> None:
        self.mode, self.clock = mode, clock
        self.rows: list[DecisionRow] = []
        self.active: list[tuple[DecisionRow, ActivityRow]] = []
        self.spikes = 0
        self._pose_stride = pose_stride
        self.strip = Strip(joins_windows=mode == "light")

    def add(self, record: DecisionRecord, decision: int, rolling: float) -> None:
        """Take what the mode keeps of one record."""
        move = record.move
        row = DecisionRow(
            start_s=record.time_s,
            end_s=end_time_s(move.trajectory, record.time_s),
            decision=decision,
            epoch=record.epoch,
            hit=record.hit,
            outcome=move.outcome,
            duration_s=move.duration_s,
            position_error_m=move.position_error_m,
            rolling=rolling,
            trajectory=keep_rows(move.trajectory, self._pose_stride),
        )
        self.rows.append(row)
        if record.activity is not None:
            kept = self._keep(record.activity, record.time_s)
            self.active.append((row, kept))
            self.spikes += len(kept.steps)

    def clear(self) -> None:
        """Forget what was sent."""
        self.rows, self.active, self.spikes = [], [], 0

    def _keep(self, activity: Activity, time_s: float) -> ActivityRow:
        thinking_only = self.mode == "light"
        count = activity.thinking_spikes if thinking_only else len(activity.spike_step)
        steps = activity.thinking_steps if thinking_only else activity.steps
        thinking, whole = count_by_population(activity)
        return ActivityRow(
            steps=activity.spike_step[:count].copy(),
            neurons=activity.spike_neuron[:count].copy(),
            kept_counts=thinking if thinking_only else whole,
            thinking_counts=thinking,
            whole_counts=whole,
            whole_steps=activity.steps,
            mean_weights=activity.mean_weights.copy(),
            dopamine=activity.dopamine.copy(),
            origin_ms=self.strip.place(time_s, steps * self.clock.neural_step_ms),
        )
