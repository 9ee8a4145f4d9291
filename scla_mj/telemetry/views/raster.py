"""Spikes as a scrolling raster: one point per spike, x the time along the raster in ms, y the neuron.

Points are the compact form (about 5 bytes per spike on disk) and a population's can be counted without looking at them.
The raster scrolls because their common parent entity moves left with time. A light recording joins the thinking
windows into one strip; a full one runs with simulated time.
"""

from __future__ import annotations

from collections.abc import Sequence
from os.path import commonpath
from typing import Any, Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from scla_mj.anatomy import Population
from scla_mj.palette import BACKGROUND, population_colours
from scla_mj.signals import DecisionRecord
from scla_mj.telemetry import names
from scla_mj.telemetry.views import base

_LABELS: Final = "brain/raster/labels"
_MARGIN: Final = "brain/raster/margin"

_STRIP_LENGTH_MS: Final = 1_000_000.0
"""Where x starts again at 0: a float32 still resolves a sixteenth of a millisecond there."""
WINDOWS_SHOWN: Final = 13
_FULL_SHOWN_MS: Final = 1300.0
"""A full recording's raster shows a whole decision, a light one's the last thinking windows."""
ASPECT: Final = 0.46
"""Height of the raster by its width, as its place in the dashboard wants it."""
LABELS_SHARE: Final = 0.1
"""Room for the populations' names right of now, by the raster's width."""
_LABEL_RISE: Final = 0.035
"""Rerun draws a label below its point: by about this share of the neurons."""
_LABEL_ROOM: Final = 0.07
"""Smaller populations, by the share of their neurons, have a label together with their neighbours of the same role."""
_BEYOND: Final = 3.0
"""Far beyond any view's edge, by the neurons or, if that is more, by 1000."""


class Raster(base.View):
    """The spikes, and the thinking windows in the colours of how their moves ended."""

    def __init__(self, stream: rr.RecordingStream, run: base.RecordedRun) -> None:
        super().__init__(stream, run)
        self._light = run.config.telemetry == "light"
        self._window_ms = run.clock.thinking_steps * run.clock.neural_step_ms
        self._shown_ms = WINDOWS_SHOWN * self._window_ms if self._light else _FULL_SHOWN_MS
        self._neurons, populations = int(run.sizes.sum()), len(run.populations)
        self._population_of = np.repeat(np.arange(populations, dtype=np.min_scalar_type(populations)), run.sizes)
        # A decision with spikes: the kept ones by population, where along the raster it begins, and when it was posed.
        thought = [("counts", np.int64, (populations,)), ("origin_ms", np.float64), ("poses", np.int64)]
        self._thoughts, self._pose_s = self.gather(np.dtype(thought)), self.gather(np.float64)
        self._step, self._neuron = self.gather(np.int32), self.gather(np.int32)
        self._start_s: float | None = None
        self._next_ms = 0.0

    def panels(self) -> list[base.Panel]:
        """Return the last thinking windows side by side, or the last stretch of simulated time, in two tabs."""
        if not self._neurons:
            return []
        return [
            base.Panel(base.Place.NOW_RIGHT, self._panel(), rank=2, share=4),
            base.Panel(base.Place.BRAIN_LEFT, self._panel(), rank=1, share=3),
        ]

    def _panel(self) -> rrb.Spatial2DView:
        x_range = [-self._shown_ms, LABELS_SHARE * self._shown_ms]
        height = ASPECT * self._shown_ms
        what = f"last {WINDOWS_SHOWN} thinking windows" if self._light else f"last {self._shown_ms:g} ms"
        return rrb.Spatial2DView(
            origin="/",
            contents=[f"/{names.SPIKES}/**", f"/{_LABELS}", f"/{_MARGIN}"],
            name=f"Spikes of {self._neurons} neurons, {what}",
            visual_bounds=rrb.VisualBounds2D(x_range=x_range, y_range=[-0.02 * height, 1.02 * height]),
            time_ranges=base.last(WINDOWS_SHOWN * 2.0 if self._light else 3.0),
            background=list(BACKGROUND),
        )

    def log_static(self) -> None:
        """Log the colours and the labels, and cover what the robot has not lived through yet."""
        if not self._neurons:
            return
        for name, colour in population_colours(self.run.populations).items():
            look = rr.Points2D.from_fields(colors=[colour], radii=[rr.Radius.ui_points(1.3)])
            self.stream.log(f"{names.SPIKES}/{name}", look, static=True)
        scale = rr.Transform3D(scale=[1.0, ASPECT * self._shown_ms / self._neurons, 1.0])
        self.stream.log("brain", scale, static=True)
        self.stream.log(names.WINDOWS, rr.Boxes2D.from_fields(radii=[rr.Radius.ui_points(0.5)]), static=True)
        # The future lies right of x = 0: the spikes are known at a decision's start.
        margin = np.full((1, 1, 3), BACKGROUND, np.uint8)
        self.stream.log(_MARGIN, rr.Image(margin, draw_order=50.0), static=True)
        beyond = _BEYOND * max(1000, self._neurons)
        cover = rr.Transform3D(translation=[0.0, -beyond, 0.0], scale=[beyond, self._neurons + 2 * beyond, 1.0])
        self.stream.log(_MARGIN, cover, static=True)
        labelled = _labelled(self.run.populations, _LABEL_ROOM * self._neurons)
        x, room = LABELS_SHARE / 2 * self._shown_ms, _LABEL_ROOM * self._neurons
        places = [(group.start + group.stop) / 2 - _LABEL_RISE * self._neurons for group in labelled]
        for above in reversed(range(len(places) - 1)):
            places[above] = min(places[above], places[above + 1] - room)
        labels = rr.Points2D(
            [(x, y) for y in places],
            labels=[group.name for group in labelled],
            colors=[base.LABEL_COLOUR],
            radii=[rr.Radius.ui_points(0.0)],
            show_labels=True,
        )
        self.stream.log(_LABELS, labels, static=True)

    def add(self, record: DecisionRecord, decision: int) -> None:
        """Keep the spikes of the thinking window, or all."""
        activity = self.run.activity(record)
        if activity is None:
            return
        spikes = activity.thinking_spikes if self._light else len(activity.spike_step)
        self._step.extend(activity.spike_step[:spikes])
        self._neuron.extend(activity.spike_neuron[:spikes])
        steps = activity.thinking_steps if self._light else activity.steps
        origin_ms = self._place(record.time_s, steps * self.run.clock.neural_step_ms)
        thinking, whole = self.run.count_spikes(activity)
        trajectory = record.move.trajectory
        kept = base.kept_poses(0 if self._light else len(trajectory), self.run.clock.control_period_s)
        self._pose_s.extend(trajectory[kept, 0])
        self._thoughts.append((thinking if self._light else whole, origin_ms, len(kept)))

    def send(self, rows: base.Rows) -> None:
        """Send a row per decision and population, at the time when the thinking window opened, and frames at its end.

        What lies ahead is covered until the raster has moved on.
        """
        rows, thoughts = rows[rows["thinks"]], self._thoughts.rows
        if not len(rows):
            return
        index, origins_ms = base.at(rows, "start_s"), thoughts["origin_ms"]
        middle = np.array([self._window_ms / 2, self._neurons / 2])
        centres = np.column_stack([origins_ms, np.zeros(len(rows))]) + middle
        half_sizes = np.tile(middle, (len(rows), 1))
        boxes = rr.Boxes2D.columns(half_sizes=half_sizes, centers=centres, colors=base.outcome_colours(rows))
        self.stream.send_columns(names.WINDOWS, base.at(rows, "end_s"), boxes)
        counts = thoughts["counts"].T
        for population, points, lengths in zip(self.run.populations, self._points(thoughts), counts, strict=True):
            columns = rr.Points2D.columns(positions=points).partition(lengths)
            self.stream.send_columns(f"{names.SPIKES}/{population.name}", index, columns)
        if self._light:
            ends_ms = np.column_stack([origins_ms, origins_ms + self._window_ms]).reshape(-1)
            self._scroll(base.at(rows, "start_s", "decided_s"), ends_ms)
        elif len(self._pose_s):
            poses, time_s = thoughts["poses"], self._pose_s.rows
            passed_ms = 1000 * (time_s - np.repeat(rows["start_s"], poses))
            self._scroll(base.at_poses(rows, time_s, poses), np.repeat(origins_ms, poses) + passed_ms)

    def state(self) -> dict[str, Any]:
        """Return where the next decision goes."""
        return {"start_s": self._start_s, "next_ms": self._next_ms}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a `state`."""
        self._start_s, self._next_ms = state["start_s"], state["next_ms"]

    def _place(self, time_s: float, length_ms: float) -> float:
        """Return where along the raster the decision lies that began at `time_s` and fills `length_ms` of it."""
        if self._start_s is None:
            self._start_s = time_s
        origin_ms = self._next_ms if self._light else 1000 * (time_s - self._start_s)
        if origin_ms + length_ms > _STRIP_LENGTH_MS:
            origin_ms, self._start_s = 0.0, time_s
        self._next_ms = origin_ms + length_ms
        return origin_ms

    def _points(self, thoughts: NDArray[np.void]) -> list[NDArray[np.float32]]:
        """Return every population's points (n, 2), decision after decision."""
        neuron, counts = self._neuron.rows, thoughts["counts"]
        # Stable, and a radix sort on one byte or two: within a population the spikes stay in the order of time.
        order = np.argsort(self._population_of[neuron], kind="stable")
        time_ms = self._step.rows * self.run.clock.neural_step_ms
        time_ms += np.repeat(thoughts["origin_ms"], counts.sum(axis=1))
        points = np.empty((len(neuron), 2), np.float32)
        points[:, 0] = time_ms[order]
        points[:, 1] = neuron[order]
        return np.split(points, np.cumsum(counts.sum(axis=0))[:-1])

    def _scroll(self, index: list[rr.TimeColumn], now_ms: NDArray[np.float64]) -> None:
        """Move the raster so that now is x = 0: the end of a thinking window, or every pose."""
        translation = np.zeros((len(now_ms), 3), np.float32)
        translation[:, 0] = -now_ms
        self.stream.send_columns(names.SPIKES, index, rr.Transform3D.columns(translation=translation))


def _labelled(populations: Sequence[Population], room: float) -> list[Population]:
    """Return what has a label: populations, and neighbours of one role that are too small for one each, together."""
    groups: list[list[Population]] = []
    for population in populations:
        joins = groups and groups[-1][-1].role == population.role
        if joins and max(population.size, groups[-1][-1].size) < room:
            groups[-1].append(population)
        else:
            groups.append([population])
    return [
        Population(commonpath([own.name for own in group]) or group[0].role, group[0].start, group[-1].stop)
        for group in groups
    ]
