"""The recorder: takes what a run hands it, keeps it in columns, and sends them to a `.rrd` file."""

from __future__ import annotations

import dataclasses
import os
import shutil
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Final, NamedTuple, Self

import rerun as rr

from scla_mj.clock import Clock
from scla_mj.config import Telemetry
from scla_mj.errors import SclaError
from scla_mj.grid import Cell, Grid, StartProtocol
from scla_mj.signals import DecisionRecord, Outcome, Snapshot
from scla_mj.telemetry import names
from scla_mj.telemetry.about import describe
from scla_mj.telemetry.blueprint import build_blueprint, raster_layout
from scla_mj.telemetry.buffer import Buffer
from scla_mj.telemetry.columns import send_buffer
from scla_mj.telemetry.growth import Growth
from scla_mj.telemetry.memory import log_snapshot
from scla_mj.telemetry.poses import POSE_PERIOD_S, end_time_s
from scla_mj.telemetry.scene import log_scene
from scla_mj.telemetry.styles import log_styles
from scla_mj.telemetry.timelines import set_time

_DECISIONS_A_FLUSH: Final = 1000
"""Columns this long cost 31 bytes a number on disk where single rows cost 1300; of shorter ones Rerun keeps more."""
_SPIKES_A_FLUSH: Final = 800_000
"""And this many spikes bound the memory of a full recording (some 40 MB while they are sorted)."""

_RECENT: Final = 100
"""Decisions in the rolling mean of the hits."""

_FLUSH_AT_MOST_S: Final = 120.0
"""A disk so slow is taken for a dead one: Rerun would wait for ever."""
_ROOM_BYTES: Final = 2_000_000
"""Far more than a recording's first words, or than what is logged row by row between two columns."""
_DECISION_BYTES: Final = 20_000
_SPIKE_BYTES: Final = 16
"""More than twice what a decision and a spike take."""


class _Last(NamedTuple):
    """The decision written last, as far as what is logged after it needs to know."""

    epoch: int
    end_s: float


class RerunRecorder:
    """Writes one run into one `.rrd` file. It only reads what it is given, and owns its copies.

    Args:
        path: the file to write; it must not exist yet.
        mode: "light" keeps the thinking windows' spikes, "full" every spike; both keep poses at 20 Hz.
        grid: the floor.
        clock: the run's periods.
        model: the compiled `mujoco.MjModel` to draw.
        run_id: the recording's identity; a resumed run's next part carries the same one.
        protocol: where the robot starts.
        ceiling_hits_per_1000: what the hits are drawn against.
        weight_max: upper end of the weights' colour scale.
        first_decision: the first one that the file will hold, counted over the run: above 1 for a later part.
        metadata: anything else that a reader of the file alone should know, such as the seed.

    Raises:
        SclaError: the file exists already or cannot be written, or the mode records nothing.
    """

    def __init__(
        self,
        path: Path,
        *,
        mode: Telemetry,
        grid: Grid,
        clock: Clock,
        model: Any,
        run_id: str,
        protocol: StartProtocol,
        ceiling_hits_per_1000: float,
        weight_max: float,
        first_decision: int = 1,
        metadata: Mapping[str, str | float] | None = None,
    ) -> None:
        if mode == "off":
            raise SclaError("--telemetry off records nothing: choose light or full to record")
        self._path = Path(path)
        self._grid = grid
        self._weight_max = weight_max
        self._ceiling = ceiling_hits_per_1000
        self._first_target = grid.target
        self._stream = _open(path, run_id, build_blueprint(mode, grid, clock, self._ceiling, weight_max))
        self._robot = log_scene(self._stream, model, grid)
        log_styles(self._stream, protocol, raster_layout(mode, clock))
        known = _properties(mode, grid, clock, protocol, self._ceiling) | {names.FIRST_DECISION: first_decision}
        self._stream.send_property(names.PROPERTIES, rr.AnyValues(**known, **(metadata or {})))
        self._stream.log(names.ABOUT, describe(mode, grid, protocol, self._ceiling), static=True)
        # Columns overtake what is logged row by row: a file cut short must hold at least what it is about.
        self._flush()
        stride = max(1, round(POSE_PERIOD_S / clock.control_period_s))
        self._buffer = Buffer(mode=mode, clock=clock, pose_stride=stride)
        self._recent: deque[bool] = deque(maxlen=_RECENT)
        self._decision = first_decision - 1
        self._last: _Last | None = None
        self._draws_ceiling = True
        self._remembered: dict[str, int] = {}
        self._growth, self._earlier = Growth(self._path), list[dict[str, Any]]()
        self._closed = False

    def move_target(self, grid: Grid, *, ceiling_hits_per_1000: float) -> None:
        """Draw the target where `grid` has it from now on, and the hits against its ceiling."""
        old, new = self._grid.centre_m(self._first_target), grid.centre_m(grid.target)
        self._say(f"the target jumps to cell ({grid.target.x}, {grid.target.y})", rr.TextLogLevel.WARN)
        self._stream.log(names.TARGET, rr.Transform3D(translation=(new[0] - old[0], new[1] - old[1], 0.0)))
        self._grid, self._ceiling, self._draws_ceiling = grid, ceiling_hits_per_1000, True

    def write(self, record: DecisionRecord, snapshot: Snapshot | None = None) -> None:
        """Record one decision, and the brain's memory after it if a snapshot is given."""
        self._decision += 1
        if self._draws_ceiling:
            set_time(self._stream, record.time_s, self._decision, record.epoch)
            self._stream.log(names.CEILING, rr.Scalars(self._ceiling))
            self._draws_ceiling = False
        self._last = _Last(record.epoch, end_time_s(record.move.trajectory, record.time_s))
        self._recent.append(record.hit)
        self._buffer.add(record, self._decision, 1000 * sum(self._recent) / len(self._recent))
        if record.move.outcome is Outcome.FAILED:
            x, y = record.move.before
            self._say(f"the move {record.chosen.action.label} from cell ({x}, {y}) failed", rr.TextLogLevel.WARN)
        if snapshot is not None:
            self._keep(snapshot)
        if len(self._buffer.decisions) >= _DECISIONS_A_FLUSH or len(self._buffer.spike_step) >= _SPIKES_A_FLUSH:
            self._send()

    def end_epoch(self, *, hits: int, decisions: int) -> None:
        """Record what the epoch of the last decision earned: `hits` in all its `decisions`."""
        assert self._last is not None
        hits_per_1000 = 1000 * hits / decisions
        self._set_time()
        self._stream.log(names.EPOCH_HITS, rr.Scalars(hits_per_1000))
        self._stream.log(names.CEILING, rr.Scalars(self._ceiling))
        share = 100 * hits_per_1000 / self._ceiling
        text = f"epoch {self._last.epoch}: {hits} hits in {decisions} decisions, {share:.1f} % of the ceiling"
        self._say(text, rr.TextLogLevel.INFO)

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
        """Return everything that `restore` needs for another recorder to go on from here."""
        return {
            "last": None if self._last is None else self._last._asdict(),
            "remembered": dict(self._remembered),
            "recent": list(self._recent),
            "target": list(self._grid.target),
            "ceiling": self._ceiling,
            "strip": self._buffer.strip.state(),
            "parts": [*self._earlier, self._growth.state()],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue where another recorder was when `state` was taken."""
        self._grid = dataclasses.replace(self._grid, target=Cell(*state["target"]))
        self._ceiling, self._draws_ceiling = state["ceiling"], False
        self._last = None if state["last"] is None else _Last(**state["last"])
        self._remembered = dict(state["remembered"])
        self._recent.extend(state["recent"])
        self._buffer.strip.restore(state["strip"])
        self._earlier = list(state["parts"])

    def close(self, snapshot: Snapshot | None = None, *, stopped: bool = False) -> None:
        """Send what is left, the brain's last memory if given, and finish the file; a second call does nothing.

        `stopped` says that the run may yet be resumed.
        """
        if self._closed:
            return
        self._closed = True
        try:
            self._end(snapshot, stopped=stopped)
        finally:
            self._stream.disconnect()

    def _end(self, snapshot: Snapshot | None, *, stopped: bool) -> None:
        if stopped and self._last is not None:
            self._say(f"stopped after {self._decision} decisions", rr.TextLogLevel.WARN)
        if snapshot is not None:
            self._keep(snapshot)
        self._send()
        self._flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _keep(self, snapshot: Snapshot) -> None:
        """Log a memory, each part once a decision: nothing learns between a decision's end and the run's."""
        known = [part for part, decision in self._remembered.items() if decision == self._decision]
        fresh = snapshot._replace(**dict.fromkeys(known))
        parts = [part for part, values in fresh._asdict().items() if values is not None]
        self._remembered |= dict.fromkeys(parts, self._decision)
        if parts:
            self._set_time()
            log_snapshot(self._stream, fresh, self._grid, self._weight_max)

    def _say(self, text: str, level: str) -> None:
        self._set_time()
        self._stream.log(names.LOG, rr.TextLog(text, level=level))

    def _send(self) -> None:
        """Hand the buffer to Rerun, whose threads wait for ever once a disk is full: so only while there is room."""
        decisions, spikes = len(self._buffer.decisions), len(self._buffer.spike_step)
        wanted_bytes = _ROOM_BYTES + _DECISION_BYTES * decisions + _SPIKE_BYTES * spikes
        try:
            free_bytes = shutil.disk_usage(self._path.parent).free
        except OSError as error:
            raise _cannot_write(self._path, error.strerror or error) from error
        if free_bytes < wanted_bytes:
            raise _cannot_write(
                self._path, f"{free_bytes / 1e6:.1f} MB are free, {wanted_bytes / 1e6:.1f} MB are wanted"
            )
        send_buffer(self._stream, self._buffer, self._robot)

    def _flush(self) -> None:
        try:
            self._stream.flush(timeout_sec=_FLUSH_AT_MOST_S)
        except Exception as error:  # the writing thread has ended: the disk is full, or the file has gone
            raise _cannot_write(self._path, error) from error

    def _set_time(self) -> None:
        """Set the stream's time to the end of the last decision, or to the run's start."""
        last = self._last
        if last is None:
            set_time(self._stream, 0.0, 0, 1)
        else:
            set_time(self._stream, last.end_s, self._decision, last.epoch)


def _open(path: Path, run_id: str, blueprint: Any) -> rr.RecordingStream:
    """Open the file. A live view is one more sink here: a `GrpcServerSink` on loopback never stalls a run."""
    if path.exists():
        raise SclaError(f"the recording {path} exists already: choose another run folder")
    _check_room(path)
    stream = rr.RecordingStream(names.APPLICATION, recording_id=run_id)
    stream.set_log_time_enabled(False)
    stream.set_log_tick_enabled(False)
    try:
        stream.set_sinks(rr.FileSink(path), default_blueprint=blueprint)
    except Exception as error:
        raise _cannot_write(path, error) from error
    return stream


def _check_room(path: Path) -> None:
    scratch = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        scratch.write_bytes(bytes(_ROOM_BYTES))
    except OSError as error:
        raise _cannot_write(path, error.strerror or error) from error
    finally:
        scratch.unlink(missing_ok=True)


def _cannot_write(path: Path, reason: object) -> SclaError:
    return SclaError(f"the recording {path} cannot be written: {reason}; free the disk or choose another RUN")


def _properties(
    mode: Telemetry, grid: Grid, clock: Clock, protocol: StartProtocol, ceiling: float
) -> dict[str, str | float | list[int]]:
    return {
        "format": names.FORMAT,
        "telemetry": mode,
        "protocol": protocol,
        "ceiling_hits_per_1000": ceiling,
        "cells": list(grid.cells),
        "target": list(grid.target),
        "cell_size_m": grid.cell_size_m,
        "neural_step_ms": clock.neural_step_ms,
        "thinking_window_s": clock.thinking_window_s,
    }
