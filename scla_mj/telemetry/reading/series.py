"""Single decisions out of a recording: their spikes and poses; and the mean weights over the whole run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from scla_mj.errors import SclaError
from scla_mj.signals import WeightCurve
from scla_mj.telemetry import names
from scla_mj.telemetry.reading.chunks import Chunk, faults_named, join
from scla_mj.telemetry.reading.recording_parts import Part, open_parts

_NO_SPIKES: Final = (np.zeros(0, np.int64), np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0, "<U1"))
"""The decision of each and its start, where along the raster, its neuron and population."""


class DecisionSpikes(NamedTuple):
    """Spikes in the order of time, (n,) each: the run's time at the spike's neural step, the neuron, its population,
    and the decision that it belongs to."""

    time_s: NDArray[np.float64]
    neuron: NDArray[np.int64]
    population: NDArray[np.str_]
    decision: NDArray[np.int64]


class DecisionTrajectory(NamedTuple):
    """Poses of the chassis, n each: the run's time, position (n, 3), heading from +x towards +y, and decision."""

    time_s: NDArray[np.float64]
    position_m: NDArray[np.float64]
    heading_rad: NDArray[np.float64]
    decision: NDArray[np.int64]


class RecordedPoses(NamedTuple):
    """Where the robot's parts were, n instants: the run's time, the decision, the chassis' position (n, 3) and
    quaternion w x y z (n, 4), and how far each wheel is turned, (n,) by its body's name."""

    time_s: NDArray[np.float64]
    decision: NDArray[np.int64]
    position_m: NDArray[np.float64]
    quaternion: NDArray[np.float64]
    wheels_rad: dict[str, NDArray[np.float64]]


def decision_spikes(parts: Sequence[Path], decision: int | range | None = None) -> DecisionSpikes:
    """Return the spikes that a recording keeps of one decision, counted over the run from 1, of some, or of all (there
    may be none).

    Raises:
        SclaError: the recording is damaged, has no such decision, or that decision's brain has no neurons.
    """
    windows, found, step_ms = [np.zeros((0, 2))], [_NO_SPIKES], 1.0
    populations: tuple[str, ...] | None = None
    for part, chunk in _rows(parts, [f"/{names.SPIKES}/**"], decision):
        if populations is None:
            step_ms = float(part.properties["neural_step_ms"])
            populations = () if part.anatomy is None else part.anatomy.population_names
        name = chunk.entity.rpartition("/")[2]
        if chunk.entity == names.WINDOWS:
            origin_ms = chunk.values(names.CENTRES)[:, 0] - chunk.values(names.HALF_SIZES)[:, 0]
            windows.append(np.column_stack([chunk.decision, origin_ms]))
        elif name in populations and chunk.has(names.POINTS):
            points = chunk.values(names.POINTS).astype(float)
            of, started_s = (np.repeat(own, chunk.lengths(names.POINTS)) for own in (chunk.decision, chunk.time_s))
            found.append((of, started_s, *points.T, np.full(len(points), name)))
    begun = np.concatenate(windows)
    if decision is not None and not len(begun):
        raise _missing(parts, decision if isinstance(decision, int) else decision.start, "spikes")
    begun = begun[np.argsort(begun[:, 0], kind="stable")]
    of, started_s, at_ms, neuron, population = (np.concatenate(column) for column in zip(*found, strict=True))
    origin_ms = begun[np.searchsorted(begun[:, 0], of).clip(max=len(begun) - 1), 1]
    steps = np.rint((at_ms - origin_ms) / step_ms)
    order = np.lexsort((neuron, steps, of))
    time_s = (started_s + steps * (step_ms / 1000))[order]
    return DecisionSpikes(time_s, neuron[order].astype(np.int64), population[order], of[order].astype(np.int64))


def decision_trajectory(parts: Sequence[Path], decision: int | None = None) -> DecisionTrajectory:
    """Return the poses that a recording keeps of one decision, counted over the run from 1, or of all.

    Raises:
        SclaError: the recording is damaged or has no such decision.
    """
    found = [chunk for _, chunk in _rows(parts, [f"/{names.ROBOT}"], decision) if chunk.has(names.TRANSLATION)]
    if not found:
        raise _missing(parts, decision, "poses")
    x, y, z, w = _values(found, names.QUATERNION).T
    return DecisionTrajectory(
        np.concatenate([chunk.time_s for chunk in found]),
        _values(found, names.TRANSLATION),
        np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
        np.concatenate([chunk.decision for chunk in found]),
    )


def recorded_poses(parts: Sequence[Path], decisions: range) -> RecordedPoses:
    """Return the poses of some decisions, counted over the run from 1, with what a picture needs besides.

    Raises:
        SclaError: the recording is damaged or has none of these decisions.
    """
    found: dict[str, list[Chunk]] = {}
    for _, chunk in _rows(parts, [f"/{names.ROBOT}/**"], decisions):
        found.setdefault(chunk.entity, []).append(chunk)
    chassis = [chunk for chunk in found.pop(names.ROBOT, []) if chunk.has(names.TRANSLATION)]
    if not chassis:
        raise _missing(parts, decisions.start, "poses")
    wheels_rad = {}
    for entity, chunks in found.items():
        _, y, _, w = _values(chunks, names.QUATERNION).T
        wheels_rad[entity.removeprefix(f"{names.ROBOT}/").removesuffix(f"/{names.SPIN}")] = 2 * np.arctan2(y, w)
    return RecordedPoses(
        np.concatenate([chunk.time_s for chunk in chassis]),
        np.concatenate([chunk.decision for chunk in chassis]),
        _values(chassis, names.TRANSLATION),
        np.roll(_values(chassis, names.QUATERNION), 1, axis=1),
        wheels_rad,
    )


def _values(chunks: Sequence[Chunk], component: str) -> NDArray[np.float64]:
    return np.concatenate([chunk.values(component) for chunk in chunks]).astype(float)


def weight_curve(parts: Sequence[Path]) -> WeightCurve | None:
    """Return the mean weights after every recorded decision; None for a brain without synapses.

    Raises:
        SclaError: the recording is damaged.
    """
    chunks: dict[str, list[Chunk]] = {}
    for part, chunk in _chunks(parts, [f"/{names.WEIGHTS}/**"]):
        if not chunks and part.anatomy is not None:
            chunks = {name: [] for name in part.anatomy.projection_names}
        if chunk.has(names.SCALARS):
            chunks[chunk.entity.rpartition("/")[2]].append(chunk)
    if not chunks or not all(chunks.values()):
        return None
    rows = [join(found, names.SCALARS) for found in chunks.values()]
    return WeightCurve(rows[0].decision, rows[0].time_s, np.column_stack([means.values for means in rows]))


def _chunks(parts: Sequence[Path], content: list[str]) -> Iterator[tuple[Part, Chunk]]:
    """Yield the chunks of the entities that match, each with its part."""
    with open_parts(*parts) as opened:
        for part in opened:
            with faults_named(part.file.path):
                for chunk in part.chunks(content):
                    yield part, chunk


def _rows(parts: Sequence[Path], content: list[str], decision: int | range | None) -> Iterator[tuple[Part, Chunk]]:
    """Yield the rows of the entities that match: of one decision, of some, or of all."""
    wanted = range(decision, decision + 1) if isinstance(decision, int) else decision
    for part, chunk in _chunks(parts, content):
        if not chunk.has(names.DECISION):
            continue
        if wanted is None:
            yield part, chunk
        elif (here := (chunk.decision >= wanted.start) & (chunk.decision < wanted.stop)).any():
            yield part, chunk._replace(rows=chunk.rows.filter(pa.array(here)))


def _missing(parts: Sequence[Path], decision: int | None, what: str) -> SclaError:
    of = "any decision" if decision is None else f"decision {decision}"
    return SclaError(
        f"the recording {parts[0]} holds no {what} of {of}: the run was stopped or the file cut short before it, or "
        "its brain has none"
    )
