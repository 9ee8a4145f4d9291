"""`summary.json`: what a run earned, counted decision by decision in memory that does not grow with it."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scla_mj.checked import CheckedConfig
from scla_mj.grid import StartProtocol
from scla_mj.paths import SUMMARY_JSON
from scla_mj.runs.atomic import read_json, spelling, write_json
from scla_mj.signals import DecisionRecord, Localised, Outcome
from scla_mj.validation import Section, validated


@dataclass(frozen=True)
class EpochSummary(Section):
    """What one epoch earned, and the ceiling of its arena.

    `moves_per_hit` is None where nothing was hit; `mean_weights`, one per projection at the epoch's end (some decisions
    before, where it was cut short: see runs/history.py), is None for a brain without synapses.
    """

    epoch: int
    decisions: int
    hits: int
    hits_per_1000: float
    moves_per_hit: float | None
    percent_of_ceiling: float
    ceiling_hits_per_1000: float
    mean_weights: tuple[float, ...] | None


@dataclass(frozen=True)
class Transitions(Section):
    """How the commanded moves ended: `commanded` is the sum of the other three."""

    commanded: int = 0
    completed: int = 0
    blocked: int = 0
    failed: int = 0


@dataclass(frozen=True)
class LocalisationSummary(Section):
    """How far from the truth the robot believed to be when it decided, and how often it took its cell for another."""

    max_error_m: float
    mean_error_m: float
    wrong_cells: int


@dataclass(frozen=True)
class Summary(Section):
    """The whole of `summary.json`.

    `max_position_error_m` is the largest of the moves that ended on the wheels, failed ones among them; `localisation`
    is None where the robot knows its pose from the simulator.
    """

    protocol: StartProtocol
    seed: int
    cells: tuple[int, int]
    target: tuple[int, int]
    ceiling_hits_per_1000: float
    epochs: tuple[EpochSummary, ...]
    transitions: Transitions
    max_position_error_m: float
    simulated_s: float
    wall_s: float
    localisation: LocalisationSummary | None = None


def epoch_summary(
    epoch: int,
    decisions: int,
    hits: int,
    ceiling_hits_per_1000: float,
    mean_weights: tuple[float, ...] | None = None,
) -> EpochSummary:
    """Return an epoch's figures from its counts; `decisions` is at least 1."""
    hits_per_1000 = 1000.0 * hits / decisions
    return EpochSummary(
        epoch=epoch,
        decisions=decisions,
        hits=hits,
        hits_per_1000=hits_per_1000,
        moves_per_hit=decisions / hits if hits else None,
        percent_of_ceiling=100.0 * hits_per_1000 / ceiling_hits_per_1000,
        ceiling_hits_per_1000=ceiling_hits_per_1000,
        mean_weights=mean_weights,
    )


@dataclass
class _Count:
    """What is counted of one epoch while it is running."""

    ceiling_hits_per_1000: float
    decisions: int = 0
    hits: int = 0
    mean_weights: NDArray[np.float64] | None = None


@dataclass
class _Beliefs:
    """What is counted of a robot that finds its own place; errors in metres."""

    decisions: int = 0
    max_error_m: float = 0.0
    total_error_m: float = 0.0
    wrong_cells: int = 0

    def add(self, localised: Localised) -> None:
        self.decisions += 1
        self.max_error_m = max(self.max_error_m, localised.error_m)
        self.total_error_m += localised.error_m
        self.wrong_cells += not localised.right_cell

    def summary(self) -> LocalisationSummary | None:
        if not self.decisions:
            return None
        return LocalisationSummary(self.max_error_m, self.total_error_m / self.decisions, self.wrong_cells)


class Tally:
    """Counts a run's decisions; `summary()` may be called at any time."""

    def __init__(self, checked: CheckedConfig) -> None:
        self._checked = checked
        self._counts: dict[int, _Count] = {}
        self._outcomes = dict.fromkeys(Outcome, 0)
        self._max_error_m = 0.0
        self._beliefs = _Beliefs()

    def add(self, record: DecisionRecord) -> None:
        """Count one decision."""
        if record.epoch not in self._counts:
            self._counts[record.epoch] = _Count(self._checked.ceiling_hits_per_1000(record.epoch))
        count = self._counts[record.epoch]
        count.decisions += 1
        count.hits += bool(record.hit)
        if record.activity is not None:
            count.mean_weights = record.activity.mean_weights
        self._outcomes[record.move.outcome] += 1
        if math.isfinite(record.move.position_error_m):  # a robot that fell, a failed move, is nowhere
            self._max_error_m = max(self._max_error_m, abs(record.move.position_error_m))
        if record.localised is not None:
            self._beliefs.add(record.localised)

    @property
    def decisions(self) -> int:
        """Decisions counted so far."""
        return sum(self._outcomes.values())

    def epoch(self, epoch: int) -> EpochSummary:
        """Return the figures so far of an epoch that has at least one decision."""
        count = self._counts[epoch]
        means = None if count.mean_weights is None else tuple(count.mean_weights.tolist())
        return epoch_summary(epoch, count.decisions, count.hits, count.ceiling_hits_per_1000, means)

    def state(self) -> dict[str, Any]:
        """Return everything that `restore` needs to continue from here."""
        counts = {
            str(epoch): {"decisions": count.decisions, "hits": count.hits, "mean_weights": _listed(count.mean_weights)}
            for epoch, count in self._counts.items()
        }
        outcomes = {outcome.value: number for outcome, number in self._outcomes.items()}
        beliefs = asdict(self._beliefs)
        return {"counts": counts, "outcomes": outcomes, "max_error_m": self._max_error_m, "beliefs": beliefs}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a `state`."""
        self._counts = {}
        for epoch, count in state["counts"].items():
            means = count["mean_weights"]
            ceiling = self._checked.ceiling_hits_per_1000(int(epoch))
            self._counts[int(epoch)] = _Count(
                ceiling, count["decisions"], count["hits"], None if means is None else np.array(means)
            )
        self._outcomes = {outcome: state["outcomes"][outcome.value] for outcome in Outcome}
        self._max_error_m = state["max_error_m"]
        self._beliefs = _Beliefs(**state["beliefs"])

    def summary(self, *, simulated_s: float, wall_s: float) -> Summary:
        """Return the figures so far, with the times that the caller's clocks show."""
        config, outcomes = self._checked.config, self._outcomes
        return Summary(
            protocol=config.protocol,
            seed=config.seed,
            cells=config.grid.cells,
            target=config.grid.target,
            ceiling_hits_per_1000=self._checked.ceiling_hits_per_1000(),
            epochs=tuple(self.epoch(epoch) for epoch in sorted(self._counts)),
            transitions=Transitions(
                commanded=sum(outcomes.values()),
                completed=outcomes[Outcome.MOVED],
                blocked=outcomes[Outcome.BLOCKED],
                failed=outcomes[Outcome.FAILED],
            ),
            max_position_error_m=self._max_error_m,
            simulated_s=simulated_s,
            wall_s=wall_s,
            localisation=self._beliefs.summary(),
        )


def _listed(means: NDArray[np.float64] | None) -> list[float] | None:
    return None if means is None else means.tolist()


def write_summary(folder: Path, summary: Summary) -> None:
    """Write `summary.json`, whole or not at all.

    Raises:
        SclaError: the folder cannot be written to.
    """
    write_json(Path(folder) / SUMMARY_JSON, asdict(summary))


def read_summary(folder: Path) -> Summary:
    """Return what a run's `summary.json` holds.

    Raises:
        SclaError: the file is missing or damaged; the sentence names the key.
    """
    path = Path(folder) / SUMMARY_JSON
    return validated(Summary, read_json(path), spell=spelling(path), complete=True)
