"""What a recording alone says about its run: one pass over its parts, in memory that does not grow with them."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import POPULATIONS, PROJECTION_NAMES
from scla_mj.errors import SclaError
from scla_mj.signals import Outcome
from scla_mj.telemetry import names
from scla_mj.telemetry.reading.chunks import Chunk, faults_named
from scla_mj.telemetry.reading.recording_parts import Part, open_parts
from scla_mj.telemetry.views.base import EpochCount

_SCALARS: Final = "Scalars:scalars"
_POINTS: Final = "Points2D:positions"
_TRANSLATION: Final = "Transform3D:translation"


class Jump(NamedTuple):
    """The cell of the target from an epoch on."""

    epoch: int
    target: tuple[int, int]


class PopulationActivity(NamedTuple):
    """A population's spikes and mean rate a neuron; over the whole run only if the recording is full."""

    name: str
    thinking_spikes: int
    thinking_rate_hz: float
    whole_spikes: int | None
    whole_rate_hz: float | None


class Inspection(NamedTuple):
    """A recording, summed up. `first_weights` and `last_weights` are mean weights after the first and last decision.

    `parts` are its files: a resumed run adds one. `properties` holds what was written once, such as protocol, seed and
    ceiling. `finished` is False for a killed run's recording. `max_position_error_m` leaves out robots that fell.
    `weights` is (8, 100, 100), `probabilities` (W, H, 4), each as last recorded, or None.
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
    weights: NDArray[Any] | None
    probabilities: NDArray[Any] | None
    jumps: tuple[Jump, ...]
    """Where the target went, in order."""

    @property
    def decisions(self) -> int:
        """Decisions of all epochs."""
        return sum(epoch.decisions for epoch in self.epochs)

    def as_plain(self) -> dict[str, Any]:
        """Return all but the weights and probabilities as plain values, which JSON can hold."""
        plain = self._asdict() | {
            "parts": [str(part) for part in self.parts],
            "epochs": [epoch._asdict() for epoch in self.epochs],
            "outcomes": {outcome.value: number for outcome, number in self.outcomes.items()},
            "populations": [population._asdict() for population in self.populations],
            "jumps": [jump._asdict() for jump in self.jumps],
        }
        return {name: value for name, value in plain.items() if name not in ("weights", "probabilities")}


def inspect_recording(*parts: Path) -> Inspection:
    """Read a recording, and nothing else: its one file or, of a resumed run, its parts in their order.

    A decision that a part made again, after the run before it was cut off, counts once.

    Raises:
        SclaError: a file is missing, empty, no recording of ours, of a newer layout, of another run, or damaged.
    """
    with open_parts(*parts) as opened:
        first, last = opened[0], opened[-1]
        mode = str(first.properties["telemetry"])
        gathered = _Gathered()
        for part in opened:
            with faults_named(part.file.path):
                gathered.open_part(_window_ends(part) if mode == "full" else None)
                for chunk in part.chunks(_CONTENT):
                    gathered.take(chunk)
        with faults_named(first.file.path):
            if last.file.finished:
                gathered.check(first.file.path)
            return gathered.inspection(opened, mode)


_CONTENT: Final = [
    *(f"/{parent}/**" for parent in (names.SPIKES, names.WEIGHTS, names.WEIGHT_MATRIX)),
    *(f"/{path}" for path in (names.HIT, names.OUTCOME, names.POSITION_ERROR_M, names.ROBOT, names.PROBABILITIES)),
    *(f"/{path}" for path in (names.CEILING, names.TARGET)),
]


def _window_ends(part: Part) -> dict[int, float]:
    """Return where along the raster every decision's thinking window ends."""
    ends: dict[int, float] = {}
    half_ms = 1000 * part.properties["thinking_window_s"] / 2
    for chunk in part.chunks([f"/{names.WINDOWS}"]):
        if chunk.has("Boxes2D:centers"):
            centres = chunk.values("Boxes2D:centers")[:, 0].astype(float)
            ends.update(zip(chunk.decision.tolist(), (centres + half_ms).tolist(), strict=True))
    return ends


class _Gathered:
    """The sums over chunks."""

    def __init__(self) -> None:
        self._window_ends: dict[int, float] | None = None
        self._epochs: dict[int, tuple[int, int]] = {}
        self._outcomes = dict.fromkeys(Outcome, 0)
        self._max_error_m = 0.0
        self._first_decision, self._last_decision = 2**63, 0
        self._end_s, self._path_m, self._poses = 0.0, 0.0, 0
        self._spikes = {population.name: [0, 0, 0] for population in POPULATIONS}
        self._weights: dict[str, tuple[tuple[int, float], tuple[int, float]]] = {}
        self._tensors: dict[str, tuple[int, NDArray[Any]]] = {}
        self._ceilings: dict[int, float] = {}
        self._offsets: dict[int, tuple[int, NDArray[np.float64]]] = {}

    def open_part(self, window_ends: dict[int, float] | None) -> None:
        """Begin with a file; `window_ends` is given for a full recording, whose spikes are not all of thinking."""
        self._window_ends = window_ends

    def take(self, chunk: Chunk) -> None:
        """Add one chunk to the sums of its entity."""
        parent, _, name = chunk.entity.rpartition("/")
        if parent == names.SPIKES and name in self._spikes and chunk.has(_POINTS):
            self._take_spikes(name, chunk)
        elif parent == names.WEIGHTS and chunk.has(_SCALARS):
            self._take_weights(name, chunk)
        elif chunk.has("Tensor:data"):
            self._take_tensor(chunk)
        elif chunk.entity == names.ROBOT and chunk.has(_TRANSLATION):
            self._take_poses(chunk)
        elif chunk.entity == names.TARGET and chunk.has(_TRANSLATION) and chunk.has(names.DECISION):
            offsets_m = chunk.values(_TRANSLATION).astype(float)
            rows = zip(chunk.decision.tolist(), chunk.epoch.tolist(), offsets_m, strict=True)
            self._offsets |= {decision: (epoch, offset_m) for decision, epoch, offset_m in rows}
        elif chunk.entity == names.CEILING and chunk.has(_SCALARS):
            self._ceilings.update(zip(chunk.epoch.tolist(), chunk.values(_SCALARS).tolist(), strict=True))
        elif chunk.entity == names.HIT:
            self._take_hits(chunk)
        elif chunk.entity == names.OUTCOME:
            codes = np.bincount(chunk.values(_SCALARS).astype(int), minlength=len(Outcome))
            for outcome, code in names.OUTCOME_CODES.items():
                self._outcomes[outcome] += int(codes[code])
        elif chunk.entity == names.POSITION_ERROR_M:
            self._max_error_m = float(np.fmax.reduce(np.abs(chunk.values(_SCALARS)), initial=self._max_error_m))

    def check(self, path: Path) -> None:
        """Refuse a closed recording in which decisions are missing."""
        decisions = sum(count for count, _ in self._epochs.values())
        expected = max(0, self._last_decision - self._first_decision + 1)
        if decisions != expected or sum(self._outcomes.values()) != decisions:
            raise SclaError(f"the recording {path} is damaged: it holds {decisions} of {expected} decisions")

    def inspection(self, parts: list[Part], mode: str) -> Inspection:
        """Return the sums."""
        properties = parts[0].properties
        matrices = [self._tensors.get(f"{names.WEIGHT_MATRIX}/{name}") for name in PROJECTION_NAMES]
        probabilities = self._tensors.get(names.PROBABILITIES)
        return Inspection(
            parts=tuple(part.file.path for part in parts),
            mode=mode,
            properties=properties,
            finished=parts[-1].file.finished,
            epochs=tuple(
                EpochCount(epoch, *self._epochs[epoch], self._ceiling(epoch, properties))
                for epoch in sorted(self._epochs)
            ),
            outcomes=self._outcomes,
            max_position_error_m=self._max_error_m,
            simulated_s=self._end_s,
            poses=self._poses,
            path_length_m=self._path_m,
            populations=tuple(self._population(number, properties) for number in range(len(POPULATIONS))),
            first_weights={name: first[1] for name, (first, _) in self._weights.items()},
            last_weights={name: last[1] for name, (_, last) in self._weights.items()},
            weights=None if None in matrices else np.stack([matrix[1] for matrix in matrices if matrix is not None]),
            probabilities=None if probabilities is None else probabilities[1],
            jumps=self._jumps(properties),
        )

    def _ceiling(self, epoch: int, properties: dict[str, Any]) -> float:
        """Return the ceiling of an epoch: it is logged where an epoch ends and where it changes."""
        known = [logged for logged in self._ceilings if logged <= epoch]
        return self._ceilings[max(known)] if known else float(properties["ceiling_hits_per_1000"])

    def _jumps(self, properties: dict[str, Any]) -> tuple[Jump, ...]:
        """Return the target's cells after the first: a jump is logged at the last decision before it."""
        (x, y), size_m = properties["target"], properties["cell_size_m"]
        return tuple(
            Jump(epoch + 1 if decision else epoch, (x + round(offset[0] / size_m), y + round(offset[1] / size_m)))
            for decision, (epoch, offset) in sorted(self._offsets.items())
        )

    def _population(self, number: int, properties: dict[str, Any]) -> PopulationActivity:
        population = POPULATIONS[number]
        decisions, thinking, whole = self._spikes[population.name]
        window_s = decisions * properties["thinking_window_s"]
        rate_hz = thinking / (population.size * window_s) if decisions else 0.0
        if self._window_ends is None:
            return PopulationActivity(population.name, thinking, rate_hz, None, None)
        whole_hz = whole / (population.size * self._end_s) if self._end_s else 0.0
        return PopulationActivity(population.name, thinking, rate_hz, whole, whole_hz)

    def _take_spikes(self, name: str, chunk: Chunk) -> None:
        lengths = chunk.lengths(_POINTS)
        thinking = int(lengths.sum())
        if self._window_ends is not None:
            ends = np.repeat([self._window_ends[decision] for decision in chunk.decision.tolist()], lengths)
            thinking = int(np.count_nonzero(chunk.values(_POINTS)[:, 0] < ends))
        sums = self._spikes[name]
        sums[0] += len(lengths)
        sums[1] += thinking
        sums[2] += int(lengths.sum())

    def _take_weights(self, name: str, chunk: Chunk) -> None:
        rows = list(zip(chunk.decision.tolist(), chunk.values(_SCALARS).tolist(), strict=True))
        first, last = min(rows), max(rows)
        if name in self._weights:
            first, last = min(first, self._weights[name][0]), max(last, self._weights[name][1])
        self._weights[name] = first, last

    def _take_tensor(self, chunk: Chunk) -> None:
        decision = int(chunk.decision[-1])
        if chunk.entity not in self._tensors or decision >= self._tensors[chunk.entity][0]:
            self._tensors[chunk.entity] = decision, chunk.last_tensor()

    def _take_poses(self, chunk: Chunk) -> None:
        """Add up the way within each decision: between two, the robot may have been put elsewhere."""
        position_m = chunk.values(_TRANSLATION).astype(float)
        within = np.diff(chunk.decision) == 0
        self._path_m += float(np.linalg.norm(np.diff(position_m, axis=0)[within], axis=1).sum())
        self._poses += len(position_m)

    def _take_hits(self, chunk: Chunk) -> None:
        hits, epochs, decisions = chunk.values(_SCALARS), chunk.epoch, chunk.decision
        for epoch in np.unique(epochs).tolist():
            here = epochs == epoch
            before = self._epochs.get(epoch, (0, 0))
            self._epochs[epoch] = before[0] + int(here.sum()), before[1] + int(hits[here].sum())
        self._first_decision = min(self._first_decision, int(decisions.min()))
        self._last_decision = max(self._last_decision, int(decisions.max()))
        self._end_s = max(self._end_s, float(chunk.time_s.max()))
