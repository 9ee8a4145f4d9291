"""What is written over a frame: epoch, decision, hits, what the robot senses and does, and the last spikes."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from scla_mj.engine.stored_run import StoredRun
from scla_mj.palette import BACKGROUND, HIT_COLOUR, RGB, population_colours
from scla_mj.telemetry.reading.series import DecisionSpikes

WINDOWS: Final = 12
"""Decision windows that the raster shows side by side."""
_RASTER: Final = (0.36, 0.24)
"""Its share of a frame's width and height."""
_SHADE: Final = 0.75
_TEXT: Final[RGB] = (245, 245, 245)
_LINES_PER_FRAME: Final = 26
_ROUNDING_S: Final = 1e-6
"""A decision's last pose and the end that its start and duration sum to differ in their last digits."""


class Overlay:
    """Draws over frames of one size; `decisions` are those that are shown, counted over the run from 1."""

    def __init__(self, run: StoredRun, decisions: range, spikes: DecisionSpikes | None, size: tuple[int, int]) -> None:
        table = run.decisions
        self._rows = table.slice(decisions.start - 1, len(decisions)).to_pylist()
        self._first = decisions.start
        self._begun_s = np.array([row["time_s"] for row in self._rows])
        self._window_s = run.checked.clock.thinking_window_s
        self._ends_s = self._begun_s + self._window_s + np.array([row["duration_s"] for row in self._rows])
        self._epoch, before = self._rows[0]["epoch"], self._rows[0]["decision"] - 1
        self._hits_before = sum(table["hit"].slice(decisions.start - 1 - before, before).to_pylist())
        self._size_px = size[1] / _LINES_PER_FRAME
        self._font = ImageFont.load_default(self._size_px)
        self._raster = None if spikes is None or not len(spikes.time_s) else self._placed(run, decisions, spikes, size)

    def draw(self, frame: NDArray[np.uint8], time_s: float) -> NDArray[np.uint8]:
        """Return a frame, (height, width, 3), with what is known at a time of the run."""
        number = max(0, int(np.searchsorted(self._begun_s, time_s, side="right")) - 1)
        if self._raster is not None:
            self._draw_spikes(frame, time_s, number)
        picture = Image.fromarray(frame)
        pen, line_px = ImageDraw.Draw(picture), 1.3 * self._size_px
        for place, (text, colour) in enumerate(self._lines(number, time_s)):
            where = (0.6 * line_px, (0.5 + place) * line_px)
            pen.text(where, text, fill=colour, font=self._font, stroke_width=2, stroke_fill=BACKGROUND)
        return np.array(picture)

    def _lines(self, number: int, time_s: float) -> list[tuple[str, RGB]]:
        row = self._rows[number]
        ended = zip(self._rows, self._ends_s <= time_s + _ROUNDING_S, strict=True)
        hits = sum(other["hit"] for other, over in ended if over and other["epoch"] == row["epoch"])
        hits += self._hits_before if row["epoch"] == self._epoch else 0
        lines = [
            (f"decision {self._first + number} (epoch {row['epoch']})   {time_s:.1f} s", _TEXT),
            (f"{hits} hits in this epoch", HIT_COLOUR),
        ]
        if time_s >= self._begun_s[number] + self._window_s:
            sensed = f"senses the target {row['sensed']}" if row["sensed"] not in (None, "none") else "senses nothing"
            advised = f", advised {row['advised']}" if row["advised"] not in (None, "none") else ""
            lines.append((f"{sensed}{advised}: goes {row['executed']}", _TEXT))
        return lines

    def _placed(
        self, run: StoredRun, decisions: range, spikes: DecisionSpikes, size: tuple[int, int]
    ) -> tuple[NDArray[np.float64], ...]:
        """Return of every spike its time, its place along the raster in windows, its height 0 to 1, its colour."""
        assert run.anatomy is not None
        number = spikes.decision - decisions.start
        inside_s = spikes.time_s - self._begun_s[number]
        kept = inside_s < self._window_s  # a full recording has the drive's spikes too
        colours = population_colours(run.anatomy.populations)
        palette = np.array([colours[name] for name in spikes.population[kept]], float)
        place = number[kept] + inside_s[kept] / self._window_s
        self._raster_px = tuple(max(40, round(share * side)) for share, side in zip(_RASTER, size, strict=True))
        return spikes.time_s[kept], place, spikes.neuron[kept] / run.anatomy.neurons, palette

    def _draw_spikes(self, frame: NDArray[np.uint8], time_s: float, number: int) -> None:
        assert self._raster is not None
        (width, height), margin = self._raster_px, self._size_px / 2
        inset = frame[-height - round(margin) : -round(margin), -width - round(margin) : -round(margin)]
        inset[:] = _SHADE * np.array(BACKGROUND) + (1 - _SHADE) * inset
        spike_s, place, at, colour = self._raster
        x = place - (number + 1 - WINDOWS)
        shown = (spike_s <= time_s) & (x >= 0)
        inset[(at[shown] * height).astype(int), (x[shown] / WINDOWS * width).astype(int)] = colour[shown]
