"""The decisions that wait to be sent: what is kept of each record, in arrays, until there are enough for a column."""

from __future__ import annotations

from typing import Final

import numpy as np

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
        ("thinking_counts", *_COUNTS),
        ("whole_counts", *_COUNTS),
        ("whole_steps", np.int64),
        ("mean_weights", *_MEANS),
        ("dopamine", *_MEANS),
        ("origin_ms", np.float64),
    ]
)
"""What a spiking brain did in the decision that is the buffer's `row`; counts are spikes by population."""


class Buffer:
    """Gathers decisions; `clear` after they were sent.

    Attributes:
        decisions, thoughts: rows of `DECISION`, and of `THOUGHT` where a spiking brain decided.
        poses: rows of `TRAJECTORY_COLUMNS`, decision after decision.
        spike_step, spike_neuron: the kept spikes, steps from their decision's start.
    """

    def __init__(self, *, mode: Telemetry, clock: Clock, pose_stride: int) -> None:
        self.mode, self.clock = mode, clock
        self.strip = Strip(joins_windows=mode == "light")
        self.decisions, self.thoughts = Pile((), DECISION), Pile((), THOUGHT)
        self.poses = Pile((len(TRAJECTORY_COLUMNS),), np.float64)
        self.spike_step, self.spike_neuron = Pile((), np.int32), Pile((), np.int32)
        self._pose_stride = pose_stride

    def add(self, record: DecisionRecord, decision: int, rolling: float) -> None:
        """Take what the mode keeps of one record."""
        move = record.move
        if record.activity is not None:
            self._think(record.activity, record.time_s)
        self.decisions.append(
            (
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
        )

    def clear(self) -> None:
        """Forget what was sent."""
        for pile in (self.decisions, self.thoughts, self.poses, self.spike_step, self.spike_neuron):
            pile.clear()

    def _think(self, activity: Activity, time_s: float) -> None:
        thinking_only = self.mode == "light"
        spikes = activity.thinking_spikes if thinking_only else len(activity.spike_step)
        steps = activity.thinking_steps if thinking_only else activity.steps
        self.spike_step.add(activity.spike_step[:spikes])
        self.spike_neuron.add(activity.spike_neuron[:spikes])
        self.thoughts.append(
            (
                len(self.decisions),
                *count_by_population(activity),
                activity.steps,
                activity.mean_weights,
                activity.dopamine,
                self.strip.place(time_s, steps * self.clock.neural_step_ms),
            )
        )
