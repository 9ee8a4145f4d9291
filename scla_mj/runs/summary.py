"""`summary.json`: what a run earned, counted decision by decision in memory that does not grow with it."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from pathlib import Path

from scla_mj.config import RunConfig
from scla_mj.grid import StartProtocol
from scla_mj.paths import SUMMARY_JSON
from scla_mj.runs.atomic import read_json, write_json
from scla_mj.runs.settings import settings_from_json
from scla_mj.signals import DecisionRecord, Outcome


@dataclass(frozen=True)
class EpochSummary:
    """What one epoch earned; `moves_per_hit` is None where nothing was hit."""

    epoch: int
    decisions: int
    hits: int
    hits_per_1000: float
    moves_per_hit: float | None
    percent_of_ceiling: float


@dataclass(frozen=True)
class Transitions:
    """How the commanded moves ended: `commanded` is the sum of the other three."""

    commanded: int = 0
    completed: int = 0
    blocked: int = 0
    failed: int = 0


@dataclass(frozen=True)
class Summary:
    """The whole of `summary.json`; `max_position_error_m` is None if a pose was not finite."""

    protocol: StartProtocol
    seed: int
    cells: tuple[int, int]
    target: tuple[int, int]
    ceiling_hits_per_1000: float
    epochs: tuple[EpochSummary, ...]
    transitions: Transitions
    max_position_error_m: float | None
    simulated_s: float
    wall_s: float


def epoch_summary(epoch: int, decisions: int, hits: int, ceiling_hits_per_1000: float) -> EpochSummary:
    """Return an epoch's figures from its counts; `decisions` is at least 1."""
    hits_per_1000 = 1000.0 * hits / decisions
    return EpochSummary(
        epoch=epoch,
        decisions=decisions,
        hits=hits,
        hits_per_1000=hits_per_1000,
        moves_per_hit=decisions / hits if hits else None,
        percent_of_ceiling=100.0 * hits_per_1000 / ceiling_hits_per_1000,
    )


class Tally:
    """Counts a run's decisions; `summary()` may be asked for at any time."""

    def __init__(self, config: RunConfig) -> None:
        self._config = config
        self._ceiling = config.build_grid().ceiling_hits_per_1000(config.protocol)
        self._counts: dict[int, tuple[int, int]] = {}
        self._outcomes = dict.fromkeys(Outcome, 0)
        self._max_error_m = 0.0

    def add(self, record: DecisionRecord) -> None:
        """Count one decision."""
        decisions, hits = self._counts.get(record.epoch, (0, 0))
        self._counts[record.epoch] = (decisions + 1, hits + bool(record.hit))
        self._outcomes[record.move.outcome] += 1
        error_m = abs(record.move.position_error_m)
        # A NaN stays: max() keeps the first of two that do not compare.
        self._max_error_m = error_m if math.isnan(error_m) else max(self._max_error_m, error_m)

    def epoch(self, epoch: int) -> EpochSummary:
        """Return the figures so far of an epoch that has at least one decision."""
        return epoch_summary(epoch, *self._counts[epoch], self._ceiling)

    def summary(self, *, simulated_s: float, wall_s: float) -> Summary:
        """Return the figures so far, with the times that the caller's clocks show."""
        config, outcomes = self._config, self._outcomes
        return Summary(
            protocol=config.protocol,
            seed=config.seed,
            cells=config.grid.cells,
            target=config.grid.target,
            ceiling_hits_per_1000=self._ceiling,
            epochs=tuple(self.epoch(epoch) for epoch in sorted(self._counts)),
            transitions=Transitions(
                commanded=sum(outcomes.values()),
                completed=outcomes[Outcome.MOVED],
                blocked=outcomes[Outcome.BLOCKED],
                failed=outcomes[Outcome.FAILED],
            ),
            max_position_error_m=self._max_error_m if math.isfinite(self._max_error_m) else None,
            simulated_s=simulated_s,
            wall_s=wall_s,
        )


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
    return settings_from_json(Summary, read_json(path), str(path))
