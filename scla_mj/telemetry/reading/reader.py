"""What a recording alone says about its run: one pass over its parts, in some hundred bytes per decision."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import Anatomy, Population
from scla_mj.errors import SclaError
from scla_mj.signals import Outcome
from scla_mj.telemetry import names
from scla_mj.telemetry.reading.chunks import Chunk, Rows, faults_named, join
from scla_mj.telemetry.reading.recording_parts import Part, open_parts
from scla_mj.telemetry.views.base import EpochCount


class Jump(NamedTuple):
    """The cell of the target from an epoch on."""

    epoch: int
    target: tuple[int, int]


class PopulationActivity(NamedTuple):
    """A population's spikes in so many decisions, and mean rate per neuron; over the whole run only if all are kept."""

    name: str
    decisions: int
    thinking_spikes: int
    thinking_rate_hz: float
    whole_spikes: int | None
    whole_rate_hz: float | None


class Inspection(NamedTuple):
    """A recording, summed up. `first_weights` and `last_weights` are mean weights after the first and last decision.

    `parts` are its files: a resumed run adds one. `properties` holds what was written once, such as protocol, seed and
    ceiling. `finished` is False for a killed run's recording. `max_position_error_m` leaves out robots that fell.
    `weights` has an array for each projection, {} if there are none, `probabilities` is (W, H, 4) or None, each as last
    recorded. `anatomy` is the brain's, None without neurons.
    """

    parts: tuple[Path, ...]
    mode: str
    properties: dict[str, Any]
    finished: bool
    epochs: tuple[EpochCount, ...]
    outcomes: dict[Outcome, int]
    max_position_error_m: float | None
    simulated_s: float
    poses: int
    path_length_m: float
    populations: tuple[PopulationActivity, ...]
    first_weights: dict[str, float]
    last_weights: dict[str, float]
    weights: dict[str, NDArray[Any]]
    probabilities: NDArray[Any] | None
    jumps: tuple[Jump, ...]
    """Where the target went, in order."""
    anatomy: Anatomy | None = None

    @property
    def decisions(self) -> int:
        """Decisions of all epochs."""
        return sum(epoch.decisions for epoch in self.epochs)


def inspect_recording(*parts: Path) -> Inspection:
    """Read a recording, and nothing else: its one file or, of a resumed run, its parts in their order.

    A decision that a part made again, after the run before it was cut off, counts once.

    Raises:
        SclaError: a file is missing, empty, no recording of ours, of a newer layout, of another run, or damaged.
    """
    with open_parts(*parts) as opened:
        gathered = _Gathered(opened)
        for part in opened:
            with faults_named(part.file.path):
                for chunk in part.chunks(_CONTENT):
                    gathered.take(chunk)
        with faults_named(opened[0].file.path):
            return gathered.inspection()


_CONTENT: Final = [
    *(f"/{parent}/**" for parent in (names.SPIKES, names.WEIGHTS, names.WEIGHT_MATRIX)),
    *(f"/{path}" for path in (names.HIT, names.OUTCOME, names.POSITION_ERROR_M, names.ROBOT, names.PROBABILITIES)),
    *(f"/{path}" for path in (names.CEILING, names.TARGET)),
]


class _Gathered:
    """Sums of what is long, spikes and poses; of the rest the rows themselves, some hundred bytes per decision."""

    def __init__(self, parts: list[Part]) -> None:
        self._parts, self._properties, self._anatomy = parts, parts[0].properties, parts[0].anatomy
        self._populations = () if self._anatomy is None else self._anatomy.populations
        self._projections = () if self._anatomy is None else self._anatomy.projection_names
        self._full = self._properties["telemetry"] == "full"
        self._path_m, self._poses = 0.0, 0
        self._window_ends: dict[int, float] = {}
        self._spikes = {population.name: [0, 0, 0] for population in self._populations}
        self._tensors: dict[str, Chunk] = {}
        self._chunks: defaultdict[str, list[Chunk]] = defaultdict(list)

    def take(self, chunk: Chunk) -> None:
        """Take what is read of one chunk."""
        if not chunk.has(names.DECISION):
            return
        if chunk.has(names.POINTS):
            self._take_spikes(chunk)
        elif chunk.entity == names.WINDOWS:  # sent before the spikes
            half_ms = 1000 * self._properties["thinking_window_s"] / 2
            ends = chunk.values(names.CENTRES)[:, 0].astype(float) + half_ms
            self._window_ends.update(zip(chunk.decision.tolist(), ends.tolist(), strict=True))
        elif chunk.entity == names.ROBOT:
            # Within each decision: between two, the robot may have been put elsewhere.
            steps_m = np.diff(chunk.values(names.TRANSLATION).astype(float), axis=0)[np.diff(chunk.decision) == 0]
            self._path_m += float(np.linalg.norm(steps_m, axis=1).sum())
            self._poses += len(chunk.rows)
        elif chunk.has("Tensor:data"):
            before = self._tensors.setdefault(chunk.entity, chunk)
            if chunk.decision[-1] >= before.decision[-1]:
                self._tensors[chunk.entity] = chunk
        elif chunk.has(names.SCALARS) or chunk.entity == names.TARGET:
            self._chunks[chunk.entity].append(chunk)

    def inspection(self) -> Inspection:
        """Return what was gathered.

        Raises:
            SclaError: decisions are missing from a closed recording.
        """
        hits = join(self._chunks[names.HIT], names.SCALARS)
        codes = join(self._chunks[names.OUTCOME], names.SCALARS).values
        errors_m = join(self._chunks[names.POSITION_ERROR_M], names.SCALARS).values
        curves = {name: self._chunks[f"{names.WEIGHTS}/{name}"] for name in self._projections}
        weights = {name: join(chunks, names.SCALARS).values for name, chunks in curves.items() if chunks}
        found = {name: self._tensor(f"{names.WEIGHT_MATRIX}/{name}") for name in self._projections}
        decisions, end_s = len(hits.decision), float(hits.time_s.max(initial=0.0))
        expected = int(np.ptp(hits.decision)) + 1 if decisions else 0
        finished, path = self._parts[-1].file.finished, self._parts[0].file.path
        if finished and not decisions == expected == len(codes):
            raise SclaError(f"the recording {path} is damaged: it holds {decisions} of {expected} decisions")
        return Inspection(
            parts=tuple(part.file.path for part in self._parts),
            mode=self._properties["telemetry"],
            properties=self._properties,
            finished=finished,
            epochs=self._epochs(hits),
            outcomes={outcome: int((codes == code).sum()) for outcome, code in names.OUTCOME_CODES.items()},
            max_position_error_m=float(np.fmax.reduce(np.abs(errors_m), initial=0.0)),
            simulated_s=end_s,
            poses=self._poses,
            path_length_m=self._path_m,
            populations=tuple(self._population(population, end_s) for population in self._populations),
            first_weights={name: float(means[0]) for name, means in weights.items()},
            last_weights={name: float(means[-1]) for name, means in weights.items()},
            weights={name: matrix for name, matrix in found.items() if matrix is not None},
            probabilities=self._tensor(names.PROBABILITIES),
            jumps=self._jumps(),
            anatomy=self._anatomy,
        )

    def _epochs(self, hits: Rows) -> tuple[EpochCount, ...]:
        """Count by epoch; a ceiling is logged where an epoch ends and where it changes."""
        logged = join(self._chunks[names.CEILING], names.SCALARS)
        counts = []
        for epoch in np.unique(hits.epoch).tolist():
            here, known = hits.values[hits.epoch == epoch], logged.values[logged.epoch <= epoch]
            ceiling = known[-1] if len(known) else self._properties["ceiling_hits_per_1000"]
            counts.append(EpochCount(epoch, len(here), int(here.sum()), float(ceiling)))
        return tuple(counts)

    def _jumps(self) -> tuple[Jump, ...]:
        """Return the target's cells after the first: a jump is logged at the last decision before it, maybe again."""
        rows, (x, y) = join(self._chunks[names.TARGET], names.TRANSLATION), self._properties["target"]
        offsets = np.rint(rows.values.reshape(-1, 3)[:, :2] / self._properties["cell_size_m"]).astype(int).tolist()
        epochs = rows.epoch + (rows.decision > 0)
        cells = {epoch: (x + dx, y + dy) for epoch, (dx, dy) in zip(epochs.tolist(), offsets, strict=True)}
        return tuple(Jump(*where) for where in cells.items())

    def _population(self, population: Population, end_s: float) -> PopulationActivity:
        decisions, thinking, whole = self._spikes[population.name]
        window_s = decisions * self._properties["thinking_window_s"]
        rate_hz = thinking / (population.size * window_s) if decisions else 0.0
        if not self._full:
            return PopulationActivity(population.name, decisions, thinking, rate_hz, None, None)
        whole_hz = whole / (population.size * end_s) if end_s else 0.0
        return PopulationActivity(population.name, decisions, thinking, rate_hz, whole, whole_hz)

    def _take_spikes(self, chunk: Chunk) -> None:
        lengths = chunk.lengths(names.POINTS)
        thinking = whole = int(lengths.sum())
        if self._full:
            ends = np.repeat([self._window_ends[decision] for decision in chunk.decision.tolist()], lengths)
            thinking = int(np.count_nonzero(chunk.values(names.POINTS)[:, 0] < ends))
        sums = self._spikes[chunk.entity.rpartition("/")[2]]
        sums[:] = sums[0] + len(lengths), sums[1] + thinking, sums[2] + whole

    def _tensor(self, entity: str) -> NDArray[Any] | None:
        return self._tensors[entity].last_tensor() if entity in self._tensors else None
