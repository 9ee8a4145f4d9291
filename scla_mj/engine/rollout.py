"""One run from its first decision to its finished folder."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from scla_mj.checked import CheckedConfig
from scla_mj.config import CHECKPOINT_PERIOD_S, RunConfig
from scla_mj.engine.build import simulate
from scla_mj.engine.lock import running
from scla_mj.engine.session import Session, Watch
from scla_mj.runs import folder

if TYPE_CHECKING:
    from scla_mj.runs.summary import Summary


def rollout(
    config: RunConfig | CheckedConfig,
    path: Path | str,
    *,
    watch: Watch | None = None,
    pictures: bool = True,
    checkpoint_period_s: float = CHECKPOINT_PERIOD_S,
) -> Summary:
    """Run every epoch of `config` and leave a run folder; `watch` is called after every decision.
    `pictures` draws the three figures.

    Whatever ends the run early, what was complete is left readable: the decisions, their summary and the recording;
    and `resume` continues it. A run that is stopped before its first decision leaves nothing.

    Raises:
        SclaError: the configuration cannot be run, or the folder holds a run already or cannot be written.
    """
    simulation = simulate(config)
    run = folder.create(path, simulation.config.config)
    session = None
    try:
        with running(run.path):
            session = Session(run, simulation, pictures=pictures, checkpoint_period_s=checkpoint_period_s)
            return session.carry_out(watch)
    finally:
        if session is not None and not session.decisions:
            folder.discard(run)
