"""The small tables at the end of a rollout."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from rich.markup import escape
from rich.table import Table

from scla_mj import paths
from scla_mj.grid import said

if TYPE_CHECKING:
    from scla_mj.runs.summary import Summary

_WHAT: Final = {
    paths.CONFIG_JSON: "every setting, the seed, the package versions",
    paths.DECISIONS_PARQUET: "one row per decision",
    paths.SUMMARY_JSON: "hits, ceiling, chance, regret, transitions",
    paths.BRAIN_NPZ: "final weights and action probabilities",
    paths.LEARNING_PNG: "hits over the decisions against the ceiling",
    paths.WEIGHTS_PNG: "the mean weights over the decisions",
    paths.POLICY_PNG: "every cell's action probabilities",
    paths.RECORDING_RRD: "the recording for Rerun",
    paths.SEAL_JSON: "the SHA-256 of each of them",
}

_MOST_ROWS: Final = 24


def epoch_table(summary: Summary) -> Table:
    """Return what each epoch earned."""
    columns, rows = summary.cells
    table = Table(
        title=f"{summary.protocol}, {columns}x{rows}, {said((summary.target, *summary.others))}, seed {summary.seed}\n"
        f"ceiling {summary.ceiling_hits_per_1000:.2f}, chance {summary.chance_hits_per_1000:.2f} "
        "hits per 1000 decisions"
    )
    for name in ("epoch", "decisions", "hits", "moves per hit", "% of ceiling", "% nearer", "regret"):
        table.add_column(name, justify="right")
    for epoch in summary.epochs:
        moves, regret = (
            "-" if value is None else f"{value:.2f}" for value in (epoch.moves_per_hit, epoch.regret_per_episode)
        )
        table.add_row(
            str(epoch.epoch),
            str(epoch.decisions),
            str(epoch.hits),
            moves,
            f"{epoch.percent_of_ceiling:.1f}",
            f"{100 * epoch.share_nearer:.1f}",
            regret,
        )
    moved = summary.transitions
    error = "-" if summary.max_position_error_m is None else f"{1000 * summary.max_position_error_m:.2f} mm"
    table.caption = (
        f"{moved.commanded} moves: {moved.completed} completed, {moved.blocked} blocked, {moved.failed} failed\n"
        f"largest position error {error}; {summary.simulated_s:.0f} s simulated in {summary.wall_s:.0f} s"
    )
    found = summary.localisation
    if found is not None:
        table.caption += (
            f"\nbelieved place off by {1000 * found.mean_error_m:.1f} mm on average, {1000 * found.max_error_m:.0f} mm"
            f" at most; in the wrong cell at {found.wrong_cells} decisions"
        )
    return table


def sweep_table(file: Path) -> Table:
    """Return what each configuration of a sweep earned, as `sweep.parquet` has it: all of a few, of many the best."""
    import pyarrow.parquet as pq

    from scla_mj.experiments.sweeps.plan import text

    found = pq.read_table(file)
    rows, settings = found.to_pylist(), found.column_names[: found.column_names.index("folder")]
    varied = [name for name in settings if len({repr(row[name]) for row in rows}) > 1] or settings[:1]
    table = Table()
    if len(rows) > _MOST_ROWS:
        rows = sorted(rows, key=lambda row: -row["percent_of_ceiling"])[:_MOST_ROWS]
        table.title = f"the best {_MOST_ROWS} of {found.num_rows} configurations"
    for name in (*varied, "seeds", "hits per 1000", "% of ceiling"):
        table.add_column(name, justify="left" if name in varied else "right", no_wrap=name not in varied)
    for row in rows:
        last = [epochs[-1] for epochs in row["hits_per_1000_by_seed_and_epoch"]]
        mean, low, high = (row[f"percent_of_ceiling{end}"] for end in ("", "_low", "_high"))
        interval = "" if low is None else f" ({low:.1f} to {high:.1f})"
        earned = f"{sum(last) / len(last):.1f}", f"{mean:.1f}{interval}"
        named = ("-" if row[name] is None else escape(text(row[name])) for name in varied)
        table.add_row(*named, str(len(row["seeds"])), *earned)
    return table


def sweep_key(file: Path) -> str:
    """Return what the last two columns of `sweep_table` are."""
    import pyarrow.parquet as pq

    from scla_mj.experiments import statistics
    from scla_mj.experiments.report.wording import averaged_text

    rows = pq.read_table(file, columns=["settled_from_epoch", "epochs", "seeds"]).to_pylist()
    span = averaged_text((row["settled_from_epoch"], row["epochs"]) for row in rows)
    few = any(1 < len(row["seeds"]) < statistics.LEAST_SEEDS for row in rows)
    narrow = f", too narrow of fewer than {statistics.LEAST_SEEDS}" if few else ""
    return f"Hits of the last epoch; % of ceiling: {span} (95 % interval over seeds{narrow})"


def files_table(folder: Path) -> Table:
    """Return what the run folder holds."""
    table = Table()
    table.add_column("file")
    table.add_column("size", justify="right")
    table.add_column("what it holds")
    for name, what in _WHAT.items():
        files = paths.recordings(folder) if name == paths.RECORDING_RRD else [folder / name]
        for file in files:
            if file.exists():
                table.add_row(file.name, _size(file.stat().st_size), what)
    return table


def _size(size_bytes: int) -> str:
    return f"{size_bytes / 1e6:.1f} MB" if size_bytes >= 1_000_000 else f"{size_bytes / 1e3:.1f} kB"
