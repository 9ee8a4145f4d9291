"""One run from first decision to finished run folder."""

from __future__ import annotations

import contextlib
import time
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from scla_mj import paths
from scla_mj.experiments.assemble import build_trial
from scla_mj.markov import hits_per_1000, uniform_policy
from scla_mj.runs import folder
from scla_mj.runs.brain import write_brain
from scla_mj.runs.decisions import DecisionLog
from scla_mj.runs.history import WeightHistory
from scla_mj.runs.summary import EpochSummary, Summary, Tally, epoch_ceiling_hits_per_1000, write_summary

if TYPE_CHECKING:
    from scla_mj.config import RunConfig
    from scla_mj.loop.trial import Trial
    from scla_mj.signals import DecisionRecord, Snapshot
    from scla_mj.telemetry.recording import RerunRecorder

_PROBABILITIES_EVERY: Final = 25
"""Decisions between two pictures of the policy: it is seen to change, for some hundred bytes a decision."""

Watch = Callable[["DecisionRecord", EpochSummary], None]


def rollout(config: RunConfig, path: Path, *, watch: Watch | None = None, pictures: bool = True) -> Summary:
    """Run every epoch of `config` and leave a run folder; `watch` is called after every decision.
    `pictures` draws the three figures.

    Whatever ends the run early, what was complete is left readable: the decisions, their summary and the recording.

    Raises:
        SclaError: the configuration cannot be run, or the folder holds a run already or cannot be written.
    """
    trial = build_trial(config)
    run = folder.create(path, config)
    started = time.perf_counter()
    tally, history = Tally(config), WeightHistory()
    try:
        with DecisionLog(run.path) as log, _recorder(config, run.path, trial) as recorder:
            for record, snapshot in _decisions(config, trial):
                log.write(record)
                tally.add(record)
                history.add(record)
                if recorder is not None:
                    _record(recorder, config, record, snapshot)
                if watch is not None:
                    watch(record, tally.epoch(record.epoch))
    finally:
        summary = tally.summary(simulated_s=trial.time_s, wall_s=time.perf_counter() - started)
        _finish(run.path, trial, summary)
        if pictures:
            _draw(config, run.path, trial, summary, history)
    return summary


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
        recorder.close(trial.brain.snapshot())


def _finish(path: Path, trial: Trial, summary: Summary) -> None:
    """Write what is known only at the end."""
    if summary.epochs:
        write_brain(path, trial.brain.snapshot())
        write_summary(path, summary)


def _draw(config: RunConfig, path: Path, trial: Trial, summary: Summary, history: WeightHistory) -> None:
    if not summary.epochs:
        return
    from scla_mj.runs import plots  # matplotlib is slow to import

    grid, memory = config.build_grid(config.epochs), trial.brain.snapshot()
    floor = hits_per_1000(config.build_grid(), config.protocol, uniform_policy(grid))
    plots.plot_epochs(path, summary, floor_hits_per_1000=floor)
    if memory.weights is not None:
        plots.plot_weights(path, history.curve())
    if memory.probabilities is not None:
        plots.plot_policy(path, grid, memory.probabilities)
