"""`scla-mj inspect RUN`: what the recording alone says, and whether the run's other files agree."""

from __future__ import annotations

import dataclasses
import shlex
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeVar

import tyro.conf

from scla_mj.checked import check
from scla_mj.errors import SclaError

if TYPE_CHECKING:
    import pyarrow as pa
    from rich.console import Console
    from rich.table import Table

    from scla_mj.config import RunConfig
    from scla_mj.telemetry.reading.comparison import Comparison, RunFiles
    from scla_mj.telemetry.reading.reader import Inspection

EXIT_DISAGREES: Final = 1
_SEALED: Final = "sealed: each file is checked against the SHA-256 that the run left in seal.json"
_UNSEALED: Final = "unsealed: the run did not end in order; damage shows only where files do not fit"
_Content = TypeVar("_Content")


@dataclass(frozen=True)
class Inspect:
    """Read a run's recording alone, print what it holds, and compare it with the run's other files."""

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """A run folder that `scla-mj rollout` wrote."""

    def run(self) -> int:
        """Print the recording and the comparison; return 0 if all agrees, 1 if not.

        Raises:
            SclaError: a file is missing or damaged; what the others hold is printed first.
        """
        from rich.console import Console

        from scla_mj.paths import CHECKPOINT_NPZ, CONFIG_JSON, RECORDING_RRD, recordings
        from scla_mj.runs.folder import load_config, open_run
        from scla_mj.runs.seal import check_seal, is_sealed
        from scla_mj.telemetry.reading.comparison import compare
        from scla_mj.telemetry.reading.reader import inspect_recording

        parts = recordings(self.path) if self.path.is_dir() else []
        if not parts:
            open_run(self.path)  # what is no run at all is refused as such
            parts = [self.path / RECORDING_RRD]
        check_seal(self.path, *(part.name for part in parts))  # before a library sees the bytes
        faults = Faults(self.path)
        config = faults.read(CONFIG_JSON, lambda: load_config(self.path / CONFIG_JSON))
        inspection = inspect_recording(*parts)
        console = Console(markup=False, emoji=False, highlight=False)  # a path may hold brackets or colons
        _print_recording(console, inspection)
        if (self.path / CHECKPOINT_NPZ).exists():
            console.print("not complete: scla-mj resume goes on from the checkpoint")
        console.print(_SEALED if is_sealed(self.path) else _UNSEALED)
        rows = compare(inspection, _read_files(self.path, config, inspection, faults))
        console.print(_comparison(rows))
        differing = [f"{row.what} ({row.file})" for row in rows if not row.agrees]
        if differing:
            console.print(f"disagree: {', '.join(differing)}")
        faults.tell()
        if not differing:
            console.print(
                "The recording agrees with the run's files: " + ", ".join(dict.fromkeys(r.file for r in rows))
            )
        return EXIT_DISAGREES if differing else 0


class Faults:
    """What is wrong with a run's files: what the seal says, and what their readers say."""

    def __init__(self, path: Path) -> None:
        from scla_mj.runs.seal import broken_files

        self._broken = broken_files(path)
        self._told: dict[str, str] = {}

    def read(self, name: str, read: Callable[[], _Content]) -> _Content | None:
        """Return what a file holds, or None if it is not as the run left it or cannot be read."""
        if name in self._broken:
            return None
        try:
            return read()
        except SclaError as fault:
            self.add(name, str(fault))
            return None

    def add(self, name: str, sentence: str) -> None:
        """Keep what is wrong with a file."""
        self._told[name] = sentence

    def tell(self) -> None:
        """Raise every fault as one `SclaError`, if there is any."""
        faults = self._told | self._broken
        if faults:
            raise SclaError("; ".join(faults.values()))


def _read_files(path: Path, config: RunConfig | None, inspection: Inspection, faults: Faults) -> RunFiles:
    """Return what the run's other files say; of a run that was cut off only its settings can be compared."""
    from scla_mj.paths import BRAIN_NPZ, DECISIONS_PARQUET, SUMMARY_JSON
    from scla_mj.runs.brain import read_brain
    from scla_mj.runs.decisions import read_decisions
    from scla_mj.runs.summary import read_summary
    from scla_mj.telemetry.reading.comparison import RunFiles

    files = RunFiles(config=None if config is None else _settings(config))
    if not (path / SUMMARY_JSON).exists():
        faults.add(
            SUMMARY_JSON,
            f"{path / SUMMARY_JSON} is missing: the run was cut off before its summary was written; "
            f"if nobody is running it, scla-mj resume {shlex.quote(str(path))} goes on with it",
        )
        if not inspection.finished:
            return files
    else:
        summary = faults.read(SUMMARY_JSON, lambda: read_summary(path))
        files = files._replace(summary=None if summary is None else dataclasses.asdict(summary))
    table = faults.read(DECISIONS_PARQUET, lambda: read_decisions(path))
    decisions = None if table is None else _counts(table, inspection.properties["thinking_window_s"])
    return files._replace(decisions=decisions, brain=faults.read(BRAIN_NPZ, lambda: read_brain(path)))


def _settings(config: RunConfig) -> dict[str, Any]:
    """Return the settings that a recording carries too."""
    checked, task = check(config), config.task
    grid = checked.grid()
    return {
        "seed": config.seed,
        "protocol": config.protocol,
        "telemetry": config.telemetry,
        "cells": grid.cells,
        "target": tuple(grid.target),
        "cell_size_m": grid.cell_size_m,
        "thinking_window_s": checked.clock.thinking_window_s,
        "jump": (task.jump_epoch, task.jump_target) if task.jump_epoch else None,
    }


def _counts(table: pa.Table, thinking_window_s: float) -> dict[str, Any]:
    """Return what the rows of decisions.parquet add up to, named as in summary.json."""
    import numpy as np

    from scla_mj.signals import Outcome

    epoch, hit = table["epoch"].to_numpy(), table["hit"].to_numpy()
    outcomes = table["outcome"].to_pylist()
    error_m = float(np.fmax.reduce(np.abs(table["position_error_m"].to_numpy()), initial=0.0))
    ends_s = table["time_s"].to_numpy() + thinking_window_s + table["duration_s"].to_numpy()
    return {
        "epochs": [
            {"epoch": int(n), "decisions": int((epoch == n).sum()), "hits": int(hit[epoch == n].sum())}
            for n in np.unique(epoch)
        ],
        "transitions": {
            "commanded": len(outcomes),
            "completed": outcomes.count(Outcome.MOVED.value),
            "blocked": outcomes.count(Outcome.BLOCKED.value),
            "failed": outcomes.count(Outcome.FAILED.value),
        },
        "max_position_error_m": error_m,
        "simulated_s": float(np.max(ends_s, initial=0.0)),
    }


def _print_recording(console: Console, inspection: Inspection) -> None:
    for part in inspection.parts:
        console.print(f"{part}", soft_wrap=True)
    console.print(_epochs(inspection))
    for jump in inspection.jumps:
        console.print(f"the target jumps to cell {jump.target} at the beginning of epoch {jump.epoch}")
    if inspection.last_weights:
        console.print(_populations(inspection))
        console.print(_weights(inspection))
    else:
        console.print("no neurons: the recording holds neither spikes nor weights")
    finished = "whole" if inspection.finished else "cut off: the run did not end by itself"
    console.print(
        f"path length {inspection.path_length_m:.2f} m over {inspection.poses} poses, "
        f"{inspection.simulated_s:.2f} s; telemetry {inspection.mode}; the recording is {finished}"
    )


def _table(title: str, *columns: str) -> Table:
    from rich.table import Table

    table = Table(title=title)
    for number, column in enumerate(columns):
        table.add_column(column, justify="left" if number == 0 else "right")
    return table


def _epochs(inspection: Inspection) -> Table:
    table = _table("hits", "epoch", "decisions", "hits", "ceiling, per 1000")
    for epoch in inspection.epochs:
        table.add_row(str(epoch.epoch), str(epoch.decisions), str(epoch.hits), f"{epoch.ceiling_hits_per_1000:.2f}")
    return table


def _populations(inspection: Inspection) -> Table:
    table = _table("spikes", "population", "while thinking", "Hz", "whole run", "Hz")
    for population in inspection.populations:
        whole = "-" if population.whole_spikes is None else str(population.whole_spikes)
        rate = "-" if population.whole_rate_hz is None else f"{population.whole_rate_hz:.2f}"
        table.add_row(
            population.name, str(population.thinking_spikes), f"{population.thinking_rate_hz:.2f}", whole, rate
        )
    if inspection.mode != "full":
        table.caption = "-: not recorded; spikes while driving are kept with --telemetry full"
    return table


def _weights(inspection: Inspection) -> Table:
    table = _table("mean weights", "projection", "first", "last")
    for name, first in inspection.first_weights.items():
        table.add_row(name, f"{first:.4f}", f"{inspection.last_weights[name]:.4f}")
    return table


def _comparison(rows: list[Comparison]) -> Table:
    table = _table("the recording against the run's other files", "file", "what", "recording", "file says", "agrees")
    for row in rows:
        table.add_row(row.file, row.what, row.recording, row.run, "yes" if row.agrees else "NO")
    return table
