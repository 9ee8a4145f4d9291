"""`scla-mj sweep OUT`: every combination of some settings and seeds, on all cores or on a cluster."""

from __future__ import annotations

import dataclasses
import json
import typing
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import tyro.conf

from scla_mj.cli.progress import runs_bar
from scla_mj.cli.words import HELP
from scla_mj.config import CHECKPOINT_PERIOD_S, RunConfig, option_of
from scla_mj.engine.interrupts import terminable
from scla_mj.errors import SclaError

if TYPE_CHECKING:
    from scla_mj.experiments.experiment import Experiment

_OWN: Final = "--brain."
_OWN_SECTION: Final = "brain_settings"


@dataclass(frozen=True)
class Sweep:
    """Run every combination of the given settings and seeds on Dask, and gather the results into OUT/sweep.parquet and
    OUT/sweep.png; run it again to finish what an interruption left.

    Takes every option of `scla-mj rollout` that is a setting, with one value or with several: --brain scla dyna-q
    --automaton.reward-rate 0.3 0.5. A switch takes true, false or both; a brain's own settings are --brain.NAME. What
    takes a list already (--closed-cells, --network.projections) has its place in a plan.
    """

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="OUT")]
    """Folder for the runs, the table and the figure."""
    seeds: int | None = None
    """Number of seeds, from 0; --seed 3 7 names them."""
    plan: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """Settings, lists of values and lists of runs from a file (docs/sweeps.md); other options override it."""
    workers: int | None = None
    """Processes on this machine, by default one per processor; their number changes no bit of any result."""
    scheduler: Annotated[str | None, tyro.conf.arg(metavar="ADDRESS")] = None
    """A Dask scheduler whose workers make the runs, as tcp://HOST:8786; they must see OUT under the same path."""
    checkpoint_period_s: float = CHECKPOINT_PERIOD_S
    """Wall time between two checkpoints of a run."""
    list: bool = False
    """Print what would be run and stop."""

    @classmethod
    def start(cls, words: Sequence[str]) -> tuple[type[Sweep], Sweep]:
        """Return the class with an option for every setting, each a list of values, and an instance of defaults."""
        if set(HELP) & set(words):
            return cls, cls(tyro.MISSING)
        own = [word.removeprefix(_OWN).partition("=")[0] for word in words if word.startswith(_OWN)]
        hints = _settings() | {(_OWN_SECTION, name.replace("-", "_")): str for name in own if name}
        fields = [_axis(keys, hint) for keys, hint in hints.items()]
        extended = dataclasses.make_dataclass("Sweep", fields, bases=(cls,), frozen=True)
        return extended, extended(tyro.MISSING)

    def run(self) -> int:
        """Run what is missing and gather the results; return the exit code."""
        from scla_mj.experiments.sweeps.plan import Plan, configurations, grouped, read_plan
        from scla_mj.experiments.sweeps.sweep import sweep

        self._check()
        plan = Plan() if self.plan is None else read_plan(self.plan)
        configs = configurations(plan, self._axes(), seeds=self.seeds, file=self.plan)
        if self.list:
            _print(grouped(configs))
            return 0
        with terminable(), runs_bar() as watch:
            table = sweep(
                configs,
                self.path,
                workers=self.workers,
                scheduler=self.scheduler,
                watch=watch,
                checkpoint_period_s=self.checkpoint_period_s,
            )
        from scla_mj.cli.output import wide_console
        from scla_mj.cli.tables import sweep_key, sweep_table

        wide_console().print(sweep_table(table))
        print(sweep_key(table))
        print(f"The table:  {table}\nThe figure:  {table.with_suffix('.png')}")
        return 0

    def _check(self) -> None:
        for option, value in (("seeds", self.seeds), ("workers", self.workers)):
            if value is not None and value < 1:
                raise SclaError(f"--{option} is {value}: it must be 1 or more")
        if not self.checkpoint_period_s >= 0.0:
            raise SclaError(f"--checkpoint-period-s is {self.checkpoint_period_s}: it must be 0 or more")
        if self.workers is not None and self.scheduler is not None:
            raise SclaError("--workers are processes on this machine, --scheduler has its own workers: leave one out")

    def _axes(self) -> dict[tuple[str, ...], Sequence[Any]]:
        axes: dict[tuple[str, ...], Sequence[Any]] = {}
        for keys, hint in _settings().items():
            if values := getattr(self, _field(keys)):
                axes[keys] = [value == "true" for value in values] if hint is bool else values
        for field in dataclasses.fields(self):
            if field.name.startswith(_field((_OWN_SECTION,))):
                name = field.name.removeprefix(_field((_OWN_SECTION, "")))
                axes[_OWN_SECTION, name] = [_plain(word) for word in getattr(self, field.name)]
        return axes


def _settings() -> dict[tuple[str, ...], Any]:
    """Return the types of the settings that a command line can name, by the names that lead to them."""
    found: dict[tuple[str, ...], Any] = {}
    for name, hint in typing.get_type_hints(RunConfig).items():
        if dataclasses.is_dataclass(hint):
            found |= {(name, own): kind for own, kind in typing.get_type_hints(hint).items() if own in _names(hint)}
        elif name in _names(RunConfig) and name != _OWN_SECTION:
            found[name,] = hint
    return {keys: hint for keys, hint in found.items() if typing.get_args(hint)[1:] != (Ellipsis,)}


def _names(kind: Any) -> set[str]:
    return {field.name for field in dataclasses.fields(kind)}


def _field(keys: Sequence[str]) -> str:
    """Return the name of the field that holds the values of a setting."""
    return "__".join(("values", *keys))


def _axis(keys: tuple[str, ...], hint: Any) -> Any:
    """Return the field of a setting's values: those of a switch are words, as it would take none."""
    value: Any = Literal["true", "false"] if hint is bool else hint
    name = f"brain.{option_of(*keys[1:])}" if keys[0] == _OWN_SECTION else option_of(*keys)
    return _field(keys), Annotated[tuple[value, ...], tyro.conf.arg(name=name)], ()


def _plain(word: str) -> Any:
    """Return the number or truth that a word is, or the word: a brain's settings say themselves what they take."""
    try:
        return json.loads(word)
    except ValueError:
        return word


def _print(experiments: Sequence[Experiment]) -> None:
    from scla_mj.cli.output import wide_console

    console = wide_console(highlight=False)
    for experiment in experiments:
        console.print(f"{experiment.title}  ({len(experiment.seeds)} seeds)", markup=False, soft_wrap=True)
    runs = sum(len(experiment.seeds) for experiment in experiments)
    console.print(f"{len(experiments)} configurations, {runs} runs")
