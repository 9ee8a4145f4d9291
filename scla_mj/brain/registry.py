"""Brains by name, and a user's own by import path."""

from __future__ import annotations

import contextlib
import dataclasses
import importlib
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

from scla_mj.brain.automaton_brain import AutomatonBrain
from scla_mj.brain.base import Brain
from scla_mj.brain.baselines import RandomBrain, ShortestPathBrain
from scla_mj.brain.mistakes import told
from scla_mj.brain.q_learning import QLearningBrain
from scla_mj.brain.scla import SclaBrain
from scla_mj.checked import CheckedConfig
from scla_mj.config import AutomatonConfig, RunConfig, flatten, option_of
from scla_mj.errors import SclaError
from scla_mj.validation import shown, validated

_IMPORT_PATH: Final = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")


class NetworkBrain(SclaBrain):
    """SCLA whose automata never hear a signal: the network decides beside the target, chance elsewhere."""

    reads = ("network.", "plasticity.")

    def __init__(self, checked: CheckedConfig) -> None:
        silent = AutomatonConfig(local_rule=False, distal_reward=False, bump_penalty=False)
        super().__init__(CheckedConfig(dataclasses.replace(checked.config, automaton=silent)))


BRAINS: Final[dict[str, type[Brain]]] = {
    "scla": SclaBrain,
    "automaton": AutomatonBrain,
    "network": NetworkBrain,
    "random": RandomBrain,
    "q-learning": QLearningBrain,
    "shortest-path": ShortestPathBrain,
}
_OF_BRAINS: Final = ("network.", "plasticity.", "automaton.")
"""The sections of settings that brains read."""


def build_brain(checked: CheckedConfig) -> Brain:
    """Return the brain that `brain` names: one of `BRAINS`, or `module:Class`.

    Raises:
        SclaError: there is no such brain, its module cannot be imported, it is not a `Brain`, its settings cannot be
            taken, or settings were changed that it does not read.
    """
    config = checked.config
    build = find_brain(config.brain)
    settings = _own_settings(build, config)
    _refuse_unread(build, config)
    try:
        brain = build(checked) if settings is None else build(checked, settings)
    except SclaError:
        raise
    except (Exception, SystemExit) as error:
        raise SclaError(f"--brain {config.brain} cannot be made from a CheckedConfig: {told(error)}") from error
    if not isinstance(brain, Brain):
        raise SclaError(f"--brain {config.brain} is not a brain: derive its class from scla_mj.Brain")
    return brain


def find_brain(name: str) -> Callable[..., Any]:
    """Return the class of the brain of that name, imported if it is a user's own.

    Raises:
        SclaError: there is none.
    """
    return BRAINS.get(name) or _imported(name)


def settings_class(build: Callable[..., Any]) -> Any:
    """Return the dataclass of the settings that a brain's class has of its own, or None."""
    return getattr(build, "Settings", None)


def _own_settings(build: Callable[..., Any], config: RunConfig) -> Any:
    kind = settings_class(build)
    if kind is None:
        if config.brain_settings:
            name = option_of(next(iter(config.brain_settings)))
            raise SclaError(f"--brain.{name} is no setting: --brain {config.brain} has none of its own")
        return None
    if not (isinstance(kind, type) and dataclasses.is_dataclass(kind)):
        raise SclaError(f"--brain {config.brain}: its Settings must be a dataclass")
    return validated(kind, config.brain_settings, spell=lambda path: f"--brain.{option_of(*path)}")


def _refuse_unread(build: Callable[..., Any], config: RunConfig) -> None:
    reads, values, defaults = getattr(build, "reads", _OF_BRAINS), flatten(config), flatten(RunConfig())
    for option, value in values.items():
        if option.startswith(_OF_BRAINS) and value != defaults[option] and not option.startswith(tuple(reads)):
            raise SclaError(f"--{option} is {shown(value)}, which --brain {config.brain} does not read: leave it out")


def _imported(path: str) -> Callable[..., Any]:
    if not _IMPORT_PATH.fullmatch(path):
        raise SclaError(f"--brain {path} is unknown: choose {', '.join(BRAINS)}, or package.module:Class for your own")
    module_name, class_name = path.split(":")
    try:
        with _working_directory_importable():
            module = importlib.import_module(module_name)
    except (Exception, SystemExit) as error:
        raise SclaError(f"--brain {path}: the module {module_name} cannot be imported: {told(error)}") from error
    found = getattr(module, class_name, None)
    if not callable(found):
        raise SclaError(f"--brain {path}: the module {module_name} has no class {class_name}")
    chosen: Callable[..., Any] = found
    return chosen


@contextlib.contextmanager
def _working_directory_importable() -> Iterator[None]:
    """Look for the user's module where the user is too: an installed command does not, unlike `python -m`."""
    here = str(Path.cwd())
    sys.path.append(here)
    try:
        yield
    finally:
        sys.path.remove(here)
