"""Brains by name, and users' own by import path."""

from __future__ import annotations

import contextlib
import dataclasses
import importlib
import re
import sys
import sysconfig
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

from scla_mj.brain.base import Brain
from scla_mj.brain.baselines import (
    AutomataBrain,
    AutomatonBrain,
    CellStatesBrain,
    CoinAutomataBrain,
    RandomBrain,
    ReflexAutomataBrain,
    ShortestPathBrain,
)
from scla_mj.brain.scla import SclaBrain
from scla_mj.brain.scla_dopamine import DopamineBrain
from scla_mj.brain.tabular import ActorCriticBrain, DynaQBrain, QLambdaBrain, QLearningBrain
from scla_mj.checked import CheckedConfig
from scla_mj.config import AutomatonConfig, RunConfig, flatten, option_of
from scla_mj.errors import SclaError
from scla_mj.validation import shown, validated

_IMPORT_PATH: Final = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")
_NOT_THE_USERS: Final = (
    str(Path(__file__).resolve().parents[1]),  # this package
    *(sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib")),
    "<frozen",  # the import system
)


class NetworkBrain(SclaBrain):
    """SCLA whose automata never get a signal: the network decides next to the target, chance elsewhere."""

    reads = ("network.", "plasticity.")

    def __init__(self, checked: CheckedConfig) -> None:
        silent = AutomatonConfig(local_rule=False, distal_reward=False, bump_penalty=False)
        super().__init__(CheckedConfig(dataclasses.replace(checked.config, automaton=silent)))


BRAINS: Final[dict[str, type[Brain]]] = {
    "scla": SclaBrain,
    "scla-printed": SclaBrain,
    "scla-dopamine": DopamineBrain,
    "automaton": AutomatonBrain,
    "network": NetworkBrain,
    "automata-everywhere": AutomataBrain,
    "automata-reflex": ReflexAutomataBrain,
    "automata-coin": CoinAutomataBrain,
    "cell-states": CellStatesBrain,
    "random": RandomBrain,
    "q-learning": QLearningBrain,
    "q-lambda": QLambdaBrain,
    "dyna-q": DynaQBrain,
    "actor-critic": ActorCriticBrain,
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
    kind = find_brain(config.brain)
    settings = own_settings(kind, config)
    _refuse_unread(kind, config)
    build: Callable[..., Brain] = kind
    try:
        brain: Brain = build(checked) if settings is None else build(checked, settings)
    except SclaError:
        raise
    except (Exception, SystemExit) as error:
        raise SclaError(f"--brain {config.brain} cannot be made from a CheckedConfig: {describe(error)}") from error
    return brain


def find_brain(name: str) -> type[Brain]:
    """Return the class of the brain of that name, imported if it is a user's own.

    Raises:
        SclaError: there is none.
    """
    return BRAINS.get(name) or _imported(name)


def can_be_resumed(brain: type[Brain]) -> bool:
    """Return whether a brain has both methods that resuming takes."""
    return brain.state is not Brain.state and brain.restore is not Brain.restore


def own_settings(brain: type[Brain], config: RunConfig) -> Any:
    """Return the settings that a brain's class has of its own, or None.

    Raises:
        SclaError: they cannot be taken.
    """
    kind = brain.Settings
    if kind is None:
        if config.brain_settings:
            name = option_of(next(iter(config.brain_settings)))
            raise SclaError(f"--brain.{name} is not a setting: --brain {config.brain} has none of its own")
        return None
    if not (isinstance(kind, type) and dataclasses.is_dataclass(kind)):
        raise SclaError(f"--brain {config.brain}: its Settings must be a dataclass")
    for field in dataclasses.fields(kind):
        if field.default is field.default_factory is dataclasses.MISSING:
            raise SclaError(f"--brain {config.brain}: its setting {field.name} must have a default")
    return validated(kind, config.brain_settings, spell=lambda path: f"--brain.{option_of(*path)}")


def _refuse_unread(brain: type[Brain], config: RunConfig) -> None:
    if isinstance(brain.reads, str):
        raise SclaError(f"--brain {config.brain}: its reads must be a tuple, such as ({brain.reads!r},)")
    reads, values, defaults = brain.reads, flatten(config), flatten(RunConfig())
    for option, value in values.items():
        if option.startswith(_OF_BRAINS) and value != defaults[option] and not option.startswith(tuple(reads)):
            raise SclaError(f"--{option} is {shown(value)}, which --brain {config.brain} does not read: leave it out")


def _imported(path: str) -> type[Brain]:
    if not _IMPORT_PATH.fullmatch(path):
        raise SclaError(f"--brain {path} is unknown: choose {', '.join(BRAINS)}, or package.module:Class for your own")
    module_name, class_name = path.split(":")
    try:
        with _working_directory_importable():
            module = importlib.import_module(module_name)
    except (Exception, SystemExit) as error:
        raise SclaError(f"--brain {path}: the module {module_name} cannot be imported: {describe(error)}") from error
    found = getattr(module, class_name, None)
    if found is None:
        raise SclaError(f"--brain {path}: the module {module_name} has no class {class_name}")
    if not (isinstance(found, type) and issubclass(found, Brain)):
        raise SclaError(f"--brain {path} is not a brain: derive its class from scla_mj.Brain")
    return found


def describe(error: BaseException) -> str:
    """Return an exception's type, message, and the file and line of the user's code that raised it, if known."""
    message = " ".join(str(error).split())
    text = f"{type(error).__name__}: {message}" if message else type(error).__name__
    place = _users_line(error)
    return text if place is None or place in text else f"{text}, {place}"


def _users_line(error: BaseException) -> str | None:
    """Return the innermost line that is neither in this package nor in a library."""
    if isinstance(error, SyntaxError) and error.filename:
        return f"{error.filename} line {error.lineno}"
    frames = [f for f in traceback.extract_tb(error.__traceback__) if not f.filename.startswith(_NOT_THE_USERS)]
    return f"{frames[-1].filename} line {frames[-1].lineno}" if frames else None


@contextlib.contextmanager
def _working_directory_importable() -> Iterator[None]:
    """Search the working directory for the user's module too: an installed command does not, unlike `python -m`."""
    here = str(Path.cwd())
    sys.path.append(here)
    try:
        yield
    finally:
        sys.path.remove(here)
