"""Spikes as a scrolling raster: one point a spike, x the time along the raster in ms, y the neuron.

Points are the compact form (about 5 bytes a spike on disk) and a population's can be counted without looking at them.
The raster scrolls because their common parent entity moves left as time goes on. A light recording joins the thinking
windows into one strip; a full one runs with simulated time.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import NEURON_COUNT, POPULATIONS
from scla_mj.signals import Activity

_POPULATION_OF: Final = np.repeat(
    np.arange(len(POPULATIONS), dtype=np.uint8), [population.size for population in POPULATIONS]
)
assert len(_POPULATION_OF) == NEURON_COUNT
_STARTS: Final = np.array([population.start for population in POPULATIONS])

STRIP_LENGTH_MS: Final = 1_000_000.0
"""Where x starts again at 0: a float32 still tells a sixteenth of a millisecond there."""


class SpikeBlock(NamedTuple):
    """The kept spikes of some decisions: points (n, 2) ordered by population, and counts (populations, decisions)."""

    points: NDArray[np.float32]
    counts: NDArray[np.int64]

    def of(self, population: int) -> NDArray[np.float32]:
        """Return one population's points, decision after decision."""
        ends = np.cumsum(self.counts.sum(axis=1))
        return self.points[ends[population] - self.counts[population].sum() : ends[population]]


def count_by_population(activity: Activity) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return every population's spikes in the thinking window and in the whole decision."""
    if activity.counts is not None:
        return activity.counts[0], activity.counts[1]
    thinking = _counts(activity.spike_neuron[: activity.thinking_spikes])
    return thinking, thinking + _counts(activity.spike_neuron[activity.thinking_spikes :])


def _counts(neuron: NDArray[np.int32]) -> NDArray[np.int64]:
    """Count by neuron, then by population: half the time of looking every spike's population up."""
    counts: NDArray[np.int64] = np.add.reduceat(np.bincount(neuron, minlength=NEURON_COUNT), _STARTS)
    return counts


def build_block(
    steps: NDArray[np.int32],
    neurons: NDArray[np.int32],
    counts: NDArray[np.int64],
    origins_ms: NDArray[np.float64],
    neural_step_ms: float,
) -> SpikeBlock:
    """Order the spikes of several decisions by population, and place each decision at its origin along the raster.

    `steps` and `neurons` are decision after decision; `counts` are theirs, (populations, decisions).
    """
    # Stable, and a radix sort on one byte: within a population the spikes stay in the order of time.
    order = np.argsort(_POPULATION_OF[neurons], kind="stable")
    time_ms = steps * neural_step_ms
    time_ms += np.repeat(origins_ms, counts.sum(axis=0))
    points = np.empty((len(neurons), 2), np.float32)
    points[:, 0] = time_ms[order]
    points[:, 1] = neurons[order]
    return SpikeBlock(points, counts)


class Strip:
    """Where along the raster each decision lies; it starts again at 0 when it has grown to `STRIP_LENGTH_MS`."""

    def __init__(self, *, joins_windows: bool) -> None:
        self._joins_windows = joins_windows
        self._start_s: float | None = None
        self._next_ms = 0.0

    def place(self, time_s: float, length_ms: float) -> float:
        """Return the origin in ms of the decision that began at `time_s` and fills `length_ms` of the raster."""
        if self._start_s is None:
            self._start_s = time_s
        origin_ms = self._next_ms if self._joins_windows else 1000 * (time_s - self._start_s)
        if origin_ms + length_ms > STRIP_LENGTH_MS:
            origin_ms, self._start_s = 0.0, time_s
        self._next_ms = origin_ms + length_ms
        return origin_ms

    def state(self) -> dict[str, Any]:
        """Return everything that `restore` needs to go on from here."""
        return {"start_s": self._start_s, "next_ms": self._next_ms}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a `state`."""
        self._start_s, self._next_ms = state["start_s"], state["next_ms"]
