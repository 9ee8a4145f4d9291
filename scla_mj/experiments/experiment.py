"""What an experiment is: a configuration, its seeds, and what must come out of it."""

from __future__ import annotations

import dataclasses
import re
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

from scla_mj.config import RunConfig
from scla_mj.errors import SclaError

Group = Literal["paper", "comparison", "ladder", "world", "ablation"]
Statistic = Literal[
    "mean hits per 1000",
    "mean percent of ceiling",
    "worst seed percent of ceiling",
    "equivalent hits per 1000",
    "equivalent percent of ceiling",
    "least weight gap, mV",
    "least mean weight, mV",
    "most mean weight, mV",
]


class Target(NamedTuple):
    """What a result must reach over epochs `first_epoch` to `last_epoch`.

    The statistic is the mean over seeds of hits per 1000 decisions or of the percent of ceiling, or the worst seed's;
    of weights it is the worst of every seed and epoch: the gap between the means of agreeing and opposite projections,
    or the mean of one projection. It must lie in [low, high]. `rivals` name experiments of the same report: the best of
    their means over the same epochs is then the low end. For an equivalence the 90 % interval of the mean, or of its
    difference from that of the one rival, must lie within low and high (`statistics.equivalence`).
    """

    text: str
    first_epoch: int
    last_epoch: int
    statistic: Statistic
    low: float
    high: float = float("inf")
    rivals: tuple[str, ...] = ()


@dataclass(frozen=True)
class Experiment:
    """One row of the report; `config.seed` is replaced by each of `seeds`.

    `group` chooses its chapter, `title` and `question` stand there; `baseline` names the experiment that it is tested
    against. `name` becomes a folder of the runs.

    Raises:
        SclaError: the name cannot be a folder's, or a seed is named twice.
    """

    name: str
    group: Group
    title: str
    question: str
    config: RunConfig
    seeds: tuple[int, ...]
    baseline: str | None = None
    targets: tuple[Target, ...] = ()

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]*", self.name):
            raise SclaError(f"an experiment cannot be named {self.name!r}: use letters, digits, '.', '-' and '_'")
        if len(set(self.seeds)) < len(self.seeds):
            raise SclaError(f"{self.name} names a seed twice: {', '.join(map(str, self.seeds))}")

    def at_scale(self, seeds: tuple[int, ...], epochs: int, decisions: int) -> Experiment:
        """Return the same experiment at another scale; what changes during a run, such as a jump, comes by its end."""
        task = self.config.task
        changes = {name: min(getattr(task, name), epochs) for name in ("jump_epoch", "crossed_epoch")}
        task = dataclasses.replace(task, **changes)
        config = dataclasses.replace(self.config, epochs=epochs, decisions=decisions, task=task)
        return dataclasses.replace(self, config=config, seeds=seeds)


def with_settings(config: RunConfig, **settings: Any) -> RunConfig:
    """Return the configuration with some settings replaced; a section's fields are given as a dict under its name."""
    replaced = {
        name: dataclasses.replace(getattr(config, name), **value)
        if dataclasses.is_dataclass(getattr(config, name))
        else value
        for name, value in settings.items()
    }
    return dataclasses.replace(config, **replaced)
