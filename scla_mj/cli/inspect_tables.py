"""The tables of `scla-mj inspect --verbose`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from scla_mj.cli.output import wide_console

if TYPE_CHECKING:
    from scla_mj.engine.inspection import RunInspection
    from scla_mj.telemetry.reading.reader import Inspection


def print_tables(found: RunInspection) -> None:
    """Print what the run earned, what its recording holds, and each figure that was compared."""
    console = wide_console(markup=False, emoji=False, highlight=False)  # a path may hold brackets or colons
    console.print(_epochs(found))
    if found.recording is not None:
        _print_recording(console, found.recording)
    if found.comparisons:
        console.print(_comparisons(found))


def _print_recording(console: Console, recording: Inspection) -> None:
    for part in recording.parts:
        console.print(f"{part}", soft_wrap=True)
    for jump in recording.jumps:
        console.print(f"the target jumps to cell {jump.target} at the beginning of epoch {jump.epoch}")
    if recording.populations:
        console.print(_populations(recording))
        if recording.last_weights:
            console.print(_weights(recording))
    else:
        console.print("no neurons: the recording holds neither spikes nor weights")
    finished = "whole" if recording.finished else "cut off: the run did not end by itself"
    console.print(
        f"path length {recording.path_length_m:.2f} m over {recording.poses} poses, "
        f"{recording.simulated_s:.2f} s; telemetry {recording.mode}; the recording is {finished}"
    )


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title)
    for number, column in enumerate(columns):
        table.add_column(column, justify="right" if number else "left", no_wrap=number == 0)
    return table


def _epochs(found: RunInspection) -> Table:
    table = _table("hits", "epoch", "decisions", "hits", "ceiling, per 1000")
    for epoch in found.epochs:
        table.add_row(str(epoch.epoch), str(epoch.decisions), str(epoch.hits), f"{epoch.ceiling_hits_per_1000:.2f}")
    return table


def _populations(recording: Inspection) -> Table:
    table = _table("spikes", "population", "while thinking", "Hz", "whole run", "Hz")
    for population in recording.populations:
        whole = "-" if population.whole_spikes is None else str(population.whole_spikes)
        rate = "-" if population.whole_rate_hz is None else f"{population.whole_rate_hz:.2f}"
        table.add_row(
            population.name, str(population.thinking_spikes), f"{population.thinking_rate_hz:.2f}", whole, rate
        )
    if recording.mode != "full":
        table.caption = "-: not recorded; spikes while driving are kept with --telemetry full"
    return table


def _weights(recording: Inspection) -> Table:
    table = _table("mean weights", "projection", "first", "last")
    for name, first in recording.first_weights.items():
        table.add_row(name, f"{first:.4f}", f"{recording.last_weights[name]:.4f}")
    return table


def _comparisons(found: RunInspection) -> Table:
    reference = "summary.json" if found.recording is None else "recording"
    table = _table(f"{reference} and the run's other files", "file", "what", reference, "file says", "agrees")
    for row in found.comparisons:
        table.add_row(row.file, row.what, row.reference, row.found, "yes" if row.agrees else "NO")
    return table
