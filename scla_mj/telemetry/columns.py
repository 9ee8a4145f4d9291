"""Sends a buffer as columns: one call an entity for some 1000 decisions, spikes first and hits last.

In that order a file that was cut short never counts a decision whose spikes are missing.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pyarrow as pa
import rerun as rr
from numpy.typing import NDArray

from scla_mj.anatomy import POPULATION_NAMES, POPULATIONS, PROJECTION_NAMES
from scla_mj.clock import Clock
from scla_mj.telemetry import names
from scla_mj.telemetry.buffer import OUTCOME_CODES, Buffer
from scla_mj.telemetry.palette import HIT_COLOR, TRAIL_COLORS
from scla_mj.telemetry.poses import Poses, poses_of
from scla_mj.telemetry.scene import RobotEntities
from scla_mj.telemetry.spikes import build_block
from scla_mj.telemetry.timelines import time_columns

_SIZES = np.array([population.size for population in POPULATIONS])
_TRAIL_HEIGHT_M = 0.006
_OUTCOME_COLORS = np.array([TRAIL_COLORS[outcome] for outcome in OUTCOME_CODES], np.uint8)
_STRIP = rr.components.LineStrip3DBatch([]).as_arrow_array().type
Rows = NDArray[np.void]
"""Rows of the buffer's tables, DECISION or THOUGHT."""


def send_buffer(stream: rr.RecordingStream, buffer: Buffer, robot: RobotEntities) -> None:
    """Send everything that waits, and clear the buffer."""
    if not len(buffer.decisions):
        return
    # Copies: Rerun may go on reading what it was given.
    decisions, thoughts = buffer.decisions.rows.copy(), buffer.thoughts.rows.copy()
    poses = poses_of(buffer.poses.rows) if len(buffer.poses) else None
    if len(thoughts):
        thinking = decisions[thoughts["row"]]
        _send_spikes(stream, buffer, thinking, thoughts)
        if buffer.mode == "light":
            _scroll_by_window(stream, buffer.clock, thinking, thoughts)
        elif poses is not None:
            _scroll_by_pose(stream, decisions, thoughts, poses)
        _send_brain(stream, buffer.clock, thinking, thoughts)
    if poses is not None:
        _send_poses(stream, decisions, poses, robot)
        _send_trail(stream, decisions, poses)
    _send_decisions(stream, decisions)
    buffer.clear()


def _index(rows: Rows, time: str) -> list[rr.TimeColumn]:
    return time_columns(rows[time], rows["decision"], rows["epoch"])


def _pose_index(rows: Rows, time_s: NDArray[np.float64]) -> list[rr.TimeColumn]:
    return time_columns(time_s, np.repeat(rows["decision"], rows["poses"]), np.repeat(rows["epoch"], rows["poses"]))


def _send_scalars(stream: rr.RecordingStream, entity: str, index: list[rr.TimeColumn], values: Any) -> None:
    stream.send_columns(entity, index, rr.Scalars.columns(scalars=np.ascontiguousarray(values, np.float64)))


def _send_spikes(stream: rr.RecordingStream, buffer: Buffer, rows: Rows, thoughts: Rows) -> None:
    """A row a decision and population, at the time when the thinking window opened."""
    clock, origins_ms = buffer.clock, thoughts["origin_ms"]
    counts = thoughts["thinking_counts" if buffer.mode == "light" else "whole_counts"].T
    step, neuron = buffer.spike_step.rows, buffer.spike_neuron.rows
    block = build_block(step, neuron, counts, origins_ms, clock.neural_step_ms)
    index = _index(rows, "start_s")
    half_ms = clock.thinking_steps * clock.neural_step_ms / 2
    centres = np.column_stack([origins_ms + half_ms, np.full(len(rows), _SIZES.sum() / 2)])
    half_sizes = np.tile([half_ms, _SIZES.sum() / 2], (len(rows), 1))
    boxes = rr.Boxes2D.columns(half_sizes=half_sizes, centers=centres, colors=_colors(rows))
    stream.send_columns(names.WINDOWS, index, boxes)
    for number, name in enumerate(POPULATION_NAMES):
        points = rr.Points2D.columns(positions=block.of(number)).partition(counts[number])
        stream.send_columns(f"{names.SPIKES}/{name}", index, points)


def _scroll_by_window(stream: rr.RecordingStream, clock: Clock, rows: Rows, thoughts: Rows) -> None:
    """Move the raster once a decision, so that the end of its window is x = 0."""
    window_ms = clock.thinking_steps * clock.neural_step_ms
    _scroll(stream, _index(rows, "start_s"), thoughts["origin_ms"] + window_ms)


def _scroll_by_pose(stream: rr.RecordingStream, decisions: Rows, thoughts: Rows, poses: Poses) -> None:
    """Move the raster with every pose of a decision that has spikes, so that now is x = 0."""
    thinks = np.zeros(len(decisions), np.bool_)
    thinks[thoughts["row"]] = True
    rows, time_s = decisions[thinks], poses.time_s[np.repeat(thinks, decisions["poses"])]
    if len(time_s):
        origins_ms, starts_s = (np.repeat(column, rows["poses"]) for column in (thoughts["origin_ms"], rows["start_s"]))
        _scroll(stream, _pose_index(rows, time_s), origins_ms + 1000 * (time_s - starts_s))


def _scroll(stream: rr.RecordingStream, index: list[rr.TimeColumn], now_ms: NDArray[np.float64]) -> None:
    translation = np.zeros((len(now_ms), 3), np.float32)
    translation[:, 0] = -now_ms
    stream.send_columns(names.SPIKES, index, rr.Transform3D.columns(translation=translation))


def _send_brain(stream: rr.RecordingStream, clock: Clock, rows: Rows, thoughts: Rows) -> None:
    """A value a decision, at its end: rates in Hz a neuron, mean weights, dopamine concentrations."""
    index = _index(rows, "end_s")
    whole_steps = np.maximum(thoughts["whole_steps"], 1)[:, np.newaxis]
    for parent, labels, values in (
        (names.RATES, POPULATION_NAMES, thoughts["thinking_counts"] / (_SIZES * clock.thinking_window_s)),
        (
            names.RATES_WHOLE,
            POPULATION_NAMES,
            thoughts["whole_counts"] / (_SIZES * whole_steps * (clock.neural_step_ms / 1000)),
        ),
        (names.WEIGHTS, PROJECTION_NAMES, thoughts["mean_weights"]),
        (names.DOPAMINE, PROJECTION_NAMES, thoughts["dopamine"]),
    ):
        for number, label in enumerate(labels):
            _send_scalars(stream, f"{parent}/{label}", index, values[:, number])


def _send_poses(stream: rr.RecordingStream, rows: Rows, poses: Poses, robot: RobotEntities) -> None:
    index = _pose_index(rows, poses.time_s)
    chassis = rr.Transform3D.columns(translation=poses.position_m, quaternion=poses.quaternion)
    stream.send_columns(robot.chassis, index, chassis)
    for entity, quaternion in ((robot.left_wheel, poses.left_wheel), (robot.right_wheel, poses.right_wheel)):
        stream.send_columns(entity, index, rr.Transform3D.columns(quaternion=quaternion))


def _send_trail(stream: rr.RecordingStream, decisions: Rows, poses: Poses) -> None:
    """One line strip a decision that moved, on the floor, in the colour of how it ended."""
    rows = decisions[decisions["poses"] > 0]
    floor = poses.position_m.copy()
    floor[:, 2] = _TRAIL_HEIGHT_M
    trail = rr.LineStrips3D.columns(strips=_strips(floor, rows["poses"]), colors=_colors(rows))
    stream.send_columns(names.TRAJECTORY, _index(rows, "start_s"), trail)


def _strips(points: NDArray[np.float32], lengths: NDArray[np.int64]) -> Any:
    """Cut points, (n, 3), into line strips, as Arrow's list of them: Rerun turns any other into one strip by strip."""
    ends = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int32)
    vectors = rr.components.Position3DBatch(points).as_arrow_array()
    return pa.ListArray.from_arrays(pa.array(ends), vectors, type=_STRIP)


def _colors(rows: Rows) -> NDArray[np.uint8]:
    colors: NDArray[np.uint8] = _OUTCOME_COLORS[rows["outcome"]]
    colors[rows["hit"]] = HIT_COLOR
    return colors


def _send_decisions(stream: rr.RecordingStream, rows: Rows) -> None:
    index = _index(rows, "end_s")
    for entity, column in (
        (names.ROLLING_HITS, "rolling"),
        (names.OUTCOME, "outcome"),
        (names.DURATION_S, "duration_s"),
        (names.POSITION_ERROR_M, "position_error_m"),
        (names.HIT, "hit"),
    ):
        _send_scalars(stream, entity, index, rows[column])
