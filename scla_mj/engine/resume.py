"""An interrupted run continues from its checkpoint; the result is bit-identical to an uninterrupted one."""

from __future__ import annotations

import logging
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Final

from scla_mj import paths
from scla_mj.anatomy import motors_of
from scla_mj.brain.registry import BRAINS, code_of
from scla_mj.config import CHECKPOINT_PERIOD_S
from scla_mj.engine.build import simulate
from scla_mj.engine.completion import check_but_figures, complete, needs_no_decision
from scla_mj.engine.lock import running
from scla_mj.engine.session import Session, Watch
from scla_mj.errors import SclaError
from scla_mj.floor import refuse_changed_floor
from scla_mj.runs import folder
from scla_mj.runs.atomic import remove, remove_scratch
from scla_mj.runs.checkpoint import START_AGAIN, read_checkpoint
from scla_mj.runs.decisions import take_back
from scla_mj.runs.summary import is_complete
from scla_mj.telemetry.growth import check_parts

if TYPE_CHECKING:
    from scla_mj.loop.simulation import Simulation
    from scla_mj.runs.folder import Run
    from scla_mj.runs.summary import Summary

_RESULTS: Final = (paths.SUMMARY_JSON, paths.BRAIN_NPZ, *paths.FIGURES)
"""What an orderly stop left and the run's end writes anew."""

_LOG: Final = logging.getLogger(__name__)


def resume(
    path: Path | str,
    *,
    brain: str | None = None,
    watch: Watch | None = None,
    pictures: bool = True,
    checkpoint_period_s: float = CHECKPOINT_PERIOD_S,
) -> Summary:
    """Resume the run in `path` from its checkpoint and finish it; `watch` is called after every decision.

    A run that was cut off before its first checkpoint starts again from its beginning. Decisions after the checkpoint
    are made again, equal to what they were. Of a run whose decisions are all made only what is missing is written.

    A brain that is none of the library's is code, which `config.json` alone cannot have run: name it again as `brain`,
    `package.module:Class`, and it is imported.

    Raises:
        SclaError: there is no run, `brain` is not its brain or is wanted, it is complete or running, its files are
            damaged, its brain has no state, or other versions of the packages are installed than it began with.
    """
    run = folder.open_run(path)
    _refuse_unnamed_brain(run, brain)
    with running(run.path):
        return finish(run, watch, pictures=pictures, checkpoint_period_s=checkpoint_period_s)


def finish(
    run: Run, watch: Watch | None, *, pictures: bool, checkpoint_period_s: float, restart: bool = False
) -> Summary:
    """Carry out a `resume` of an unfinished run whose brain was named and whose folder is `running` for the caller.

    A brain without a state is started again from the run's beginning if `restart` says so.

    Raises:
        SclaError: as `resume`.
    """
    redraw = check_but_figures(run)
    if needs_no_decision(run):
        if is_complete(run.path, run.config) and not redraw:
            raise SclaError(f"{run.path} is complete: there is nothing to resume")
        return complete(run, pictures=pictures or redraw)
    _refuse_other_versions(run)
    refuse_changed_floor(run.config.grid)
    simulation = simulate(run.config)
    _refuse_other_brain(run, simulation)
    session = Session(run, simulation, pictures=pictures, checkpoint_period_s=checkpoint_period_s)
    if session.can_save():
        _restore(session, run)
    elif not restart:
        raise SclaError(
            f"--brain {run.config.brain} cannot be resumed: give its class state() and restore() "
            "(docs/own-brain.md), or start a new run"
        )
    _take_back(run, session.decisions)
    return session.carry_out(watch, resumed=True)


def _refuse_unnamed_brain(run: Run, brain: str | None) -> None:
    """Whoever wrote `config.json` chose its brain; code of their own runs only if the user has chosen it too."""
    made_by = run.config.brain
    if brain == made_by or (brain is None and made_by in BRAINS):
        return
    option = f"--brain {shlex.quote(''.join(filter(str.isprintable, made_by)))}"
    if made_by in BRAINS:
        raise SclaError(f"{run.path} was made by {option}, not by --brain {brain}: leave the option out")
    raise SclaError(
        f"{run.path} was made by {option}, which is code of its own: name it again, {option}, if you trust it"
    )


def _refuse_other_brain(run: Run, simulation: Simulation) -> None:
    """Refuse code of the user's own that has changed: no bit after the change would be that of the run."""
    brain, code = run.config.brain, code_of(run.config.brain)
    if code.sha256 != run.brain_sha256:
        raise SclaError(
            f"{code.file or brain} has changed since {run.path} began: put back the file that it began with, SHA-256 "
            f"{run.brain_sha256}, or start a new run"
        )
    if simulation.brain.anatomy != run.anatomy:
        raise SclaError(f"--brain {brain} has another anatomy than when {run.path} began: start a new run")


def _refuse_other_versions(run: Run) -> None:
    of_its_own = code_of(run.config.brain).versions
    here, there = folder.package_versions() | of_its_own, run.versions
    changed = [name for name in (*folder.MAKERS, *of_its_own) if there.get(name) != here[name]]
    if changed:
        began = ", ".join(f"{name} {there.get(name, 'unknown')} (here {here[name]})" for name in changed)
        raise SclaError(f"{run.path} began with {began}: install those versions to resume it, or start a new run")


def _restore(session: Session, run: Run) -> None:
    """Put the session where the checkpoint was written; without one it stays at the run's beginning."""
    state, path = read_checkpoint(run.path), run.file(paths.CHECKPOINT_NPZ)
    if state is None:
        _LOG.info("%s has no checkpoint: the run starts again from its first decision", run.path)
        return
    if state.get("config") != run.content:
        raise SclaError(f"{path} does not belong to {run.file(paths.CONFIG_JSON)}: one of them is of another run")
    _refuse_missing_log(run)
    try:
        parts = None if state["recorder"] is None else state["recorder"].get("parts", [])
        if parts is not None:
            check_parts(run.path, parts)
    except (KeyError, TypeError, AttributeError) as error:
        raise SclaError(f"{path} does not fit its own run ({type(error).__name__}: {error}); {START_AGAIN}") from error
    try:
        session.restore(state)
    except (SclaError, KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise SclaError(f"{path} does not fit its own run ({type(error).__name__}: {error}); {START_AGAIN}") from error


def _refuse_missing_log(run: Run) -> None:
    logs = (paths.DECISIONS_PARQUET, paths.DECISIONS_PARTIAL)
    if not any(run.file(name).exists() for name in logs):
        missing, builds = run.file(paths.DECISIONS_PARTIAL), paths.CHECKPOINT_NPZ
        raise SclaError(
            f"{missing} is missing, the decisions that {builds} builds on: put it back, or move {builds} away and the "
            "run starts again from its beginning, to the same bits"
        )


def _take_back(run: Run, decisions: int) -> None:
    """Reset the folder to what it was after that many decisions; recordings stay, since each names its part."""
    remove(run.file(paths.SEAL_JSON))
    for name in folder.RUN_FILES:
        remove_scratch(run.file(name))
    take_back(run.path, decisions, motors_of(run.anatomy))
    remove(*map(run.file, _RESULTS))
