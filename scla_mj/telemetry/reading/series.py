"""Single decisions out of a recording: their spikes and poses; and the mean weights over the whole run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from scla_mj.anatomy import POPULATION_NAMES, PROJECTION_NAMES
from scla_mj.errors import SclaError
from scla_mj.signals import WeightCurve
from scla_mj.telemetry import names
from scla_mj.telemetry.reading.chunks import Chunk, faults_named, join
from scla_mj.telemetry.reading.recording_parts import Part, open_parts


class DecisionSpikes(NamedTuple):
    """Spikes in the order of time, (n,) each: the run's time at the spike's neural step, the neuron, its population."""

    time_s: NDArray[np.float64]
    neuron: NDArray[np.int64]
    population: NDArray[np.str_]


class DecisionTrajectory(NamedTuple):
    """Poses of the chassis: the run's time (n,), position (n, 3) and heading from +x towards +y (n,)."""

    time_s: NDArray[np.float64]
    position_m: NDArray[np.float64]
    heading_rad: NDArray[np.float64]


def decision_spikes(parts: Sequence[Path], decision: int) -> DecisionSpikes:
    """Return the spikes that a recording keeps of one decision, counted over the run from 1.

    Raises:
        SclaError: the recording is damaged, has no such decision, or is of a brain without neurons.
    """
    origin_ms = started_s = step_ms = None
    time_ms, neurons, labels = [], [], []
    for part, chunk in _rows(parts, [f"/{names.SPIKES}/**"], decision):
        step_ms = float(part.properties["neural_step_ms"])
        name = chunk.entity.rpartition("/")[2]
        if chunk.entity == names.WINDOWS:
            origin_ms = float(chunk.values(names.CENTRES)[0, 0] - chunk.values(names.HALF_SIZES)[0, 0])
            started_s = float(chunk.time_s[0])
        elif name in POPULATION_NAMES and chunk.has(names.POINTS):
            points = chunk.values(names.POINTS)
            time_ms.append(points[:, 0].astype(float))
            neurons.append(points[:, 1])
            labels.append(np.full(len(points), name))
    if origin_ms is None or started_s is None or step_ms is None:
        raise _missing(parts, decision, "spikes")
    steps = np.rint((np.concatenate([np.zeros(0), *time_ms]) - origin_ms) / step_ms)
    neuron = np.concatenate([np.zeros(0), *neurons]).astype(np.int64)
    order = np.lexsort((neuron, steps))
    population = np.concatenate([np.zeros(0, "<U2"), *labels])
    return DecisionSpikes(started_s + steps[order] * (step_ms / 1000), neuron[order], population[order])


def decision_trajectory(parts: Sequence[Path], decision: int) -> DecisionTrajectory:
    """Return the poses that a recording keeps of one decision, counted over the run from 1.

    Raises:
        SclaError: the recording is damaged or has no such decision.
    """
    found = [chunk for _, chunk in _rows(parts, [f"/{names.ROBOT}"], decision) if chunk.has(names.TRANSLATION)]
    if not found:
        raise _missing(parts, decision, "poses")
    x, y, z, w = np.concatenate([chunk.values(names.QUATERNION) for chunk in found]).astype(float).T
    return DecisionTrajectory(
        np.concatenate([chunk.time_s for chunk in found]),
        np.concatenate([chunk.values(names.TRANSLATION) for chunk in found]).astype(float),
        np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    )


def weight_curve(parts: Sequence[Path]) -> WeightCurve | None:
    """Return the mean weights after every recorded decision; None for a brain without synapses.

    Raises:
        SclaError: the recording is damaged.
    """
    chunks: dict[str, list[Chunk]] = {name: [] for name in PROJECTION_NAMES}
    for _, chunk in _chunks(parts, [f"/{names.WEIGHTS}/**"]):
        if chunk.has(names.SCALARS):
            chunks[chunk.entity.rpartition("/")[2]].append(chunk)
    if not all(chunks.values()):
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


def _rows(parts: Sequence[Path], content: list[str], decision: int) -> Iterator[tuple[Part, Chunk]]:
    """Yield one decision's rows of the entities that match."""
    for part, chunk in _chunks(parts, content):
        if chunk.has(names.DECISION) and (wanted := chunk.decision == decision).any():
            yield part, chunk._replace(rows=chunk.rows.filter(pa.array(wanted)))


def _missing(parts: Sequence[Path], decision: int, what: str) -> SclaError:
    return SclaError(
        f"the recording {parts[0]} holds no {what} of decision {decision}: the run was stopped or the file cut "
        "short before it, or its brain has none"
    )
