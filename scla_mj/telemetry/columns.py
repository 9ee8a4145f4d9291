"""Sends a buffer as columns: one call an entity for some 500 decisions, spikes first and hits last.

In that order a file that was cut short never counts a decision whose spikes are missing.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from scla_mj.anatomy import POPULATION_NAMES, POPULATIONS, PROJECTION_NAMES
from scla_mj.signals import Outcome
from scla_mj.telemetry import names
from scla_mj.telemetry.buffer import ActivityRow, Buffer, DecisionRow
from scla_mj.telemetry.palette import HIT_COLOR, TRAIL_COLORS
from scla_mj.telemetry.poses import Poses, poses_of
from scla_mj.telemetry.scene import RobotEntities
from scla_mj.telemetry.spikes import build_block
from scla_mj.telemetry.timelines import time_columns

OUTCOME_CODES = {outcome: code for code, outcome in enumerate(Outcome)}
_SIZES = np.array([population.size for population in POPULATIONS])
_TRAIL_HEIGHT_M = 0.006


def send_buffer(stream: rr.RecordingStream, buffer: Buffer, robot: RobotEntities) -> None:
    """Send everything that waits, and clear the buffer."""
    if not buffer.rows:
        return
    moved = [row for row in buffer.rows if len(row.trajectory)]
    poses = poses_of(np.concatenate([row.trajectory for row in moved])) if moved else None
    if buffer.active:
        _send_spikes(stream, buffer)
        _send_scroll(stream, buffer)
        _send_brain(stream, buffer)
    if poses is not None:
        _send_poses(stream, moved, poses, robot)
        _send_trail(stream, moved, poses)
    _send_decisions(stream, buffer.rows)
    buffer.clear()


def _index(rows: list[DecisionRow], time_s: list[float]) -> list[rr.TimeColumn]:
    return time_columns(time_s, np.array([row.decision for row in rows]), np.array([row.epoch for row in rows]))


def _send_scalars(stream: rr.RecordingStream, entity: str, index: list[rr.TimeColumn], values: Any) -> None:
    stream.send_columns(entity, index, rr.Scalars.columns(scalars=np.asarray(values, np.float64)))


def _send_spikes(stream: rr.RecordingStream, buffer: Buffer) -> None:
    """A row a decision and population, at the time when the thinking window opened."""
    rows, kept = [row for row, _ in buffer.active], [activity for _, activity in buffer.active]
    origins_ms = np.array([activity.origin_ms for activity in kept])
    counts = np.array([activity.kept_counts for activity in kept]).T
    block = build_block(
        [activity.steps for activity in kept],
        [activity.neurons for activity in kept],
        counts,
        origins_ms,
        buffer.clock.neural_step_ms,
    )
    index = _index(rows, [row.start_s for row in rows])
    half_ms = buffer.clock.thinking_steps * buffer.clock.neural_step_ms / 2
    centres = np.column_stack([origins_ms + half_ms, np.full(len(rows), _SIZES.sum() / 2)])
    half_sizes = np.tile([half_ms, _SIZES.sum() / 2], (len(rows), 1))
    boxes = rr.Boxes2D.columns(half_sizes=half_sizes, centers=centres, colors=[_color(row) for row in rows])
    stream.send_columns(names.WINDOWS, index, boxes)
    for number, name in enumerate(POPULATION_NAMES):
        points = rr.Points2D.columns(positions=block.of(number)).partition(counts[number])
        stream.send_columns(f"{names.SPIKES}/{name}", index, points)


def _send_scroll(stream: rr.RecordingStream, buffer: Buffer) -> None:
    """Move the raster so that now is x = 0: once a window in a light recording, with every pose in a full one."""
    rows = [row for row, _ in buffer.active]
    if buffer.mode == "light":
        window_ms = buffer.clock.thinking_steps * buffer.clock.neural_step_ms
        index = _index(rows, [row.start_s for row in rows])
        now_ms = np.array([activity.origin_ms + window_ms for _, activity in buffer.active])
    else:
        counts = [len(row.trajectory) for row in rows]
        times = np.concatenate([row.trajectory[:, 0] for row in rows])
        starts = np.repeat([row.start_s for row in rows], counts)
        origins = np.repeat([activity.origin_ms for _, activity in buffer.active], counts)
        index = _repeated_index(rows, counts, times)
        now_ms = origins + 1000 * (times - starts)
    translation = np.zeros((len(now_ms), 3), np.float32)
    translation[:, 0] = -now_ms
    if len(translation):
        stream.send_columns(names.SPIKES, index, rr.Transform3D.columns(translation=translation))


def _send_brain(stream: rr.RecordingStream, buffer: Buffer) -> None:
    """A value a decision, at its end: rates in Hz a neuron, mean weights, dopamine concentrations."""
    rows = [row for row, _ in buffer.active]
    index = _index(rows, [row.end_s for row in rows])
    step_s = buffer.clock.neural_step_ms / 1000

    def stacked(pick: Any) -> NDArray[np.float64]:
        return np.array([pick(activity) for _, activity in buffer.active], float)

    def thinking_hz(activity: ActivityRow) -> NDArray[np.float64]:
        return activity.thinking_counts / (_SIZES * buffer.clock.thinking_window_s)

    def whole_hz(activity: ActivityRow) -> NDArray[np.float64]:
        return activity.whole_counts / (_SIZES * max(activity.whole_steps, 1) * step_s)

    for parent, labels, values in (
        (names.RATES, POPULATION_NAMES, stacked(thinking_hz)),
        (names.RATES_WHOLE, POPULATION_NAMES, stacked(whole_hz)),
        (names.WEIGHTS, PROJECTION_NAMES, stacked(lambda activity: activity.mean_weights)),
        (names.DOPAMINE, PROJECTION_NAMES, stacked(lambda activity: activity.dopamine)),
    ):
        for number, label in enumerate(labels):
            _send_scalars(stream, f"{parent}/{label}", index, values[:, number])


def _repeated_index(rows: list[DecisionRow], counts: list[int], time_s: NDArray[np.float64]) -> list[rr.TimeColumn]:
    decision = np.repeat([row.decision for row in rows], counts)
    return time_columns(time_s, decision, np.repeat([row.epoch for row in rows], counts))


def _send_poses(stream: rr.RecordingStream, rows: list[DecisionRow], poses: Poses, robot: RobotEntities) -> None:
    index = _repeated_index(rows, [len(row.trajectory) for row in rows], poses.time_s)
    chassis = rr.Transform3D.columns(translation=poses.position_m, quaternion=poses.quaternion)
    stream.send_columns(robot.chassis, index, chassis)
    for entity, quaternion in ((robot.left_wheel, poses.left_wheel), (robot.right_wheel, poses.right_wheel)):
        stream.send_columns(entity, index, rr.Transform3D.columns(quaternion=quaternion))


def _send_trail(stream: rr.RecordingStream, rows: list[DecisionRow], poses: Poses) -> None:
    """One line strip a decision, on the floor, in the colour of how it ended."""
    floor = poses.position_m.copy()
    floor[:, 2] = _TRAIL_HEIGHT_M
    strips = np.split(floor, np.cumsum([len(row.trajectory) for row in rows])[:-1])
    trail = rr.LineStrips3D.columns(strips=strips, colors=[_color(row) for row in rows])
    stream.send_columns(names.TRAJECTORY, _index(rows, [row.start_s for row in rows]), trail)


def _color(row: DecisionRow) -> tuple[int, int, int]:
    return HIT_COLOR if row.hit else TRAIL_COLORS[row.outcome]


def _send_decisions(stream: rr.RecordingStream, rows: list[DecisionRow]) -> None:
    index = _index(rows, [row.end_s for row in rows])
    for entity, values in (
        (names.ROLLING_HITS, [row.rolling for row in rows]),
        (names.OUTCOME, [OUTCOME_CODES[row.outcome] for row in rows]),
        (names.DURATION_S, [row.duration_s for row in rows]),
        (names.POSITION_ERROR_M, [row.position_error_m for row in rows]),
        (names.HIT, [row.hit for row in rows]),
    ):
        _send_scalars(stream, entity, index, values)
