"""One run as a unit of work that can be asked for any number of times, by any number of processes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, TypedDict

from scla_mj.checked import CheckedConfig, check
from scla_mj.config import CHECKPOINT_PERIOD_S, RunConfig
from scla_mj.engine.build import simulate
from scla_mj.engine.lock import running
from scla_mj.engine.resume import finish
from scla_mj.engine.rollout import begin
from scla_mj.errors import SclaError
from scla_mj.paths import CONFIG_JSON
from scla_mj.runs import folder
from scla_mj.runs.summary import is_complete, read_summary

if TYPE_CHECKING:
    from scla_mj.engine.session import Watch
    from scla_mj.runs.summary import Summary


class OtherSettingsError(SclaError):
    """The folder holds a run, but another one than was asked for."""


class _How(TypedDict):
    pictures: bool
    checkpoint_period_s: float


def ensure(
    config: RunConfig | CheckedConfig,
    path: Path | str,
    *,
    watch: Watch | None = None,
    pictures: bool = False,
    checkpoint_period_s: float = CHECKPOINT_PERIOD_S,
) -> Summary:
    """Return the summary of the complete run of `config` in `path`: found there, resumed, or made.

    A complete run is left as it is, an interrupted one is resumed, or started again if its brain has no state. Nothing
    that cannot be resumed is removed: the error names it.

    Raises:
        InUseError: another process runs it.
        SclaError: the configuration cannot be run; the folder holds a run with other settings or a damaged one, or
            cannot be written to.
    """
    checked = check(config)
    how = _How(pictures=pictures, checkpoint_period_s=checkpoint_period_s)
    with folder.made(path) as place:
        if (found := _complete(place, checked.config)) is not None:  # needs no lock, and no folder to write to
            return found
        with running(place):
            if not (place / CONFIG_JSON).exists():
                return begin(simulate(checked), place, watch, **how)
            if (found := _complete(place, checked.config)) is not None:  # by another process, a moment ago
                return found
            return finish(folder.open_run(place), watch, restart=True, **how)


def holds(place: Path, config: RunConfig) -> bool:
    """Return whether the folder holds the complete run of a checked configuration.

    Raises:
        OtherSettingsError: it holds a run with other settings.
        SclaError: it holds a damaged run.
    """
    if not (place / CONFIG_JSON).exists():
        return False
    if folder.open_run(place).config != config:
        raise OtherSettingsError(
            f"{place} holds a run with other settings: choose another folder or move that one away"
        )
    return is_complete(place, config)


def _complete(place: Path, config: RunConfig) -> Summary | None:
    return read_summary(place) if holds(place, config) else None
