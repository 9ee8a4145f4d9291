"""The decisions that wait to be sent: what is kept of each record, in arrays, until there are enough for a column."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import POPULATIONS, PROJECTIONS
from scla_mj.clock import Clock
from scla_mj.config import Telemetry
from scla_mj.signals import TRAJECTORY_COLUMNS, Activity, DecisionRecord, Outcome
from scla_mj.telemetry.pile import Pile
from scla_mj.telemetry.poses import add_poses, end_time_s
from scla_mj.telemetry.spikes import Strip, count_by_population

OUTCOME_CODES: Final = {outcome: code for code, outcome in enumerate(Outcome)}

DECISION: Final = np.dtype(
    [
        ("start_s", np.float64),
        ("end_s", np.float64),
        ("decision", np.int64),
        ("epoch", np.int64),
        ("hit", np.bool_),
        ("outcome", np.uint8),
        ("duration_s", np.float64),
        ("position_error_m", np.float64),
        ("rolling", np.float64),
        ("poses", np.int64),
    ]
)
"""One decision: `decision` counts over the whole run, `outcome` is of `OUTCOME_CODES`, `rolling` is hits per 1000 of
late, `poses` is how many of the buffer's are this decision's."""

_COUNTS: Final = (np.int64, (len(POPULATIONS),))
_MEANS: Final = (np.float64, (len(PROJECTIONS),))
THOUGHT: Final = np.dtype(
    [
        ("row", np.int64),
        ("spikes", np.int64),
        ("kept_counts", *_COUNTS),
        ("thinking_counts", *_COUNTS),
        ("whole_counts", *_COUNTS),
        ("whole_steps", np.int64),
        ("mean_weights", *_MEANS),
        ("dopamine", *_MEANS),
        ("origin_ms", np.float64),
    ]
)
"""What a spiking brain did in the decision that is the buffer's `row`; counts are by population, `spikes` the kept."""


class Buffer:
    """Gathers at most `capacity` decisions; `clear` after they were sent.

    Attributes:
        poses: rows of `TRAJECTORY_COLUMNS`, decision after decision.
        spike_step, spike_neuron: the kept spikes, steps from their decision's start.
    """

    def __init__(self, *, mode: Telemetry, clock: Clock, pose_stride: int, capacity: int) -> None:
        self.mode, self.clock = mode, clock
        self.strip = Strip(joins_windows=mode == "light")
        self.poses = Pile((len(TRAJECTORY_COLUMNS),), np.float64)
        self.spike_step, self.spike_neuron = Pile((), np.int32), Pile((), np.int32)
        self._pose_stride = pose_stride
        self._decisions, self._thoughts = np.empty(capacity, DECISION), np.empty(capacity, THOUGHT)
        self._filled = self._thought = 0

    def __len__(self) -> int:
        return self._filled

    @property
    def decisions(self) -> NDArray[Any]:
        """A copy of the rows of `DECISION`, (n,): Rerun may go on reading what it was given."""
        return self._decisions[: self._filled].copy()

    @property
    def thoughts(self) -> NDArray[Any]:
        """A copy of the rows of `THOUGHT`: a row for every decision of a spiking brain."""
        return self._thoughts[: self._thought].copy()

    def add(self, record: DecisionRecord, decision: int, rolling: float) -> None:
        """Take what the mode keeps of one record."""
        move = record.move
        self._decisions[self._filled] = (
            record.time_s,
            end_time_s(move.trajectory, record.time_s),
            decision,
            record.epoch,
            record.hit,
            OUTCOME_CODES[move.outcome],
            move.duration_s,
            move.position_error_m,
            rolling,
            add_poses(self.poses, move.trajectory, self._pose_stride),
        )
        if record.activity is not None:
            self._think(record.activity, record.time_s)
        self._filled += 1

    def clear(self) -> None:
        """Forget what was sent."""
        self._filled = self._thought = 0
        for pile in (self.poses, self.spike_step, self.spike_neuron):
            pile.clear()

    def _think(self, activity: Activity, time_s: float) -> None:
        thinking_only = self.mode == "light"
        spikes = activity.thinking_spikes if thinking_only else len(activity.spike_step)
        steps = activity.thinking_steps if thinking_only else activity.steps
        self.spike_step.add(activity.spike_step[:spikes])
        self.spike_neuron.add(activity.spike_neuron[:spikes])
        thinking, whole = count_by_population(activity)
        self._thoughts[self._thought] = (
            self._filled,
            spikes,
            thinking if thinking_only else whole,
            thinking,
            whole,
            activity.steps,
            activity.mean_weights,
            activity.dopamine,
            self.strip.place(time_s, steps * self.clock.neural_step_ms),
        )
        self._thought += 1
