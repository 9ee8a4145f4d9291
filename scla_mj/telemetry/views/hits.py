"""How decisions end, and the learning curve: the last hundred decisions, each epoch, and the ceiling."""

from __future__ import annotations

from collections import deque
from typing import Any, Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from scla_mj.palette import HIT_COLOUR, on_either
from scla_mj.signals import DecisionRecord
from scla_mj.telemetry import names
from scla_mj.telemetry.views import base

_LEARNING: Final = "learning"
_ROLLING: Final = "learning/last_100_decisions"
_DURATION_S: Final = "decisions/duration_s"
_RECENT: Final = 100
"""Decisions in the rolling mean."""

_LEARNING_COLOUR: Final = (92, 132, 180)
_CEILING_COLOUR: Final = (150, 156, 168)
_END: Final = np.dtype([("duration_s", np.float64), ("position_error_m", np.float64), ("rolling", np.float64)])


class Hits(base.View):
    """Hits per 1000 decisions, and each decision's hit, outcome, duration and position error."""

    def __init__(self, stream: rr.RecordingStream, run: base.RecordedRun) -> None:
        super().__init__(stream, run)
        self._ends = self.gather(_END)
        self._recent: deque[bool] = deque(maxlen=_RECENT)
        self._ceiling_is_due = True

    def panels(self) -> list[base.Panel]:
        """Return the learning curve of the whole run, in two tabs."""
        return [
            base.Panel(base.Place.NOW_RIGHT, self._panel(), rank=4, share=2),
            base.Panel(base.Place.LEARNING_TOP, self._panel(), rank=1),
        ]

    def _panel(self) -> rrb.TimeSeriesView:
        checked = self.run.checked
        ceiling = max(checked.ceiling_hits_per_1000(epoch) for epoch in (1, *(begin for begin, _ in checked.jumps)))
        return base.curves(
            [f"/{_LEARNING}/**"],
            f"Hits per 1000 decisions: {self.run.title}",
            axis_x=base.WHOLE_RUN,
            axis_y=rrb.ScalarAxis(range=(0.0, 1.2 * ceiling)),
            corner=rrb.Corner2D.RightBottom,
        )

    def log_static(self) -> None:
        """Log each curve's name and colour."""
        base.log_line(self.stream, _ROLLING, _LEARNING_COLOUR, "last 100 decisions", 1.0)
        base.log_line(self.stream, names.EPOCH_HITS, HIT_COLOUR, "epoch", 2.5)
        dots = rr.SeriesPoints(colors=[on_either(HIT_COLOUR)], names=["epoch"], markers="circle", marker_sizes=[5.0])
        self.stream.log(names.EPOCH_HITS, dots, static=True)
        base.log_line(self.stream, names.CEILING, _CEILING_COLOUR, f"ceiling of {self.run.config.protocol}", 1.5)

    def add(self, record: DecisionRecord, decision: int) -> None:
        """Keep how the decision ended; of the first, and the first after a jump, log the ceiling at its start."""
        if self._ceiling_is_due:
            base.set_time(self.stream, record.time_s, decision, record.epoch)
            self._log_ceiling()
        self._recent.append(record.hit)
        rolling = 1000 * sum(self._recent) / len(self._recent)
        self._ends.append((record.move.duration_s, record.move.position_error_m, rolling))

    def send(self, rows: base.Rows) -> None:
        """Send a value per decision and curve, at the decision's end."""
        index, ends = base.at(rows, "end_s"), self._ends.rows
        for entity, values in (
            (_ROLLING, ends["rolling"]),
            (names.OUTCOME, rows["outcome"]),
            (_DURATION_S, ends["duration_s"]),
            (names.POSITION_ERROR_M, ends["position_error_m"]),
            (names.HIT, rows["hit"]),
        ):
            base.send_scalars(self.stream, entity, index, values)

    def end_epoch(self, count: base.EpochCount) -> None:
        """Log the epoch's point of the learning curve, and the ceiling up to there."""
        self.stream.log(names.EPOCH_HITS, rr.Scalars(count.hits_per_1000))
        self._log_ceiling()

    def move_target(self) -> None:
        """Log the new ceiling with the next decision."""
        self._ceiling_is_due = True

    def state(self) -> dict[str, Any]:
        """Return the last hundred decisions' hits, and whether the ceiling is logged up to now."""
        return {"recent": list(self._recent), "ceiling_is_due": self._ceiling_is_due}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a `state`."""
        self._recent.extend(state["recent"])
        self._ceiling_is_due = state["ceiling_is_due"]

    def _log_ceiling(self) -> None:
        self.stream.log(names.CEILING, rr.Scalars(self.run.ceiling_hits_per_1000))
        self._ceiling_is_due = False
