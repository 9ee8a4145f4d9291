"""Membrane potentials of the watched neurons, under the same decision windows as a light recording's raster."""

from __future__ import annotations

from typing import Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from scla_mj.palette import BACKGROUND, population_colours
from scla_mj.signals import DecisionRecord
from scla_mj.telemetry.views import base
from scla_mj.telemetry.views.raster import ASPECT, LABELS_SHARE, WINDOWS_SHOWN

_TRACES: Final = "potentials/traces"
_LABELS: Final = "potentials/labels"
_LOW_MV, _HIGH_MV = -85.0, 30.0
_EVERY_MS: Final = 2.0
"""A point this often; a spike in between counts for it."""
_WRAP: Final = 10_000
"""Decisions after which x starts again, where a float32 still resolves a step."""
_MOST_LABELS: Final = 20


class Potentials(base.View):
    """A trace per watched neuron, in the colour of its population."""

    def __init__(self, stream: rr.RecordingStream, run: base.RecordedRun) -> None:
        super().__init__(stream, run)
        self._watched = () if run.anatomy is None else run.anatomy.watched
        self._window_ms = run.clock.thinking_steps * run.clock.neural_step_ms
        self._stride = max(1, round(_EVERY_MS / run.clock.neural_step_ms))
        self._row = ASPECT * WINDOWS_SHOWN * self._window_ms / max(1, len(self._watched))
        self._points = self.gather(np.float32, len(self._watched))
        self._has = self.gather(np.bool_)
        self._length = 0

    def panels(self) -> list[base.Panel]:
        """Return the traces of the last windows."""
        if not self._watched:
            return []
        shown_ms, height = WINDOWS_SHOWN * self._window_ms, self._row * len(self._watched)
        panel = rrb.Spatial2DView(
            origin="/",
            contents=[f"/{_TRACES}/**", f"/{_LABELS}"],
            name=f"Membrane potential of {len(self._watched)} neurons, the same windows",
            visual_bounds=rrb.VisualBounds2D(
                x_range=[-shown_ms, LABELS_SHARE * shown_ms], y_range=[-0.02 * height, 1.02 * height]
            ),
            time_ranges=base.last(2.0 * WINDOWS_SHOWN),
            background=list(BACKGROUND),
        )
        return [base.Panel(base.Place.BRAIN_LEFT, panel, rank=2, share=3)]

    def log_static(self) -> None:
        """Log colours and names."""
        if not self._watched:
            return
        colours = population_colours(self.run.populations)
        names = [next(p.name for p in self.run.populations if neuron < p.stop) for neuron in self._watched]
        look = rr.LineStrips2D.from_fields(colors=[colours[name] for name in names], radii=[rr.Radius.ui_points(0.6)])
        self.stream.log(f"{_TRACES}/mv", look, static=True)
        if len(names) <= _MOST_LABELS:
            x = LABELS_SHARE / 2 * WINDOWS_SHOWN * self._window_ms
            labels = rr.Points2D(
                [(x, (row + 0.35) * self._row) for row in range(len(names))],
                labels=names,
                colors=[base.LABEL_COLOUR],
                radii=[rr.Radius.ui_points(0.0)],
                show_labels=True,
            )
            self.stream.log(_LABELS, labels, static=True)

    def add(self, record: DecisionRecord, decision: int) -> None:
        """Keep the potentials, the highest of each few steps."""
        activity = self.run.activity(record)
        if activity is None or not self._watched:
            return
        seen = activity.potentials
        kept = np.zeros((0, len(self._watched)))
        if seen is not None and len(seen):
            kept = np.maximum.reduceat(seen, np.arange(0, len(seen), self._stride), axis=0)
        self._length = self._length or len(kept)
        self._has.append(0 < len(kept) == self._length)
        if 0 < len(kept) == self._length:
            self._points.extend(kept)

    def send(self, rows: base.Rows) -> None:
        """Send a strip per neuron and decision once it is decided, and move all to the left with every decision."""
        rows, has = rows[rows["thinks"]], self._has.rows
        if not self._length or not len(rows):
            return
        neurons, column = len(self._watched), rows["decision"] % _WRAP
        seen = self._points.rows.reshape(-1, self._length, neurons).transpose(0, 2, 1)
        step_ms = self._stride * self.run.clock.neural_step_ms
        share = np.clip((seen - _LOW_MV) / (_HIGH_MV - _LOW_MV), 0.0, 1.0)
        points = np.empty((*seen.shape, 2), np.float32)
        points[..., 0] = ((column[has] - 1) * self._window_ms)[:, np.newaxis, np.newaxis]
        points[..., 0] += np.arange(1, self._length + 1) * step_ms
        # To a quarter of the view's unit: numbers of few bits pack well.
        points[..., 1] = np.round(4 * self._row * (np.arange(neurons)[:, np.newaxis] + 0.95 - 0.9 * share)) / 4
        strips = base.line_strips(points.reshape(-1, 2), np.full(len(seen) * neurons, self._length))
        traces = rr.LineStrips2D.columns(strips=strips).partition(neurons * has.astype(int))
        self.stream.send_columns(f"{_TRACES}/mv", base.at(rows, "decided_s"), traces)
        shift = np.zeros((len(rows), 3), np.float32)
        shift[:, 0] = -column * self._window_ms
        self.stream.send_columns(_TRACES, base.at(rows, "decided_s"), rr.Transform3D.columns(translation=shift))
