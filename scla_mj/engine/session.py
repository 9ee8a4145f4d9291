"""A run as it goes: decision by decision, recorded, saved at intervals, stopped in order, finished."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from scla_mj import paths
from scla_mj.anatomy import motors_of
from scla_mj.engine.account import Account
from scla_mj.engine.interrupts import held_back
from scla_mj.errors import SclaError
from scla_mj.runs.atomic import is_still, remove
from scla_mj.runs.brain import write_brain
from scla_mj.runs.checkpoint import write_checkpoint
from scla_mj.runs.decisions import DecisionLog
from scla_mj.runs.figures import draw_if_possible
from scla_mj.runs.seal import write_seal
from scla_mj.runs.summary import Summary, write_summary
from scla_mj.signals import Snapshot

if TYPE_CHECKING:
    from scla_mj.loop.simulation import Simulation
    from scla_mj.runs.folder import Run
    from scla_mj.signals import DecisionRecord
    from scla_mj.telemetry.recording import RerunRecorder

Watch = Callable[["DecisionRecord", Account], None]
"""Takes every decision, and the count so far, which can be asked for any epoch's figures.

With telemetry off most decisions have no activity, and their moves an empty trajectory: nobody needs them."""


class Session:
    """One process's share of a run: all of it, or what is left after a checkpoint.

    Args:
        run: the run's folder.
        simulation: the robot and its brain, fresh from the run's configuration.
        pictures: draw the three figures at the end.
        checkpoint_period_s: wall time between two checkpoints; no bit of the run depends on it.
    """

    def __init__(self, run: Run, simulation: Simulation, *, pictures: bool, checkpoint_period_s: float) -> None:
        self._run, self._simulation = run, simulation
        self._checked, self._config = simulation.config, simulation.config.config
        self._anatomy = simulation.brain.anatomy
        self._pictures = pictures
        self._period_s = checkpoint_period_s
        self._account = Account(simulation.config)
        self._recorder: RerunRecorder | None = None
        self._recorded: dict[str, Any] | None = None
        self._whole = self._asked = False
        self._place = run.path.stat()

    @property
    def decisions(self) -> int:
        """Whole decisions so far, those of earlier sessions included."""
        return self._account.decisions

    def can_save(self) -> bool:
        """Return whether the brain has a state to be saved."""
        return self._simulation.brain.state() is not None

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from what `_save` wrote."""
        self._account.restore(state["account"])
        self._simulation.restore(state["simulation"])
        self._recorded = state["recorder"]

    def carry_out(self, watch: Watch | None, *, resumed: bool = False) -> Summary:
        """Make every decision that is left, and leave a finished run folder; `resumed`: continue the log that is there.

        Ctrl-C and SIGTERM wait for the end of the decision, a second one does not. Whatever ends the run early, what
        was complete is left readable, and the last whole decision is where it can be resumed.

        Raises:
            SclaError: the run cannot continue, or its folder cannot be written to.
        """
        with held_back() as let_interrupt_through:
            try:
                with DecisionLog(self._run.path, motors_of(self._anatomy), resumed=resumed) as log, self._recording():
                    self._make_decisions(log, watch, let_interrupt_through)
            except BaseException:
                with contextlib.suppress(SclaError):  # report the original error, not what follows from it
                    self._finish(complete=False)
                raise
            return self._finish(complete=True)

    def _make_decisions(self, log: DecisionLog, watch: Watch | None, between: Callable[[], None]) -> None:
        saved_s = time.monotonic()
        try:
            for _ in range(self.decisions, self._config.epochs * self._config.decisions):
                self._whole = False
                record = self._decide(log)
                self._whole = True
                if watch is not None:
                    watch(record, self._account)
                if time.monotonic() - saved_s >= self._period_s:
                    self._save(log)
                    saved_s = time.monotonic()
                between()
        except BaseException:
            if self._whole:  # between two decisions: from here the run can be resumed
                with contextlib.suppress(SclaError):
                    self._save(log)
            raise

    def _decide(self, log: DecisionLog) -> DecisionRecord:
        """Make the run's next decision, and write it down everywhere."""
        simulation, next_decision = self._simulation, self.decisions % self._config.decisions + 1
        observe = self._recorder is not None or self._account.wants_activity(next_decision)
        record = simulation.step(observe=observe)
        if not self._asked:
            self._asked = True
            _ = simulation.brain.snapshot(), simulation.brain.state()  # what is wrong with them ends the run here
        wanted = self._recorder is not None and self._recorder.wants_memory(record)
        memory = simulation.brain.snapshot() if wanted else None
        log.write(record)
        self._account.add(record, simulation.time_s)
        if self._recorder is not None:
            self._recorder.write(record, memory)
            if record.decision == self._config.decisions:
                count = self._account.epoch(record.epoch)
                self._recorder.end_epoch(hits=count.hits, decisions=count.decisions)
        return record

    def _save(self, log: DecisionLog) -> None:
        """Write a checkpoint, once all that it builds on is safe on the disk; a brain without a state has none."""
        self._require_place()
        simulation = self._simulation.state()
        if simulation["brain"] is None:
            return
        log.sync()
        recorded = None
        if self._recorder is not None:
            self._recorder.sync()
            recorded = self._recorder.state()
        parts = {"account": self._account.state(), "simulation": simulation, "recorder": recorded}
        write_checkpoint(self._run.path, {"config": self._run.content, "decisions": self.decisions, **parts})

    @contextlib.contextmanager
    def _recording(self) -> Iterator[None]:
        if self._config.telemetry == "off":
            yield
            return
        self._recorder = recorder = self._open_recorder()
        try:
            yield
        except BaseException:
            with contextlib.suppress(SclaError):  # report the original error, not what follows from it
                self._close(recorder, stopped=True)
            raise
        self._close(recorder, stopped=False)

    def _close(self, recorder: RerunRecorder, *, stopped: bool) -> None:
        self._recorder = None
        recorder.close(self._memory(), stopped=stopped)

    def _memory(self) -> Snapshot:
        """Return what the brain knows; one whose snapshot fails is refused after its first decision."""
        with contextlib.suppress(SclaError):
            return self._simulation.brain.snapshot()
        return Snapshot()

    def _open_recorder(self) -> RerunRecorder:
        """Open the recording, or its next part; importing rerun takes longer than the first decisions."""
        from scla_mj.telemetry.recording import RerunRecorder

        numbers = [paths.part_number(part.name) or 0 for part in paths.recordings(self._run.path)]
        recorder = RerunRecorder(
            self._run.file(paths.recording_part(max(numbers, default=0) + 1)),
            self._checked,
            anatomy=self._anatomy,
            model=self._simulation.world.drawable_model(),
            run_id=self._run.run_id,
            first_decision=self.decisions + 1,
            memory=self._memory(),
        )
        if self._recorded is not None:
            recorder.restore(self._recorded)
        return recorder

    def _finish(self, *, complete: bool) -> Summary:
        """Write what is known only at the end; a run without one complete decision has nothing to write."""
        path, summary = self._run.path, self._account.summary()
        if not summary.epochs:
            return summary
        self._require_place()
        write_summary(path, summary)
        memory = self._simulation.brain.snapshot()
        write_brain(path, memory, self._account.history.curve(), anatomy=self._anatomy)
        if self._pictures:
            draw_if_possible(path, self._checked, self._anatomy)
        if complete:
            remove(self._run.file(paths.CHECKPOINT_NPZ))
        write_seal(path)
        return summary

    def _require_place(self) -> None:
        """Refuse to write by a path that may be another run's by now."""
        if not is_still(self._run.path, self._place):
            raise SclaError(
                f"{self._run.path} was moved or removed during its run: where it is now, `scla-mj resume` continues it"
            )
