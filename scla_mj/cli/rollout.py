"""`scla-mj rollout RUN`: let the robot learn, show how it goes, say what it left behind."""

from __future__ import annotations

import dataclasses
import shlex
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import tyro.conf

from scla_mj.checked_path import checked_path
from scla_mj.cli.run_command import Live, carry_out
from scla_mj.cli.words import HELP, value_of
from scla_mj.config import CHECKPOINT_PERIOD_S, RunConfig, option_of
from scla_mj.disturbances import DisturbanceSet, figures_of
from scla_mj.errors import SclaError
from scla_mj.floor import with_new_files

if TYPE_CHECKING:
    from scla_mj.runs.summary import Summary

_OWN: Final = "--brain."


@dataclass(frozen=True)
class Rollout:
    """Let the robot learn to reach its target, headless, and keep everything it did in a new folder RUN.

    A brain that has settings of its own takes them as --brain.NAME VALUE; `--brain NAME --help` lists them.
    """

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """Folder to make; refused if it already holds a run."""
    stored: Annotated[Path | None, tyro.conf.arg(name="config", metavar="FILE")] = None
    """Start from these settings instead of the defaults: a run folder, or JSON such as its config.json; other options
    override them."""
    config: Annotated[RunConfig, tyro.conf.arg(name="")] = field(default_factory=RunConfig)
    disturb: tuple[DisturbanceSet, ...] = ()
    """Sets of disturbances to drive under: shorthand for --disturbance.* (docs/disturbance.md)."""
    checkpoint_period_s: float = CHECKPOINT_PERIOD_S
    """Wall time between two checkpoints, from which `scla-mj resume RUN` continues; it changes no bit of the run."""
    live: Annotated[Live, tyro.conf.arg(name="")] = field(default_factory=Live)

    @classmethod
    def start(cls, words: Sequence[str]) -> tuple[type[Rollout], Rollout]:
        """Return the class with the options of the brain's own settings, and an instance that holds the defaults.

        Raises:
            SclaError: the stored settings cannot be read, or the brain has no such settings of its own.
        """
        config, named = _stored_settings(words), value_of(words, "--brain")
        if named is not None and named != config.brain:
            config = dataclasses.replace(config, brain=named, brain_settings={})
        given = [word.removeprefix(_OWN).partition("=")[0] for word in words if word.startswith(_OWN)]
        own = _own_settings(config, given) if given or (named is not None and set(HELP) & set(words)) else None
        if own is None:
            return cls, cls(tyro.MISSING, config=config)
        hint = Annotated[type(own), tyro.conf.arg(name="brain")]  # type: ignore[valid-type]
        extended = dataclasses.make_dataclass("Rollout", [("own", hint, field(default=own))], bases=(cls,), frozen=True)
        extended.__doc__ = cls.__doc__
        return extended, extended(tyro.MISSING, config=config)

    def finish(self, given: Collection[str]) -> Rollout:
        """Return the command with what its options stand for; `given` names those on the command line."""
        figures = {
            name: value
            for name, value in figures_of(self.disturb).items()
            if f"--{option_of('disturbance', name)}" not in given
        }
        chosen = {option.removeprefix(_OWN).split(".")[0] for option in given if option.startswith(_OWN)}
        own = dataclasses.asdict(self.own) if chosen else {}  # type: ignore[attr-defined]
        own = {name: own[name] for name in own if {option_of(name), option_of(f"no_{name}")} & chosen}
        config = dataclasses.replace(
            with_new_files(self.config, {option.removeprefix("--").replace("-", "_") for option in given}),
            disturbance=dataclasses.replace(self.config.disturbance, **figures),
            brain_settings=self.config.brain_settings | own,
        )
        return dataclasses.replace(self, config=config)

    def remarks(self, options: Iterable[str]) -> dict[str, str]:
        """Return these options and the brain's own, each with what speaks against it: the brain does not read it."""
        from scla_mj.brain.registry import BRAINS, is_read, own_names

        brain = BRAINS.get(self.config.brain)
        if brain is None:
            return dict.fromkeys(options, "")
        unread = f", which --brain {self.config.brain} does not read"
        every = (*options, *(f"{_OWN}{name}" for name in own_names(brain)))
        return {option: "" if is_read(brain, option.removeprefix("--")) else unread for option in every}

    def run(self) -> int:
        """Run the rollout; return the exit code."""
        from scla_mj.engine.rollout import rollout

        def run(**how: Any) -> Summary:
            return rollout(self.config, self.path, **how)

        carry_out(self.path, self.config, self.checkpoint_period_s, self.live, run)
        return 0


def _stored_settings(words: Sequence[str]) -> RunConfig:
    file = value_of(words, "--config")
    if not file:
        return RunConfig()
    from scla_mj.runs.folder import read_settings

    config = read_settings(checked_path(file, "--config"))
    if ":" in config.brain and value_of(words, "--brain") is None:
        option = f"--brain {shlex.quote(config.brain)}"
        raise SclaError(f"{file} asks for {option}, which is code of its own: name it again, {option}, if you trust it")
    return config


def _own_settings(config: RunConfig, given: Sequence[str]) -> Any:
    """Return the settings that the brain has of its own, or None: an import, so only where they are asked for."""
    from scla_mj.brain.registry import find_brain, own_settings, require_own

    brain = find_brain(config.brain)
    own = own_settings(brain, config)
    values = {} if own is None else dataclasses.asdict(own)
    off = {f"no-{option_of(name)}" for name, value in values.items() if isinstance(value, bool)}
    require_own(brain, config, [name for name in given if name and "." not in name and option_of(name) not in off])
    return own
