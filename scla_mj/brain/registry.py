"""Brains by name, and a user's own by import path."""

from __future__ import annotations

import contextlib
import dataclasses
import importlib
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from scla_mj.brain.automaton_brain import AutomatonBrain
from scla_mj.brain.base import Brain
from scla_mj.brain.baselines import RandomBrain, ShortestPathBrain
from scla_mj.brain.mistakes import told
from scla_mj.brain.q_learning import QLearningBrain
from scla_mj.brain.scla import SclaBrain
from scla_mj.errors import SclaError

if TYPE_CHECKING:
    from scla_mj.clock import Clock
    from scla_mj.config import RunConfig

_IMPORT_PATH: Final = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")


def network_only(config: RunConfig, clock: Clock) -> Brain:
    """SCLA whose automata never hear a signal: the network decides beside the target, chance elsewhere."""
    silent = dataclasses.replace(config.automaton, local_rule=False, distal_reward=False, bump_penalty=False)
    return SclaBrain(dataclasses.replace(config, automaton=silent), clock)


BRAINS: Final[dict[str, Callable[[RunConfig, Clock], Brain]]] = {
    "scla": SclaBrain,
    "automaton": AutomatonBrain,
    "network": network_only,
    "random": RandomBrain,
    "q-learning": QLearningBrain,
    "shortest-path": ShortestPathBrain,
}


def build_brain(config: RunConfig, clock: Clock) -> Brain:
    """Return the brain that `config.brain` names: one of `BRAINS`, or `module:Class`, made from (config, clock).

    Raises:
        SclaError: there is no such brain, its module cannot be imported, or it is not a `Brain`.
    """
    build = BRAINS.get(config.brain) or _imported(config.brain)
    try:
        brain = build(config, clock)
    except SclaError:
        raise
    except (Exception, SystemExit) as error:
        raise SclaError(f"--brain {config.brain} cannot be made from (config, clock): {told(error)}") from error
    if not isinstance(brain, Brain):
        raise SclaError(f"--brain {config.brain} is not a brain: derive its class from scla_mj.brain.Brain")
    return brain


def _imported(path: str) -> Callable[[RunConfig, Clock], Brain]:
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
    chosen: Callable[[RunConfig, Clock], Brain] = found
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
