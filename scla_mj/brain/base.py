"""The interface between a brain and the loop: percept in, decision out, outcome in."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, ClassVar

from scla_mj.anatomy import Anatomy
from scla_mj.checked import CheckedConfig
from scla_mj.signals import Activity, Decision, Feedback, Percept, Snapshot


class Brain(ABC):
    """A decision maker. A new one needs `decide` and `learn`; the rest is for brains with neurons, and for resuming.

    It is built from the run's `CheckedConfig`, and where the class has `Settings`, from those as a second argument.

    Attributes:
        Settings: a frozen dataclass of the brain's own settings, with defaults; on the command line
            `--brain.NAME VALUE`, in Python `RunConfig(brain_settings={...})`. None for a brain without any.
        reads: the settings of `RunConfig` that it reads, by the beginnings of their options; others of the same
            sections are refused if they are changed, since they would silently do nothing.
        anatomy: its populations and projections, which recordings, tables and figures are named after; None without
            neurons.
        sensors: its own sensors by name, each a function of the `World`; `percept.readings` has what they return.
    """

    Settings: ClassVar[type | None] = None
    reads: ClassVar[tuple[str, ...]] = ("network.", "plasticity.", "automaton.")
    anatomy: Anatomy | None = None
    sensors: Mapping[str, Callable[[Any], Any]] = MappingProxyType({})

    def __init__(self, checked: CheckedConfig, settings: Any = None) -> None:
        """Keep what it is built from, as `checked` and `settings`; a brain of your own may do otherwise."""
        self.checked, self.settings = checked, settings

    @abstractmethod
    def decide(self, percept: Percept) -> Decision:
        """Choose an action; one thinking window of time passes."""

    @abstractmethod
    def learn(self, feedback: Feedback) -> None:
        """Learn from the outcome of the last decision; called once after every move."""

    def elapse(self, duration_s: float) -> None:  # noqa: B027 (most brains have nothing to do then)
        """Let the time of the drive pass; `duration_s` is a whole number of control periods."""

    def activity(self) -> Activity | None:
        """Return what the neurons did since the last `decide` began, or None for a brain without neurons.

        Called after `learn`, and only when it is recorded: it must change nothing.
        """
        return None

    def snapshot(self) -> Snapshot:
        """Return a copy of what the brain has learnt."""
        return Snapshot()

    def state(self) -> dict[str, Any] | None:
        """Return copies of all that changes during a run, generators too; None for a brain that cannot be resumed.

        A state nests dicts and lists; its leaves are numpy arrays of numbers, int, float, str, bool and None.
        """
        return None

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`, bit-identically; called on a brain newly built from the same configuration."""
        raise NotImplementedError("a brain that is resumed needs restore()")
