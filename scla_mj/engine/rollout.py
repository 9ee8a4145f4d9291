"""One run from its first decision to its finished folder."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from scla_mj.brain.registry import code_of
from scla_mj.checked import CheckedConfig
from scla_mj.config import CHECKPOINT_PERIOD_S, RunConfig
from scla_mj.engine.build import simulate
from scla_mj.engine.lock import running
from scla_mj.engine.session import Session, Watch
from scla_mj.paths import CONFIG_JSON
from scla_mj.runs import folder
from scla_mj.runs.atomic import remove_scratch

if TYPE_CHECKING:
    from scla_mj.loop.simulation import Simulation
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
        SclaError: the configuration cannot be run, or the folder holds a run already, is in use or cannot be written.
    """
    simulation = simulate(config)
    with folder.made(path) as place:
        folder.refuse_run(place)
        with running(place):
            return begin(simulation, place, watch, pictures=pictures, checkpoint_period_s=checkpoint_period_s)


def begin(
    simulation: Simulation, place: Path, watch: Watch | None, *, pictures: bool, checkpoint_period_s: float
) -> Summary:
    """Carry out a `rollout` in a folder that is `running` for the caller.

    Raises:
        SclaError: as `rollout`.
    """
    config = simulation.config.config
    code = code_of(config.brain)
    run = folder.create(place, config, simulation.brain.anatomy, brain_sha256=code.sha256, brain_versions=code.versions)
    remove_scratch(run.file(CONFIG_JSON))  # of a process that was killed here before
    session = Session(run, simulation, pictures=pictures, checkpoint_period_s=checkpoint_period_s)
    try:
        return session.carry_out(watch)
    finally:
        if not session.decisions:
            folder.discard(run)
