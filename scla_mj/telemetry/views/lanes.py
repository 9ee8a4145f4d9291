"""The last decisions side by side: what was sensed, advised, decided as arrows, how each move ended as a disc."""

from __future__ import annotations

from typing import Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from scla_mj.grid import Action
from scla_mj.palette import ACTION_COLOURS, BACKGROUND
from scla_mj.signals import DecisionRecord
from scla_mj.telemetry import names
from scla_mj.telemetry.views import base

_LANES: Final = "story/lanes"
_NAMES: Final = "story/lane_names"
_ADVICE: Final = "advice"
_ARROWS: Final = ("senses", _ADVICE, "moves")
_ENDS: Final = "ends"
_SHOWN: Final = 16
_NAMES_WIDTH: Final = 2.2
_NOTHING: Final = -1
_LENGTH: Final = 0.7
_STEPS: Final = np.array([(dx, -dy) for dx, dy in (action.step for action in Action)], np.float32)
"""Directions in a view whose y axis points down."""


class Lanes(base.View):
    """A column per decision, the latest rightmost; a lane each for what it rests on and what came of it."""

    def __init__(self, stream: rr.RecordingStream, run: base.RecordedRun) -> None:
        super().__init__(stream, run)
        self._actions = self.gather(np.int8, len(_ARROWS))
        self._is_advised = False

    def panels(self) -> list[base.Panel]:
        """Return the lanes. They are drawn, since Rerun's own have an axis of one timeline only."""
        so_far = [
            rrb.VisibleTimeRange(timeline, start=rrb.TimeRangeBoundary.infinite(), end=base.cursor())
            for timeline in (names.SIM_TIME, names.DECISION)
        ]
        panel = rrb.Spatial2DView(
            origin="/",
            contents=[f"/{_LANES}/**", f"/{_NAMES}/**"],
            name=f"Last {_SHOWN} decisions; ends: gold a hit, blue a move, red a wall",
            visual_bounds=rrb.VisualBounds2D(x_range=[-_SHOWN, _NAMES_WIDTH], y_range=[-0.1, len(_ARROWS) + 1.1]),
            time_ranges=base.last(3.0 * _SHOWN),
            overrides={f"/{_NAMES}/{_ADVICE}": rrb.VisibleTimeRanges(so_far)},
            background=list(BACKGROUND),
        )
        return [base.Panel(base.Place.NOW_LEFT, panel, rank=2, share=1.45)]

    def log_static(self) -> None:
        """Log the lanes' names, right of now."""
        for lane in (*_ARROWS, _ENDS):
            if lane != _ADVICE:
                self._log_name(lane, static=True)
        for lane in _ARROWS:
            self.stream.log(f"{_LANES}/{lane}", rr.Arrows2D.from_fields(radii=[0.08]), static=True)
        self.stream.log(f"{_LANES}/{_ENDS}", rr.Points2D.from_fields(radii=[0.3]), static=True)

    def add(self, record: DecisionRecord, decision: int) -> None:
        """Keep the three directions; of the first advice, name its lane."""
        if record.chosen.advised is not None and not self._is_advised:
            self._is_advised = True
            base.set_time(self.stream, record.time_s, decision, record.epoch)
            self._log_name(_ADVICE)
        given = (record.percept.sensed, record.chosen.advised, record.chosen.action)
        self._actions.append([_NOTHING if action is None else action for action in given])

    def send(self, rows: base.Rows) -> None:
        """Send an arrow per lane at its time, and open the next column with each decision."""
        actions, column = self._actions.rows, rows["decision"].astype(np.float32) - 0.5
        for lane, (name, time) in enumerate(zip(_ARROWS, ("start_s", "start_s", "decided_s"), strict=True)):
            self._send_arrows(
                name, rows, time, actions[:, lane], np.column_stack([column, np.full(len(rows), lane + 0.5)])
            )
        ends = np.column_stack([column, np.full(len(rows), len(_ARROWS) + 0.5)])
        discs = rr.Points2D.columns(positions=ends, colors=base.outcome_colours(rows))
        self.stream.send_columns(f"{_LANES}/{_ENDS}", base.at(rows, "end_s"), discs)
        shift = np.zeros((len(rows), 3), np.float32)
        shift[:, 0] = -rows["decision"]
        self.stream.send_columns(_LANES, base.at(rows, "start_s"), rr.Transform3D.columns(translation=shift))

    def _log_name(self, lane: str, *, static: bool = False) -> None:
        label = rr.Points2D(
            [(_NAMES_WIDTH / 2, (*_ARROWS, _ENDS).index(lane) + 0.25)],
            labels=[lane],
            colors=[base.LABEL_COLOUR],
            radii=[rr.Radius.ui_points(0.0)],
            show_labels=True,
        )
        self.stream.log(f"{_NAMES}/{lane}", label, static=static)

    def _send_arrows(
        self, lane: str, rows: base.Rows, time: str, actions: NDArray[np.int8], middle: NDArray[np.float32]
    ) -> None:
        drawn = actions != _NOTHING
        vectors = _LENGTH * _STEPS[actions[drawn]]
        origins = (middle[drawn] - vectors / 2).astype(np.float32)
        colours = np.array(ACTION_COLOURS, np.uint8)[actions[drawn]]
        if drawn.any():
            arrows = rr.Arrows2D.columns(vectors=vectors, origins=origins, colors=colours)
            self.stream.send_columns(f"{_LANES}/{lane}", base.at(rows[drawn], time), arrows)
