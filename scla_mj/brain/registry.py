"""Brains by name, and users' own by import path."""

from __future__ import annotations

import contextlib
import dataclasses
import difflib
import hashlib
import importlib
import re
import sys
import types
from collections.abc import Callable, Iterable, Iterator
from importlib import metadata
from typing import Any, Final, NamedTuple

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
from scla_mj.brain.bridge import Bridge, bridge_class, is_bridge
from scla_mj.brain.potjans import PotjansBrain
from scla_mj.brain.scla import SclaBrain
from scla_mj.brain.scla_dopamine import DopamineBrain
from scla_mj.brain.tabular import ActorCriticBrain, DynaQBrain, QLambdaBrain, QLearningBrain
from scla_mj.brain.users_code import users_code
from scla_mj.checked import CheckedConfig
from scla_mj.config import AutomatonConfig, RunConfig, flatten, option_of
from scla_mj.errors import SclaError
from scla_mj.validation import shown, validated

_IMPORT_PATH: Final = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")


class NetworkBrain(SclaBrain):
    """SCLA as printed, whose automata never get a signal: the network decides next to the target, chance elsewhere."""

    reads = ("network.", "plasticity.")

    def __init__(self, checked: CheckedConfig) -> None:
        silent = AutomatonConfig(local_rule=False, distal_reward=False, bump_penalty=False)
        super().__init__(CheckedConfig(dataclasses.replace(checked.config, automaton=silent)))


BRAINS: Final[dict[str, type[Brain]]] = {
    "scla": DopamineBrain,
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
    "potjans": PotjansBrain,
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
    kind, settings = check_brain(config)
    with users_code(f"--brain {config.brain} cannot be made from a CheckedConfig:"):
        build: Callable[..., Brain] = kind
        brain: Brain = build(checked) if settings is None else build(checked, settings)
    return brain


def check_brain(config: RunConfig) -> tuple[type[Brain], Any]:
    """Return the class of the brain that a configuration names, and the settings that it has of its own, or None.

    Raises:
        SclaError: as `build_brain`, short of making it.
    """
    kind = find_brain(config.brain)
    with users_code(f"--brain {config.brain} cannot be made from a CheckedConfig:"):
        settings = own_settings(kind, config)
        _refuse_unread(kind, config)
    return kind, settings


def find_brain(name: str) -> type[Brain]:
    """Return the class of the brain of that name; a user's own is imported, or started in its own Python.

    Raises:
        SclaError: there is none.
    """
    if is_bridge(name):
        return bridge_class(name)
    return BRAINS.get(name) or _imported(name)


class BrainCode(NamedTuple):
    """What a brain of the user's own is made of: its module's file and that file's SHA-256, and packages' versions."""

    file: str | None = None
    sha256: str | None = None
    versions: dict[str, str] = {}  # noqa: RUF012 (a tuple's default, which nobody changes)


def code_of(name: str) -> BrainCode:
    """Return what decides the bits of a brain besides scla-mj; nothing does for one of `BRAINS`.

    The packages are those that its module, or its script in another Python, imports by name.
    """
    if name in BRAINS:
        return BrainCode()
    kind = find_brain(name)
    module = sys.modules[kind.__module__]
    file, digest = getattr(module, "__file__", None), None
    if issubclass(kind, Bridge):
        file, versions = name.rpartition(":")[2], kind.versions
    else:
        versions = dict(_versions_of_imports(vars(module).values()))
    if file is not None:
        with contextlib.suppress(OSError), open(file, "rb") as content:  # noqa: PTH123
            digest = hashlib.file_digest(content, "sha256").hexdigest()
    return BrainCode(file, digest, versions)


def _versions_of_imports(values: Iterable[Any]) -> Iterator[tuple[str, str]]:
    for value in values:
        plain = isinstance(value, type | types.FunctionType | types.BuiltinFunctionType)
        name = value.__name__ if isinstance(value, types.ModuleType) else value.__module__ if plain else None
        package = (name or "").partition(".")[0]
        if package and package not in sys.stdlib_module_names and package != __package__.partition(".")[0]:
            with contextlib.suppress(metadata.PackageNotFoundError):
                yield package, metadata.version(package)


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
        require_own(brain, config, config.brain_settings)
        return None
    if not (isinstance(kind, type) and dataclasses.is_dataclass(kind)):
        raise SclaError(f"--brain {config.brain}: its Settings must be a dataclass")
    for field in dataclasses.fields(kind):
        if field.default is field.default_factory is dataclasses.MISSING:
            raise SclaError(f"--brain {config.brain}: its setting {field.name} must have a default")
    require_own(brain, config, config.brain_settings)
    return validated(kind, config.brain_settings, spell=lambda path: f"--brain.{option_of(*path)}")


def require_own(brain: type[Brain], config: RunConfig, names: Iterable[str]) -> None:
    """Refuse names that are none of a brain's own settings.

    Raises:
        SclaError: the sentence says which brains of ours have it, and what this one has.
    """
    own = own_names(brain)
    for name in map(option_of, names):
        if name not in own:
            others = ", ".join(other for other, kind in BRAINS.items() if name in own_names(kind))
            shared = [option for option in flatten(config) if option.rpartition(".")[2] == name]
            meant = [option for option in shared if is_read(brain, option)]
            meant += [] if others else [f"brain.{near}" for near in difflib.get_close_matches(name, own, n=1)]
            has = f"its own are {', '.join(own)}" if own else "it has none of its own"
            raise SclaError(
                f"--brain.{name} is not a setting of --brain {config.brain}{others and f', but of {others}'}: "
                + (f"did you mean --{meant[0]}?" if meant else has)
            )


def is_read(brain: type[Brain], option: str) -> bool:
    """Return whether a brain reads an option, such as "automaton.reward-rate", if brains read it at all."""
    return not option.startswith(_OF_BRAINS) or option.replace(".no-", ".").startswith(tuple(brain.reads))


def own_names(brain: type[Brain]) -> list[str]:
    """Return the names of a brain's own settings, as options have them."""
    kind: Any = brain.Settings
    return [option_of(field.name) for field in dataclasses.fields(kind)] if dataclasses.is_dataclass(kind) else []


def _refuse_unread(brain: type[Brain], config: RunConfig) -> None:
    if isinstance(brain.reads, str):
        raise SclaError(f"--brain {config.brain}: its reads must be a tuple, such as ({brain.reads!r},)")
    values, defaults = flatten(config), flatten(RunConfig())
    for option, value in values.items():
        if value != defaults[option] and not is_read(brain, option):
            other = " or choose --brain scla-printed" if issubclass(brain, SclaBrain) else ""
            said = f"--{option} is {shown(value)}, which --brain {config.brain} does not read"
            raise SclaError(f"{said}: leave it out{other}")


def _imported(path: str) -> type[Brain]:
    module_name, _, class_name = path.partition(":")
    plain = module_name.removeprefix("./").removesuffix(".py").replace("/", ".")
    if class_name and plain != module_name and _IMPORT_PATH.fullmatch(f"{plain}:{class_name}"):
        raise SclaError(f"--brain {path} names a file: name its module as in an import, --brain {plain}:{class_name}")
    if path.endswith(".py") and _IMPORT_PATH.fullmatch(f"{plain}:Class"):
        raise SclaError(f"--brain {path} names a file: name its module and a class in it, such as {plain}:MyBrain")
    if not _IMPORT_PATH.fullmatch(path):
        raise SclaError(
            f"--brain {path} is unknown: choose {', '.join(BRAINS)}, package.module:Class for your own, "
            "or PYTHON:SCRIPT.py for one in another Python"
        )
    importlib.invalidate_caches()  # a file may be younger than what Python knows of its folder
    with users_code(f"--brain {path}: the module {module_name} cannot be imported:"):
        module = importlib.import_module(module_name)
        found = getattr(module, class_name, None)
    if found is None:
        file = getattr(module, "__file__", None) or "built into Python"
        raise SclaError(f"--brain {path}: the module {module_name} ({file}) has no class {class_name}")
    if not (isinstance(found, type) and issubclass(found, Brain)):
        raise SclaError(f"--brain {path} is not a brain: derive its class from scla_mj.Brain")
    return found
