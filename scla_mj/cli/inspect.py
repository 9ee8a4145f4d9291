"""`scla-mj inspect RUN`: what the recording alone says, and whether the run's other files agree."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import tyro.conf

if TYPE_CHECKING:
    from rich.table import Table

    from scla_mj.telemetry.agreement import Comparison
    from scla_mj.telemetry.reader import Inspection

EXIT_DISAGREES: Final = 1


@dataclass(frozen=True)
class Inspect:
    """Read a run's recording alone, print what it holds, and compare it with the run's other files."""

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """A run folder that `scla-mj rollout` wrote."""

    def run(self) -> int:
        """Print the recording and the comparison; return 0 if all agrees, 1 if not."""
        from rich.console import Console

        from scla_mj.paths import RECORDING_RRD
        from scla_mj.runs.brain import read_brain
        from scla_mj.runs.folder import open_run
        from scla_mj.runs.summary import read_summary
        from scla_mj.telemetry.agreement import compare
        from scla_mj.telemetry.reader import inspect_recording

        run = open_run(self.path)
        inspection = inspect_recording(run.file(RECORDING_RRD))
        console = Console()
        for table in (_epochs(inspection), _populations(inspection), _weights(inspection)):
            console.print(table)
        finished = "whole" if inspection.finished else "cut off: the run did not end by itself"
        console.print(
            f"path length {inspection.path_length_m:.2f} m over {inspection.poses} poses, "
            f"{inspection.simulated_s:.2f} s; telemetry {inspection.mode}; the recording is {finished}"
        )
        rows = compare(inspection, dataclasses.asdict(read_summary(run.path)), read_brain(run.path))
        console.print(_comparison(rows))
        differing = [row.what for row in rows if not row.agrees]
        console.print(
            f"disagree: {', '.join(differing)}" if differing else "The recording agrees with the run's files."
        )
        return EXIT_DISAGREES if differing else 0


def _table(title: str, *columns: str) -> Table:
    from rich.table import Table

    table = Table(title=title)
    for number, column in enumerate(columns):
        table.add_column(column, justify="left" if number == 0 else "right")
    return table


def _epochs(inspection: Inspection) -> Table:
    table = _table(f"{inspection.path}: hits", "epoch", "decisions", "hits")
    for epoch in inspection.epochs:
        table.add_row(str(epoch.epoch), str(epoch.decisions), str(epoch.hits))
    return table


def _populations(inspection: Inspection) -> Table:
    table = _table("spikes", "population", "while thinking", "Hz", "whole run", "Hz")
    for population in inspection.populations:
        whole = "-" if population.whole_spikes is None else str(population.whole_spikes)
        rate = "-" if population.whole_rate_hz is None else f"{population.whole_rate_hz:.2f}"
        table.add_row(
            population.name, str(population.thinking_spikes), f"{population.thinking_rate_hz:.2f}", whole, rate
        )
    return table


def _weights(inspection: Inspection) -> Table:
    table = _table("mean weights", "projection", "first", "last")
    for name, first in inspection.first_weights.items():
        table.add_row(name, f"{first:.4f}", f"{inspection.last_weights[name]:.4f}")
    return table


def _comparison(rows: list[Comparison]) -> Table:
    table = _table("recording against summary.json and brain.npz", "what", "recording", "run", "agrees")
    for row in rows:
        table.add_row(row.what, row.recording, row.run, "yes" if row.agrees else "NO")
    return table
