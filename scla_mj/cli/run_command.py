"""What the commands that run a robot have in common: the bar, the end, and the way back after Ctrl-C."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from scla_mj.config import RunConfig, flatten
from scla_mj.engine.interrupts import terminable
from scla_mj.errors import SclaError

if TYPE_CHECKING:
    from rich.console import Console

    from scla_mj.runs.summary import Summary


@terminable()
def carry_out(path: Path, config: RunConfig, checkpoint_period_s: float, run: Callable[..., Summary]) -> None:
    """Call `run` with `watch` and `checkpoint_period_s`, show how it goes, and say what it left in the folder `path`.

    Raises:
        SclaError: the period is not possible.
    """
    from scla_mj.brain.registry import can_be_resumed, find_brain
    from scla_mj.cli.progress import RolloutProgress
    from scla_mj.paths import CHECKPOINT_NPZ

    if not checkpoint_period_s >= 0.0:
        raise SclaError(f"--checkpoint-period-s is {checkpoint_period_s}: it must be 0 or more")
    before = _dates(path)
    try:
        with RolloutProgress(config) as progress:
            summary = run(watch=progress.update, checkpoint_period_s=checkpoint_period_s)
    except KeyboardInterrupt:
        begun = progress.has_begun and can_be_resumed(find_brain(config.brain))
        if begun or (path / CHECKPOINT_NPZ).exists():
            print(f"{resume_command(path, config)} continues it", file=sys.stderr)
        raise
    if progress.has_begun:
        _report(path, config, summary)
    else:
        written = [name for name, date in _dates(path).items() if date != before.get(name)]
        print(f"{path} had all its decisions; written: {', '.join(written)}")


def resume_command(path: Path, config: RunConfig) -> str:
    """Return the command that resumes the run: a brain that is none of the library's is to be named again."""
    from scla_mj.brain.registry import BRAINS

    named = [] if config.brain in BRAINS else ["--brain", config.brain]
    return shlex.join(["scla-mj", "resume", str(path), *named])


def _report(path: Path, config: RunConfig, summary: Summary) -> None:
    from scla_mj.cli.output import wide_console
    from scla_mj.cli.tables import epoch_table, files_table
    from scla_mj.paths import recordings

    console = wide_console()
    console.print(epoch_table(summary))
    hardships = _hardships(config)
    if hardships:
        _say(console, f"Under:  {hardships}")
    console.print(files_table(path))
    _say(console, f"The run:  {path}")
    parts = recordings(path)
    if parts:
        _say(console, f"Open the recording:  rerun {shlex.join(map(str, parts))}")


def _dates(path: Path) -> dict[str, int]:
    """Return when each of the folder's files was last written, by name."""
    return {file.name: file.stat().st_mtime_ns for file in sorted(path.glob("[!.]*")) if file.is_file()}


def _hardships(config: RunConfig) -> str:
    """Name what the robot had to bear that its controller knows nothing of, and what it found its place by."""
    plain = flatten(RunConfig())
    borne = [
        f"{name.removeprefix('disturbance.')} {value}"
        for name, value in flatten(config).items()
        if name.startswith("disturbance.") and value != plain[name]
    ]
    return ", ".join(borne + ([] if config.localisation == "truth" else [f"localisation {config.localisation}"]))


def _say(console: Console, line: str) -> None:
    """Print a line as it is: a path may hold what rich takes for markup, and must not be broken."""
    console.print(line, markup=False, emoji=False, highlight=False, soft_wrap=True)
