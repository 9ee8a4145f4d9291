"""Why the robot goes where it goes, in the arena: motor populations' votes as arrows, a beam to a sensed target."""

from __future__ import annotations

from typing import Final

import numpy as np
import rerun as rr

from scla_mj.anatomy import Anatomy, motors_of
from scla_mj.grid import Action
from scla_mj.palette import ACTION_COLOURS
from scla_mj.signals import DecisionRecord
from scla_mj.telemetry import names
from scla_mj.telemetry.views import base

_VOTES: Final = f"{names.WORLD}/votes"
_BEAM: Final = f"{names.WORLD}/beam"
_HEIGHT_M: Final = 0.17
"""Above the robot."""
_BEAM_HEIGHT_M: Final = 0.05
_BEAM_COLOUR: Final = (245, 245, 245)
_REACH: Final = 1.0
"""Length, in cells, of the arrow of a population that has all spikes."""
_STEPS: Final = np.array([(*action.step, 0) for action in Action], np.float32)


class Votes(base.View):
    """Four arrows over the cell, as long as the motor populations' shares of the spikes; a beam to a sensed target."""

    def __init__(self, stream: rr.RecordingStream, run: base.RecordedRun) -> None:
        super().__init__(stream, run)
        self._motors = _motors(run.anatomy)
        self._cells, self._votes = self.gather(np.float32, 2), self.gather(np.float32, len(Action))
        self._sensed = self.gather(np.int8)

    def log_static(self) -> None:
        """Log how wide they are, and the colours."""
        beam = rr.LineStrips3D.from_fields(radii=[0.008], colors=[_BEAM_COLOUR])
        self.stream.log(_BEAM, beam, static=True)
        if self._motors:
            look = rr.Arrows3D.from_fields(radii=[0.011], colors=[ACTION_COLOURS[action] for action in Action])
            self.stream.log(_VOTES, look, static=True)

    def add(self, record: DecisionRecord, decision: int) -> None:
        """Keep the cell, the votes and the sensed direction."""
        self._cells.append(self.run.grid.centre_m(record.move.before))
        self._sensed.append(-1 if record.percept.sensed is None else record.percept.sensed)
        votes = record.chosen.motor_spikes
        self._votes.append([0 if votes is None else votes[motor] for motor in self._motors] or [0] * len(Action))

    def send(self, rows: base.Rows) -> None:
        """Send the beam at a decision's start, and the arrows when it is decided."""
        cells, sensed = self._cells.rows, self._sensed.rows
        seen = sensed >= 0
        starts = np.column_stack([cells[seen], np.full(np.count_nonzero(seen), _BEAM_HEIGHT_M)])
        ends = starts + self.run.grid.cell_size_m * _STEPS[sensed[seen]]
        points = np.stack([starts, ends], axis=1).reshape(-1, 3).astype(np.float32)
        strips = base.line_strips(points, np.full(len(starts), 2))
        beams = rr.LineStrips3D.columns(strips=strips).partition(seen.astype(int))
        self.stream.send_columns(_BEAM, base.at(rows, "start_s"), beams)
        if self._motors:
            votes = self._votes.rows
            shares = votes / np.maximum(votes.sum(axis=1, keepdims=True), 1)
            vectors = shares[:, :, np.newaxis] * _STEPS * (_REACH * self.run.grid.cell_size_m)
            origins = np.repeat(np.column_stack([cells, np.full(len(rows), _HEIGHT_M)]), len(Action), axis=0)
            arrows = rr.Arrows3D.columns(vectors=vectors.reshape(-1, 3), origins=origins.astype(np.float32))
            self.stream.send_columns(_VOTES, base.at(rows, "decided_s"), arrows.partition([len(Action)] * len(rows)))


def _motors(anatomy: Anatomy | None) -> list[int]:
    """Return which motor population stands for each action, by the ends of their names; [] unless all are clear."""
    found = []
    for action in Action:
        ends = (action.label, action.label[0])
        own = [n for n, name in enumerate(motors_of(anatomy)) if name.lower().endswith(ends)]
        found += own if len(own) == 1 else []
    return found if len(found) == len(Action) == len(set(found)) else []
