"""`scla-mj reproduce OUT`: the paper's experiment and everything it is compared with, and the report."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import tyro.conf

from scla_mj.cli.progress import runs_bar
from scla_mj.engine.interrupts import terminable
from scla_mj.errors import SclaError

if TYPE_CHECKING:
    from scla_mj.experiments.catalogue import Experiment

_EVERYTHING: Final = ("all",)


@dataclass(frozen=True)
class Reproduce:
    """Run the experiments of the report, embodied, and write the report into OUT; run it again to finish what an
    interruption left."""

    path: Annotated[Path | None, tyro.conf.Positional, tyro.conf.arg(metavar="OUT")] = None
    """Folder for the runs and the report."""
    only: tuple[str, ...] = _EVERYTHING
    """Experiments or groups (paper, comparison, ladder, world, ablation) to run."""
    workers: int = os.cpu_count() or 1
    """Runs in parallel; their number changes no bit of any result."""
    seeds: int | None = None
    """At most that many seeds of each experiment, for a quick look."""
    epochs: int | None = None
    """At most that many epochs of each run, for a quick look."""
    decisions: int | None = None
    """Decisions in each epoch, for a quick look."""
    list: bool = False
    """Print the experiments and stop."""

    def run(self) -> int:
        """Run what is missing and write the report; return the exit code."""
        from scla_mj.experiments.reproduce import reproduce

        experiments = self._chosen()
        if self.list:
            _print_experiments(experiments)
            return 0
        if self.path is None:
            raise SclaError("OUT is missing: name a folder for the runs and the report, or --list the experiments")
        with terminable(), runs_bar() as watch:
            report = reproduce(experiments, self.path, workers=self.workers, watch=watch, command=self._command())
        print(f"The report:  {report}")
        return 0

    def _chosen(self) -> tuple[Experiment, ...]:
        from scla_mj.experiments.catalogue import CATALOGUE

        for option, value in (("workers", self.workers), *self._quick().items()):
            if value < 1:
                raise SclaError(f"--{option} is {value}: it must be 1 or more")
        names = {experiment.name for experiment in CATALOGUE}
        groups = dict.fromkeys(experiment.group for experiment in CATALOGUE)
        for name in self.only:
            if name not in (*names, *groups, *_EVERYTHING):
                raise SclaError(
                    f"--only {name} is not an experiment: choose {', '.join([*groups, *sorted(names)])}; "
                    "OUT goes before it"
                )
        wanted = set(self.only)
        chosen = [e for e in CATALOGUE if wanted & {e.name, e.group, *_EVERYTHING}]
        return tuple(self._scaled(experiment) for experiment in chosen)

    def _scaled(self, full: Experiment) -> Experiment:
        epochs, decisions = self.epochs or full.config.epochs, self.decisions or full.config.decisions
        return full.at_scale(full.seeds[: self.seeds], min(epochs, full.config.epochs), decisions)

    def _quick(self) -> dict[str, int]:
        """The options that make a campaign smaller, those given."""
        options = {"seeds": self.seeds, "epochs": self.epochs, "decisions": self.decisions}
        return {option: value for option, value in options.items() if value is not None}

    def _command(self) -> str:
        words = ["scla-mj", "reproduce", "OUT"]
        if self.only != _EVERYTHING:
            words += ["--only", *self.only]
        for option, value in self._quick().items():
            words += [f"--{option}", str(value)]
        return " ".join(words)


def _print_experiments(experiments: tuple[Experiment, ...]) -> None:
    from rich.padding import Padding

    from scla_mj.cli.output import wide_console

    console = wide_console(highlight=False)
    for experiment in experiments:
        size = f"{len(experiment.seeds)} seeds, {experiment.config.epochs} epochs"
        console.print(f"[bold]{experiment.name}[/bold]  ({experiment.group}; {size})", soft_wrap=True)
        console.print(Padding(experiment.question, (0, 0, 0, 4)))
