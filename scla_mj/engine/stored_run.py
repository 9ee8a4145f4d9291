"""A run read back from its folder, whole, unfinished or resumed: one object for everything that it left."""

from __future__ import annotations

import functools
import shlex
from collections.abc import Callable
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from scla_mj import paths
from scla_mj.checked import CheckedConfig, check
from scla_mj.errors import SclaError
from scla_mj.runs.brain import read_brain, read_weight_history
from scla_mj.runs.checkpoint import read_checkpoint
from scla_mj.runs.decisions import read_decisions
from scla_mj.runs.folder import open_run
from scla_mj.runs.seal import check_seal
from scla_mj.runs.summary import Summary, is_complete, read_summary
from scla_mj.signals import Snapshot, WeightCurve
from scla_mj.validation import shown

if TYPE_CHECKING:
    import pyarrow as pa

    from scla_mj.engine.inspection import RunInspection
    from scla_mj.telemetry.reading.series import DecisionSpikes, DecisionTrajectory

_Read = TypeVar("_Read")


class StoredRun:
    """One run folder. Each part is read when it is first asked for; one that the run lacks is refused with a sentence.

    Decisions are numbered over the whole run, from 1.

    Attributes:
        path: the run folder.
        config: the settings that made it.
        anatomy: its brain's populations and projections; None for a brain without neurons.
        run_id: the identity of the run and of its recording.
        versions: package versions that it began with.
    """

    def __init__(self, path: Path | str) -> None:
        run = open_run(path)
        self.path, self.config = run.path, run.config
        self._checked_recording = False
        self.anatomy, self.run_id, self.versions = run.anatomy, run.run_id, run.versions

    def __repr__(self) -> str:
        config, state = self.config, "complete" if self.is_complete else "unfinished"
        return f"StoredRun({str(self.path)!r}: {config.brain}, {config.protocol}, seed {config.seed}, {state})"

    @functools.cached_property
    def checked(self) -> CheckedConfig:
        """The configuration with its grid, clock and ceilings."""
        return check(self.config)

    @property
    def is_complete(self) -> bool:
        """Whether every decision was made and the run's end was written; `scla_mj.resume` finishes one that is not."""
        return is_complete(self.path, self.config)

    @property
    def lacks(self) -> tuple[str, ...]:
        """What cannot be read from this run, each by the name of its attribute."""
        recorded = bool(paths.recordings(self.path))
        there = {
            "summary": self._has(paths.SUMMARY_JSON),
            "decisions": self._has(paths.DECISIONS_PARQUET) or self._has(paths.DECISIONS_PARTIAL),
            "brain": self._has(paths.BRAIN_NPZ) or self._has(paths.CHECKPOINT_NPZ),
            "weight_history": self._has(paths.BRAIN_NPZ) or self._has(paths.CHECKPOINT_NPZ) or recorded,
            "spikes": recorded,
            "trajectory": recorded,
        }
        return tuple(name for name, present in there.items() if not present)

    @functools.cached_property
    def summary(self) -> Summary:
        """Protocol, ceiling, hits per epoch, transitions.

        Raises:
            SclaError: the run stopped before it was written, or it is damaged.
        """
        self._require(paths.SUMMARY_JSON, "a summary")
        return read_summary(self.path)

    @functools.cached_property
    def decisions(self) -> pa.Table:
        """One row per decision as an Arrow table (README, columns); `.to_pandas()` needs pandas.

        Of a run that was killed: the decisions that had reached the disk.

        Raises:
            SclaError: the file is missing or damaged.
        """
        return read_decisions(self.path)

    @functools.cached_property
    def brain(self) -> Snapshot:
        """What the brain had learnt at the end: `weights` and `probabilities` (W, H, 4), or None.

        The paper's weights are (8, 100, 100); those of projections with different shapes a dict of an array for each.

        Raises:
            SclaError: the run has no `brain.npz`, or it is damaged.
        """
        self._require(paths.BRAIN_NPZ, "a final brain")
        return read_brain(self.path, self.anatomy)

    @functools.cached_property
    def weight_history(self) -> WeightCurve:
        """The mean weights over the run, the paper's Figure 3: `decision` (n,), `time_s` (n,), `mean_weights` (n, 8).

        A column per projection of the `anatomy`; at most some 2000 samples, every fourth decision in a run of up to
        8192. From `brain.npz`, of an unfinished run from its checkpoint or its recording.

        Raises:
            SclaError: the brain has no weights, or the run stopped before any were written.
        """
        history = read_weight_history(self.path) if self._has(paths.BRAIN_NPZ) else self._unfinished_history()
        if history is None or not len(history.decision):
            raise SclaError(f"{self.path} holds no weights: --brain {self.config.brain} has no synapses to average")
        return history

    def spikes(self, decision: int | range | None = None) -> DecisionSpikes:
        """Return one decision's spikes, a range's or all: `time_s`, `neuron`, `population`, `decision`, (n,) each.

        A light recording holds the thinking window, a full one the whole decision.

        Raises:
            SclaError: there is no recording or no such decision in it, or the brain has no neurons.
        """
        from scla_mj.telemetry.reading.series import decision_spikes

        return self._read_recording(decision_spikes, decision)

    def trajectory(self, decision: int | None = None) -> DecisionTrajectory:
        """Return one decision's poses, or all, at 20 Hz: `time_s` (n,), `position_m` (n, 3), `heading_rad`, `decision`.

        Raises:
            SclaError: there is no recording, or no such decision in it.
        """
        from scla_mj.telemetry.reading.series import decision_trajectory

        return self._read_recording(decision_trajectory, decision)

    def inspect(self) -> RunInspection:
        """Check every file against the seal and the recording; `.sentence()` is the verdict (`scla-mj inspect`)."""
        from scla_mj.engine.inspection import inspect_run

        return inspect_run(self.path)

    def _has(self, name: str) -> bool:
        return (self.path / name).exists()

    @property
    def recordings(self) -> list[Path]:
        """The files of the recording, in their order: a resumed run has several.

        Raises:
            SclaError: there is none, or one is not as the run left it.
        """
        parts = paths.recordings(self.path)
        if not parts:
            if self.config.telemetry != "off":
                raise SclaError(f"{self.path / paths.RECORDING_RRD} is missing: fetch a sound copy of the run")
            raise SclaError(
                f"{self.path} has no recording (--telemetry off): "
                "run the same configuration with telemetry light or full"
            )
        if not self._checked_recording:  # a recording that was cut short can be read, and holds too little
            check_seal(self.path, *(part.name for part in parts))
            self._checked_recording = True
        return parts

    def _read_recording(self, read: Callable[[list[Path], Any], _Read], decision: int | range | None) -> _Read:
        parts = self.recordings
        try:
            return read(parts, decision if decision is None or isinstance(decision, range) else self._number(decision))
        except SclaError:
            check_seal(self.path, *(part.name for part in parts))  # if it was damaged since, that is why
            raise

    def _number(self, decision: int) -> int:
        last = self.config.epochs * self.config.decisions
        if isinstance(decision, bool) or not isinstance(decision, Integral):
            raise SclaError(f"the decision is {shown(decision)}: it must be a whole number, 1 to {last}")
        if not 1 <= decision <= last:
            raise SclaError(f"decision {decision} is not in the run: choose 1 to {last}, counted over all epochs")
        return int(decision)

    def _require(self, name: str, what: str) -> None:
        if not self._has(name):
            check_seal(self.path, name)  # it was there, and is missing
            raise SclaError(
                f"{self.path} has no {name}, as the run stopped before its end: it lacks {what} until "
                f"`scla-mj resume {shlex.quote(str(self.path))}` finishes it"
            )

    def _unfinished_history(self) -> WeightCurve | None:
        state = read_checkpoint(self.path)
        if state is not None:
            history = state["account"]["history"]
            return WeightCurve(history["decision"], history["time_s"], history["mean_weights"])
        if not paths.recordings(self.path):
            self._require(paths.BRAIN_NPZ, "a history of weights")
        from scla_mj.telemetry.reading.series import weight_curve

        return weight_curve(self.recordings)


def load_run(path: Path | str) -> StoredRun:
    """Return the run that a folder holds, whether it is whole, unfinished or resumed, with or without a recording.

    Raises:
        SclaError: the folder holds no run, or its `config.json` is damaged.
    """
    return StoredRun(path)
