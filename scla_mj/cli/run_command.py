"""What the commands that run a robot have in common: the bar, the end, and the way back after Ctrl-C."""

from __future__ import annotations

import math
import shlex
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from scla_mj.config import RunConfig, flatten
from scla_mj.engine.interrupts import terminable
from scla_mj.environment import require_display
from scla_mj.errors import SclaError

if TYPE_CHECKING:
    from rich.console import Console

    from scla_mj.engine.account import Account
    from scla_mj.runs.summary import Summary
    from scla_mj.signals import DecisionRecord


@dataclass(frozen=True)
class Live:
    """How a run is looked at while it goes; it changes no bit of it."""

    watch: bool = False
    """Open Rerun's viewer on the run as it goes, in a process of its own; the viewer cannot hold the run up."""
    pace: float | None = None
    """Simulated seconds per second at most: 1 is real time. Without it the run goes as fast as it can."""

    def check(self, config: RunConfig) -> None:
        """Refuse what cannot be shown, before anything runs.

        Raises:
            SclaError: there is no display or no recording to watch, or the pace is not above 0.
        """
        if self.pace is not None and not 0.0 < self.pace < math.inf:
            raise SclaError(f"--pace is {self.pace}: it must be above 0, simulated seconds per second")
        if self.watch:
            require_display("--watch", "leave it out")
            if config.telemetry == "off":
                raise SclaError("--watch shows the recording, and --telemetry off makes none: leave one of them out")

    def watcher(self, path: Path) -> Callable[[DecisionRecord], None]:
        """Return what is called after every decision: it starts the viewer after the first, and waits as paced."""
        begun_s, start_s = 0.0, None

        def look(record: DecisionRecord) -> None:
            nonlocal begun_s, start_s
            if start_s is None:
                begun_s, start_s = time.monotonic(), record.time_s
                if self.watch:
                    command = [sys.executable, "-m", "scla_mj", "view", str(path), "--follow"]
                    subprocess.Popen(command, stdin=subprocess.DEVNULL, start_new_session=True)
            if self.pace is not None:
                time.sleep(max(0.0, begun_s + (record.time_s - start_s) / self.pace - time.monotonic()))

        return look


@terminable()
def carry_out(
    path: Path, config: RunConfig, checkpoint_period_s: float, live: Live, run: Callable[..., Summary]
) -> None:
    """Call `run` with `watch` and `checkpoint_period_s`, show how it goes, and say what it left in the folder `path`.

    Raises:
        SclaError: the period or the pace is not possible, or there is nothing to watch with.
    """
    from scla_mj.brain.registry import can_be_resumed, find_brain
    from scla_mj.cli.progress import RolloutProgress
    from scla_mj.paths import CHECKPOINT_NPZ

    if not checkpoint_period_s >= 0.0:
        raise SclaError(f"--checkpoint-period-s is {checkpoint_period_s}: it must be 0 or more")
    live.check(config)
    before, look = _dates(path), live.watcher(path)

    def watch(record: DecisionRecord, account: Account) -> None:
        progress.update(record, account)
        look(record)

    try:
        with RolloutProgress(config) as progress:
            summary = run(watch=watch, checkpoint_period_s=checkpoint_period_s)
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
        _say(console, f"Look at it:  {shlex.join(['scla-mj', 'view', str(path)])}")


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
