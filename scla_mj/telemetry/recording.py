"""The recorder: takes what a run hands it, lets the views keep it in columns, and sends them to a `.rrd` file."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import rerun as rr

from scla_mj.anatomy import Anatomy
from scla_mj.checked import CheckedConfig
from scla_mj.environment import hidden
from scla_mj.errors import SclaError
from scla_mj.signals import DecisionRecord, Snapshot
from scla_mj.telemetry import names
from scla_mj.telemetry.dashboard import build_dashboard
from scla_mj.telemetry.growable_array import GrowableArray
from scla_mj.telemetry.growth import Growth
from scla_mj.telemetry.viewer import Watched
from scla_mj.telemetry.views import VIEWS
from scla_mj.telemetry.views.base import DECISION, EpochCount, RecordedRun, View, end_time_s, set_time
from scla_mj.telemetry.views.learned import is_remembered

_DECISIONS_A_FLUSH: Final = 1000
"""Columns this long cost 31 bytes a number on disk where single rows cost 1300; of shorter ones Rerun keeps more."""
_BYTES_A_FLUSH: Final = 8_000_000
"""And so much bounds the memory of a full recording, whose million spikes take some 50 MB while they are sorted."""

_FLUSH_AT_MOST_S: Final = 120.0
"""A disk so slow is taken for a dead one: Rerun would wait for ever."""
_ROOM_BYTES: Final = 2_000_000
"""Far more than a recording's first words, or than what is logged row by row between two columns."""
_DECISION_BYTES: Final = 20_000
"""More than twice what a decision takes on the disk without its spikes; twice what waits in memory covers those."""


class RerunRecorder:
    """Writes one run into one `.rrd` file. It only reads what it is given, and owns its copies.

    Args:
        path: the file to write; it must not exist yet.
        checked: the run's configuration; telemetry "full" keeps every spike, else the thinking windows' are kept.
        anatomy: the brain's, which entities are named after; None for a brain without neurons.
        model: the compiled `mujoco.MjModel` to draw.
        run_id: the recording's identity; a resumed run's next part carries the same one.
        first_decision: the first one that the file will hold, counted over the run: above 1 for a later part.
        memory: what the brain knows before that one, recorded too; what it lacks has no panel in the dashboard.
        views: what is recorded, in the order in which it is sent.

    Raises:
        SclaError: the file exists already or cannot be written.
    """

    def __init__(
        self,
        path: Path,
        checked: CheckedConfig,
        *,
        anatomy: Anatomy | None,
        model: Any,
        run_id: str,
        first_decision: int = 1,
        memory: Snapshot | None = None,
        views: Sequence[type[View]] = VIEWS,
    ) -> None:
        self._path, self._run = Path(path), RecordedRun(checked, model, anatomy, memory or Snapshot())
        self._first: Snapshot | None = self._run.memory
        with hidden("RERUN", "_RERUN"):  # which switch a recording off, or send it elsewhere
            self._stream = rr.RecordingStream(names.APPLICATION, recording_id=run_id)
        self._views = [view(self._stream, self._run) for view in views]
        _open(self._path, self._stream, build_dashboard(panel for view in self._views for panel in view.panels()))
        self._stream.send_property(names.PROPERTIES, rr.AnyValues(**_properties(self._run, first_decision)))
        for view in self._views:
            view.log_static()
        # Columns overtake what is logged row by row: a file cut short must hold at least what it is about.
        self._flush()
        self._decisions = GrowableArray(DECISION)
        self._decision, self._end_s = first_decision - 1, 0.0
        self._growth, self._earlier = Growth(self._path), list[dict[str, Any]]()
        self._watched, self._closed = Watched(self._path.parent), False

    def wants_memory(self, record: DecisionRecord) -> bool:
        """Return whether the brain's memory after this decision, the next one to be written, is to be recorded."""
        return is_remembered(self._decision + 1, record.decision, self._run.config.decisions)

    def write(self, record: DecisionRecord, snapshot: Snapshot | None = None) -> None:
        """Record one decision, and the brain's memory after it if a snapshot is given."""
        if record.decision == 1 and self._run.checked.jumps_in(record.epoch):
            self._set_time()
            self._run.epoch = record.epoch
            for view in self._views:
                view.move_target()
        if self._first is not None:
            set_time(self._stream, record.time_s, self._decision + 1, record.epoch)
            for view in self._views:
                view.remember(self._first, self._decision)
            self._first = None
        self._decision, self._end_s, self._run.epoch = self._decision + 1, end_time_s(record), record.epoch
        code, thinks = names.OUTCOME_CODES[record.move.outcome], self._run.activity(record) is not None
        decided_s = min(record.time_s + self._run.clock.thinking_window_s, self._end_s)
        row = record.time_s, decided_s, self._end_s, self._decision, record.epoch, record.hit, code, thinks
        self._decisions.append(row)
        for view in self._views:
            view.add(record, self._decision)
        self._remember(snapshot)
        waiting = len(self._decisions)
        if waiting >= _DECISIONS_A_FLUSH or (waiting % 10 == 0 and self._waiting_bytes() >= _BYTES_A_FLUSH):
            self._send()
        elif self._watched.wants_more():
            self._send()
            self._flush()

    def end_epoch(self, *, hits: int, decisions: int) -> None:
        """Record what the epoch of the last decision earned: `hits` in all its `decisions`."""
        count = EpochCount(self._run.epoch, decisions, hits, self._run.ceiling_hits_per_1000)
        self._set_time()
        for view in self._views:
            view.end_epoch(count)

    def sync(self) -> None:
        """Put every decision so far on the disk, safe from a power cut.

        Raises:
            SclaError: the file has gone, or the disk fails.
        """
        self._send()
        self._flush()
        try:
            self._growth.sync()
        except OSError as error:
            raise _cannot_write(self._path, error.strerror or error) from error

    def state(self) -> dict[str, Any]:
        """Return everything that `restore` needs for another recorder to continue from here."""
        return {
            "epoch": self._run.epoch,
            "end_s": self._end_s,
            "views": {type(view).__name__: view.state() for view in self._views},
            "parts": [*self._earlier, self._growth.state()],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue where another recorder was when `state` was taken."""
        self._run.epoch, self._end_s = state["epoch"], state["end_s"]
        for view in self._views:
            view.restore(state["views"][type(view).__name__])
        self._earlier = list(state["parts"])

    def close(self, snapshot: Snapshot | None = None, *, stopped: bool = False) -> None:
        """Send what is left, the brain's last memory if given, and finish the file; a second call does nothing.

        `stopped` says that the run may yet be resumed.
        """
        if self._closed:
            return
        self._closed = True
        try:
            if stopped:
                self._set_time()
                for view in self._views:
                    view.stop(self._decision)
            self._remember(snapshot, last=True)
            self._send()
            self._flush()
        finally:
            self._stream.disconnect()

    def _set_time(self) -> None:
        """Set the stream's time to the end of the last decision, or to the run's start."""
        set_time(self._stream, self._end_s, self._decision, self._run.epoch)

    def _remember(self, snapshot: Snapshot | None, *, last: bool = False) -> None:
        if snapshot is not None:
            self._set_time()
            for view in self._views:
                view.remember(snapshot, self._decision, last=last)

    def _waiting_bytes(self) -> int:
        return sum(array.rows.nbytes for view in self._views for array in view.gathered)

    def _send(self) -> None:
        """Hand what waits to Rerun, whose threads wait for ever once a disk is full: so only while there is room."""
        wanted_bytes = _ROOM_BYTES + _DECISION_BYTES * len(self._decisions) + 2 * self._waiting_bytes()
        try:
            free_bytes = shutil.disk_usage(self._path.parent).free
        except OSError as error:
            raise _cannot_write(self._path, error.strerror or error) from error
        if free_bytes < wanted_bytes:
            raise _cannot_write(
                self._path, f"{free_bytes / 1e6:.1f} MB are free, {wanted_bytes / 1e6:.1f} MB are wanted"
            )
        if not len(self._decisions):
            return
        rows = self._decisions.rows.copy()
        for view in self._views:
            view.send(rows)
        for array in (self._decisions, *(array for view in self._views for array in view.gathered)):
            array.clear()

    def _flush(self) -> None:
        try:
            self._stream.flush(timeout_sec=_FLUSH_AT_MOST_S)
        except Exception as error:  # the writing thread has ended: the disk is full, or the file has gone
            raise _cannot_write(self._path, error) from error


def _open(path: Path, stream: rr.RecordingStream, blueprint: Any) -> None:
    if path.exists():
        raise SclaError(f"the recording {path} exists already: choose another run folder")
    _check_room(path)
    stream.set_log_time_enabled(False)
    stream.set_log_tick_enabled(False)
    try:
        with hidden("RERUN", "_RERUN"):
            stream.set_sinks(rr.FileSink(path), default_blueprint=blueprint)
    except Exception as error:
        raise _cannot_write(path, error) from error


def _check_room(path: Path) -> None:
    try:
        with tempfile.TemporaryFile(dir=path.parent) as scratch:  # without a name: a kill leaves nothing
            scratch.write(bytes(_ROOM_BYTES))
    except OSError as error:
        raise _cannot_write(path, error.strerror or error) from error


def _cannot_write(path: Path, reason: object) -> SclaError:
    return SclaError(f"the recording {path} cannot be written: {reason}; free the disk or choose another RUN")


def _properties(run: RecordedRun, first_decision: int) -> dict[str, str | float | list[int]]:
    return {
        "format": names.FORMAT,
        "telemetry": run.config.telemetry,
        "protocol": run.config.protocol,
        "seed": run.config.seed,
        "ceiling_hits_per_1000": run.ceiling_hits_per_1000,
        "cells": list(run.grid.cells),
        "target": list(run.grid.target),
        **({"others": [part for cell in run.grid.others for part in cell]} if run.grid.others else {}),
        "cell_size_m": run.grid.cell_size_m,
        "neural_step_ms": run.clock.neural_step_ms,
        "thinking_window_s": run.clock.thinking_window_s,
        names.FIRST_DECISION: first_decision,
        names.ANATOMY: json.dumps(None if run.anatomy is None else run.anatomy.content()),
    }
