"""`summary.json`: what a run earned, epoch by epoch and as a whole."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path

from scla_mj.config import RunConfig
from scla_mj.grid import StartProtocol
from scla_mj.paths import BRAIN_NPZ, CHECKPOINT_NPZ, DECISIONS_PARQUET, DECISIONS_PARTIAL, SUMMARY_JSON
from scla_mj.runs.atomic import read_json, spelling, write_json
from scla_mj.runs.seal import missing_files
from scla_mj.validation import Section, validated


@dataclass(frozen=True)
class EpochSummary(Section):
    """What one epoch earned, and the ceiling of its arena.

    `moves_nearer` counts the moves that came nearer to the target, `share_nearer` is their share of the decisions.
    `moves_beyond` are the moves that a shortest path would have saved: 1 for a move that came no nearer, 2 for one that
    went away; `regret_per_episode` is that over the hits. Both are of the true cells, and free of the luck of the draw
    that hits have. `moves_per_hit` and `regret_per_episode` are None where nothing was hit. `mean_weights`, one per
    projection at the epoch's end (some decisions before, where it was cut short: see runs/history.py), is None for a
    brain without synapses.
    """

    epoch: int
    decisions: int
    hits: int
    hits_per_1000: float
    moves_per_hit: float | None
    percent_of_ceiling: float
    ceiling_hits_per_1000: float
    moves_nearer: int
    share_nearer: float
    moves_beyond: int
    regret_per_episode: float | None
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

    `others` are targets beside the first. `ceiling_hits_per_1000` and `chance_hits_per_1000` are as it begins: what a
    shortest path earns, and a brain that has learned nothing (`scla_mj.markov`). `max_position_error_m` is the largest
    of the moves that ended on the wheels, failed ones among them. The wheels are crossed from `crossed_epoch` on, 0 for
    never; `localisation` is None where the robot knows its pose from the simulator.
    """

    brain: str
    protocol: StartProtocol
    seed: int
    cells: tuple[int, int]
    target: tuple[int, int]
    others: tuple[tuple[int, int], ...]
    crossed_epoch: int
    ceiling_hits_per_1000: float
    chance_hits_per_1000: float
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
    *,
    nearer: int,
    beyond: int,
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
        moves_nearer=nearer,
        share_nearer=nearer / decisions,
        moves_beyond=beyond,
        regret_per_episode=beyond / hits if hits else None,
        mean_weights=mean_weights,
    )


def is_summed_up(folder: Path, config: RunConfig) -> bool:
    """Tell whether a run's decisions are all summed up, its brain is written, and its checkpoint is gone.

    Raises:
        SclaError: its summary is damaged.
    """
    if (folder / CHECKPOINT_NPZ).exists() or not all((folder / name).exists() for name in (BRAIN_NPZ, SUMMARY_JSON)):
        return False
    return sum(epoch.decisions for epoch in read_summary(folder).epochs) >= config.epochs * config.decisions


def is_complete(folder: Path, config: RunConfig) -> bool:
    """Tell whether every decision was made and all of the run's end is on disk, every file that its seal lists too.

    Raises:
        SclaError: its summary or its seal is damaged.
    """
    closed = (folder / DECISIONS_PARQUET).exists() and not (folder / DECISIONS_PARTIAL).exists()
    return closed and is_summed_up(folder, config) and not missing_files(folder)


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
