"""Whether a run folder is sound: what each of its files says, and whether they agree. Nothing is written."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, TypeVar

import numpy as np
import pyarrow.compute as pc

from scla_mj import paths
from scla_mj.checked import CheckedConfig, check
from scla_mj.checked_path import checked_path
from scla_mj.engine.lock import is_in_use
from scla_mj.errors import SclaError
from scla_mj.markov import has_room
from scla_mj.runs.brain import read_brain
from scla_mj.runs.checkpoint import read_checkpoint
from scla_mj.runs.decisions import SPIKES, read_decisions
from scla_mj.runs.folder import Run, is_run_file, open_run
from scla_mj.runs.seal import broken_files, is_sealed
from scla_mj.runs.summary import Summary, is_complete, read_summary
from scla_mj.signals import Outcome, Snapshot
from scla_mj.telemetry.reading.chunks import EmptyRecordingError
from scla_mj.telemetry.reading.comparison import Comparison, RunFiles, compare
from scla_mj.telemetry.reading.reader import Inspection, inspect_recording
from scla_mj.telemetry.views.base import EpochCount

if TYPE_CHECKING:
    import pyarrow as pa

Verdict = Literal["sound", "disagrees", "damaged"]

_LOGS: Final = (paths.DECISIONS_PARQUET, paths.DECISIONS_PARTIAL)
_Content = TypeVar("_Content")


class RunInspection(NamedTuple):
    """What a run folder holds; None for a file that is not there or is damaged.

    `faults` has a sentence for each damaged file. `comparisons` sets the recording against the run's other files or,
    where nothing was recorded, summary.json against the decisions. `complete` is False for a run that can be resumed.
    """

    path: Path
    faults: dict[str, str]
    sealed: bool
    complete: bool = False
    run: Run | None = None
    decisions: pa.Table | None = None
    summary: Summary | None = None
    brain: Snapshot | None = None
    recording: Inspection | None = None
    epochs: tuple[EpochCount, ...] = ()
    comparisons: tuple[Comparison, ...] = ()

    @property
    def verdict(self) -> Verdict:
        """Damage before all else."""
        if self.faults:
            return "damaged"
        return "sound" if all(row.agrees for row in self.comparisons) else "disagrees"

    @property
    def disagreements(self) -> tuple[Comparison, ...]:
        """The comparisons that do not agree."""
        return tuple(row for row in self.comparisons if not row.agrees)

    @property
    def hits(self) -> int:
        """Hits of all epochs."""
        return sum(epoch.hits for epoch in self.epochs)

    @property
    def made(self) -> int:
        """Decisions of all epochs so far."""
        return sum(epoch.decisions for epoch in self.epochs)

    @property
    def percent_of_ceiling(self) -> float | None:
        """Hits relative to the expected hits of the best policy, in per cent; None before the first decision."""
        ceiling = sum(epoch.decisions * epoch.ceiling_hits_per_1000 / 1000 for epoch in self.epochs)
        return 100 * self.hits / ceiling if ceiling else None

    @property
    def percent_above_chance(self) -> float | None:
        """How far the hits are on the way from chance to the ceiling, in per cent; None without decisions or a way."""
        if self.run is None or not self.made:
            return None
        checked = check(self.run.config)
        chance, ceiling = (
            sum(epoch.decisions * of(epoch.epoch) / 1000 for epoch in self.epochs)
            for of in (checked.chance_hits_per_1000, checked.ceiling_hits_per_1000)
        )
        return 100 * (self.hits - chance) / (ceiling - chance) if has_room(chance, ceiling) else None

    def sentence(self) -> str:
        """Return the verdict in one line."""
        return f"{self.path}: {self._damage() or self._difference() or self._state()}"

    def _damage(self) -> str:
        faults = "; ".join(fault.removeprefix(f"{self.path}{os.sep}") for fault in self.faults.values())
        return f"damaged: {faults}" if faults else ""

    def _difference(self) -> str:
        differing = ", ".join(f"{row.what} ({row.file})" for row in self.disagreements)
        return f"disagrees: {differing}" if differing else ""

    def _state(self) -> str:
        assert self.run is not None  # else it is damaged
        config, made = self.run.config, self.made
        earned = "" if self.percent_of_ceiling is None else f", {self.percent_of_ceiling:.1f} % of the ceiling"
        compared = ", recording agrees" if self.recording is not None else ", no recording"
        if self.complete:
            epochs = f"{config.epochs} epoch{'' if config.epochs == 1 else 's'}"
            head = f"complete: {epochs}, {self.hits} hits of {made} decisions"
            return f"sound, {head}{earned}{compared}"
        head = f"unfinished: {made} of {config.epochs * config.decisions} decisions, {self.hits} hits"
        return f"sound, {head}{earned}{compared}"


def inspect_run(path: Path, *, recording: bool = True, held: bool = False) -> RunInspection:
    """Read every file of a run, each checked against the seal before its reader sees it; `recording` reads that too.

    `held` says that nobody else can change the files, as the caller holds the run (`scla_mj.engine.lock`).

    Raises:
        SclaError: the folder holds no run, or another process runs it and what was read does not fit.
    """
    path = checked_path(path, "RUN")
    if not path.is_dir() or not any(is_run_file(entry.name) for entry in path.iterdir()):
        open_run(path)
    running = not held and is_in_use(path)
    found = _inspected(path, recording=recording)
    if running and found.verdict != "sound":
        raise SclaError(
            f"{path} is in use: its files change while they are read; inspect it when its process has ended"
        )
    return found


def _inspected(path: Path, *, recording: bool) -> RunInspection:
    try:
        files = _Files(path, broken_files(path))
    except SclaError as error:  # of a damaged seal no file can be trusted
        return RunInspection(path, {paths.SEAL_JSON: str(error)}, sealed=True)
    run = files.read(paths.CONFIG_JSON, lambda: open_run(path))
    log = next((name for name in _LOGS if files.has(name)), _LOGS[0])
    decisions = files.read(log, lambda: read_decisions(path)) if files.has(log) else None
    summary = files.read_if_there(paths.SUMMARY_JSON, lambda: read_summary(path))
    brain = files.read_if_there(paths.BRAIN_NPZ, lambda: read_brain(path, None if run is None else run.anatomy))
    checkpoint = files.read_if_there(paths.CHECKPOINT_NPZ, lambda: read_checkpoint(path))
    if checkpoint is not None and run is not None and checkpoint.get("config") != run.content:
        files.faults[paths.CHECKPOINT_NPZ] = f"{path / paths.CHECKPOINT_NPZ} is of another run"
    found = RunInspection(path, files.faults, is_sealed(path), False, run, decisions, summary, brain)
    files.report_missing(found)
    found = found._replace(complete=_is_complete(found))
    if recording:
        found = found._replace(recording=_read_recording(files, found))
    return found._replace(epochs=_epochs(found), comparisons=tuple(_compare(found)))


def _is_complete(found: RunInspection) -> bool:
    if found.run is None or found.decisions is None or found.summary is None or found.brain is None:
        return False
    config = found.run.config
    return bool(found.decisions.num_rows >= config.epochs * config.decisions) and is_complete(found.path, config)


class _Files:
    """A run's files, and what is wrong with them: what the seal says, and what their readers say."""

    def __init__(self, path: Path, broken: dict[str, str]) -> None:
        self.path, self.faults = path, dict(broken)

    def has(self, name: str) -> bool:
        return os.path.lexists(self.path / name)

    def read(self, name: str, read: Callable[[], _Content]) -> _Content | None:
        """Return what a file holds, or None if it is not as the run left it or cannot be read."""
        if name in self.faults:
            return None
        try:
            return read()
        except EmptyRecordingError:
            return None
        except SclaError as fault:
            self.faults[name] = str(fault)
            return None

    def read_if_there(self, name: str, read: Callable[[], _Content]) -> _Content | None:
        return self.read(name, read) if self.has(name) else None

    def report_missing(self, found: RunInspection) -> None:
        """Report a file that is missing although what is written after it is there."""
        results, recorded = self.has(paths.BRAIN_NPZ), bool(paths.recordings(self.path))
        started = results or self.has(paths.SUMMARY_JSON) or recorded
        if started and not any(map(self.has, _LOGS)):
            self._report(paths.DECISIONS_PARQUET)
        if results and not self.has(paths.SUMMARY_JSON):
            self._report(paths.SUMMARY_JSON)
        if found.run is None or found.decisions is None or found.run.config.telemetry == "off":
            return
        if found.decisions.num_rows and not recorded:
            self._report(paths.RECORDING_RRD)

    def _report(self, name: str) -> None:
        self.faults.setdefault(name, f"{self.path / name} is missing, but what is written after it is there")


def _read_recording(files: _Files, found: RunInspection) -> Inspection | None:
    parts = paths.recordings(found.path)
    if not parts or any(part.name in found.faults for part in parts):
        return None
    return files.read(paths.RECORDING_RRD, lambda: inspect_recording(*parts))


def _epochs(found: RunInspection) -> tuple[EpochCount, ...]:
    """Return what each epoch earned, from the first of the sources that can be read."""
    if found.decisions is not None and found.run is not None:
        checked = check(found.run.config)
        return tuple(
            EpochCount(own["epoch"], own["decisions"], own["hits"], checked.ceiling_hits_per_1000(own["epoch"]))
            for own in _counts(found.decisions, 0.0)["epochs"]
        )
    if found.summary is not None:
        return tuple(
            EpochCount(own.epoch, own.decisions, own.hits, own.ceiling_hits_per_1000) for own in found.summary.epochs
        )
    return () if found.recording is None else found.recording.epochs


def _compare(found: RunInspection) -> list[Comparison]:
    """Compare the recording with the other files; of a run that was cut off only its settings can be."""
    checked, recording = None if found.run is None else check(found.run.config), found.recording
    closed = (found.path / paths.DECISIONS_PARQUET).exists() and found.decisions is not None
    window_s = 0.0 if checked is None else checked.clock.thinking_window_s
    anatomy = None if found.run is None else found.run.anatomy
    files = RunFiles(
        config=None if checked is None else _settings(checked) | {"anatomy": anatomy},
        decisions=_counts(found.decisions, window_s) if closed else None,
        summary=None if found.summary is None else dataclasses.asdict(found.summary),
        brain=found.brain,
    )
    whole = recording is None or closed or found.complete
    return compare(recording, files if whole else RunFiles(config=files.config))


def _settings(checked: CheckedConfig) -> dict[str, Any]:
    """Return the settings that a recording carries too."""
    config, grid = checked.config, checked.grid()
    return {
        "seed": config.seed,
        "protocol": config.protocol,
        "telemetry": config.telemetry,
        "cells": grid.cells,
        "target": tuple(grid.target),
        "others": grid.others,
        "cell_size_m": grid.cell_size_m,
        "thinking_window_s": checked.clock.thinking_window_s,
        "jumps": [(epoch, *later.target) for epoch, later in checked.jumps],
    }


def _counts(table: pa.Table, thinking_window_s: float) -> dict[str, Any]:
    """Return what the rows of decisions.parquet add up to, named as in summary.json."""
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
        "spikes": {
            name.removeprefix(SPIKES): pc.sum(table[name]).as_py() or 0
            for name in table.column_names
            if name.startswith(SPIKES) and not table[name].null_count
        },
    }
