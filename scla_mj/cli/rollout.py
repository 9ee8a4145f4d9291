"""`scla-mj rollout RUN`: let the robot learn, show how it goes, say what it left behind."""

from __future__ import annotations

import shlex
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro.conf

from scla_mj.cli.folders import folder
from scla_mj.config import RunConfig

if TYPE_CHECKING:
    from rich.console import Console

    from scla_mj.runs.summary import Summary


@dataclass(frozen=True)
class Rollout:
    """Let the robot learn to reach its target, headless, and keep everything it did in a new folder RUN."""

    path: Annotated[Path, tyro.conf.Positional, folder("RUN")]
    """Folder to make; refused if it already holds a run."""
    config: Annotated[RunConfig, tyro.conf.arg(name="")] = field(default_factory=RunConfig)

    def run(self) -> int:
        """Run the rollout; return the exit code."""
        from scla_mj.cli.progress import RolloutProgress
        from scla_mj.experiments.rollout import rollout

        self.config.check()
        with RolloutProgress(self.config) as progress:
            summary = rollout(self.config, self.path, watch=progress.update)
        _report(self.path, summary)
        return 0


def _report(path: Path, summary: Summary) -> None:
    from rich.console import Console

    from scla_mj.cli.tables import epoch_table, files_table
    from scla_mj.paths import RECORDING_RRD

    console = Console()
    console.print(epoch_table(summary))
    console.print(files_table(path))
    _say(console, f"The run:  {path}")
    if (path / RECORDING_RRD).exists():
        _say(console, f"Open the recording:  rerun {shlex.quote(str(path / RECORDING_RRD))}")


def _say(console: Console, line: str) -> None:
    """Print a line as it is: a path may hold what rich takes for markup, and must not be broken."""
    console.print(line, markup=False, emoji=False, highlight=False, soft_wrap=True)
