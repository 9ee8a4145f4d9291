"""One run from first decision to finished run folder."""

from __future__ import annotations

import contextlib
import time
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from scla_mj import paths
from scla_mj.errors import SclaError
from scla_mj.experiments.assemble import build_trial
from scla_mj.experiments.interrupts import held_back
from scla_mj.markov import hits_per_1000, uniform_policy
from scla_mj.runs import folder
from scla_mj.runs.brain import write_brain
from scla_mj.runs.decisions import DecisionLog
from scla_mj.runs.history import WeightHistory
from scla_mj.runs.seal import write_seal
from scla_mj.runs.summary import EpochSummary, Summary, Tally, epoch_ceiling_hits_per_1000, write_summary

if TYPE_CHECKING:
    from scla_mj.config import RunConfig
    from scla_mj.loop.trial import Trial
    from scla_mj.runs.folder import Run
    from scla_mj.signals import DecisionRecord, Snapshot
    from scla_mj.telemetry.recording import RerunRecorder

_PROBABILITIES_EVERY: Final = 50
"""Decisions between two pictures of the policy: it is seen to change, for 2 ms a picture."""

Watch = Callable[["DecisionRecord", EpochSummary], None]


def rollout(config: RunConfig, path: Path, *, watch: Watch | None = None, pictures: bool = True) -> Summary:
    """Run every epoch of `config` and leave a run folder; `watch` is called after every decision.
    `pictures` draws the three figures.

    Whatever ends the run early, what was complete is left readable: the decisions, their summary and the recording.
    Ctrl-C and SIGTERM wait for the end of the decision, a second one does not. A run that ends before its first
    decision leaves nothing.

    Raises:
        SclaError: the configuration cannot be run, or the folder holds a run already or cannot be written.
    """
    trial = build_trial(config)
    run = folder.create(path, config)
    account = _Account(config)
    with held_back() as let_interrupt_through:
        try:
            with DecisionLog(run.path) as log, _recorder(config, run.path, trial) as recorder:
                for record, snapshot in _decisions(config, trial):
                    log.write(record)
                    account.add(record, trial.time_s)
                    if recorder is not None:
                        _record(recorder, config, record, snapshot)
                    if watch is not None:
                        watch(record, account.tally.epoch(record.epoch))
                    let_interrupt_through()
        except BaseException:
            with contextlib.suppress(SclaError):  # what ended the run is to be told, not what follows from it
                _finish(run, trial, account, pictures=pictures)
            raise
        return _finish(run, trial, account, pictures=pictures)


class _Account:
    """What a run has earned, up to its last whole decision."""

    def __init__(self, config: RunConfig) -> None:
        self.tally, self.history = Tally(config), WeightHistory()
        self._started = time.perf_counter()
        self._simulated_s = 0.0

    def add(self, record: DecisionRecord, time_s: float) -> None:
        self.tally.add(record)
        self.history.add(record)
        self._simulated_s = time_s

    def summary(self) -> Summary:
        return self.tally.summary(simulated_s=self._simulated_s, wall_s=time.perf_counter() - self._started)


def _record(recorder: RerunRecorder, config: RunConfig, record: DecisionRecord, snapshot: Snapshot | None) -> None:
    if record.decision == 1 and record.epoch == config.world.jump_epoch:
        ceiling = epoch_ceiling_hits_per_1000(config, record.epoch)
        recorder.move_target(config.build_grid(record.epoch), ceiling_hits_per_1000=ceiling)
    recorder.write(record, snapshot)


def _decisions(config: RunConfig, trial: Trial) -> Iterator[tuple[DecisionRecord, Snapshot | None]]:
    """Every decision of the run, with the brain's memory where the recording keeps it."""
    for epoch in range(1, config.epochs + 1):
        if epoch == config.world.jump_epoch:
            trial.move_target(config.build_grid(epoch))
        for decision in range(1, config.decisions + 1):
            record = trial.step(epoch=epoch, decision=decision)
            yield record, None if config.telemetry == "off" else _memory(config, trial, record)


def _memory(config: RunConfig, trial: Trial, record: DecisionRecord) -> Snapshot | None:
    """The whole memory after the first decision and each epoch; in between the probabilities, which are small."""
    if record.decision == config.decisions or (record.epoch == 1 and record.decision == 1):
        return trial.brain.snapshot()
    if record.decision % _PROBABILITIES_EVERY == 0:
        return trial.brain.snapshot()._replace(weights=None)
    return None


@contextlib.contextmanager
def _recorder(config: RunConfig, path: Path, trial: Trial) -> Iterator[RerunRecorder | None]:
    if config.telemetry == "off":
        yield None
        return
    from scla_mj.telemetry.recording import RerunRecorder  # importing rerun takes longer than the first decisions

    recorder = RerunRecorder(
        path / paths.RECORDING_RRD,
        mode=config.telemetry,
        grid=config.build_grid(),
        clock=config.build_clock(),
        model=trial.world.model,
        run_id=uuid.uuid4().hex,
        protocol=config.protocol,
        ceiling_hits_per_1000=epoch_ceiling_hits_per_1000(config, 1),
        weight_max=config.network.weight_max,
        metadata={"seed": config.seed},
    )
    try:
        yield recorder
    finally:
        memory = None
        with contextlib.suppress(SclaError):  # a brain that cannot tell is refused when its file is written
            memory = trial.brain.snapshot()
        recorder.close(memory)


def _finish(run: Run, trial: Trial, account: _Account, *, pictures: bool) -> Summary:
    """Write what is known only at the end; a run without one whole decision was none, and leaves nothing."""
    summary = account.summary()
    if not summary.epochs:
        folder.discard(run)
        return summary
    write_summary(run.path, summary)
    memory = trial.brain.snapshot()
    write_brain(run.path, memory)
    if pictures:
        _draw(run, summary, memory, account.history)
    write_seal(run.path)
    return summary


def _draw(run: Run, summary: Summary, memory: Snapshot, history: WeightHistory) -> None:
    from scla_mj.runs import plots  # matplotlib is slow to import

    first, last = run.config.build_grid(), run.config.build_grid(summary.epochs[-1].epoch)
    floor = hits_per_1000(first, run.config.protocol, uniform_policy(first))
    plots.plot_epochs(run.path, summary, floor_hits_per_1000=floor)
    if memory.weights is not None:
        plots.plot_weights(run.path, history.curve())
    if memory.probabilities is not None:
        plots.plot_policy(run.path, last, memory.probabilities)
