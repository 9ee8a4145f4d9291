"""`scla-mj view RUN`: a stored run, or one in progress, in Rerun's viewer."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro.conf

from scla_mj.cli.options import require_speed
from scla_mj.engine.interrupts import terminable
from scla_mj.errors import SclaError


@dataclass(frozen=True)
class View:
    """Open a run in Rerun's viewer, all parts of its recording (docs/viewing.md), until you close it or Ctrl-C."""

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """A run folder that `scla-mj rollout` wrote."""
    follow: bool = False
    """Keep up with a run in progress, a second or two behind it."""

    mujoco: bool = False
    """Replay it in MuJoCo's viewer instead, from its recording."""
    first: Annotated[int | None, tyro.conf.arg(name="from", metavar="DECISION")] = None
    """With --mujoco, the decision to start with, counted over the run from 1; by default the first."""
    speed: float = 1.0
    """With --mujoco, simulated seconds per second."""
    stay: bool = True
    """With --mujoco, keep the window at the last pose until you close it; --no-stay closes it there."""

    @terminable()
    def run(self) -> int:
        """Open the viewer; return the exit code.

        Raises:
            SclaError: there is no run, recording or display, the recording is damaged, the viewer fails, or a run in
                progress is not to be followed.
        """
        from scla_mj.engine.lock import is_in_use
        from scla_mj.engine.stored_run import load_run
        from scla_mj.telemetry.viewer import follow, open_files

        self._check()
        run, in_progress = load_run(self.path), is_in_use(self.path)
        if in_progress and not self.follow:
            keep_up = f"scla-mj view {shlex.quote(str(self.path))} --follow"
            raise SclaError(f"{self.path} is in progress: `{keep_up}` shows it as it goes")
        if not (self.mujoco if run.config.telemetry == "off" else in_progress):
            parts = run.recordings  # what is wrong with it is said before a display is asked for
        if self.mujoco:
            from scla_mj.render.film import span_of
            from scla_mj.render.replay import replay

            replay(run, span_of(run, self.first, run.decisions.num_rows, None), speed=self.speed, stay=self.stay)
            return 0
        if run.is_complete and not in_progress:
            code = open_files(parts)
        else:  # Rerun opens a file that has no end yet, but follows only its standard input
            code = follow(run.path, lambda: not is_in_use(run.path))
        if code:
            raise SclaError(f"Rerun's viewer ended with exit code {code}: `rerun` alone shows whether it starts here")
        return 0

    def _check(self) -> None:
        if self.follow and self.mujoco:
            raise SclaError("--follow is for Rerun's viewer: leave out --mujoco or --follow")
        if not self.mujoco and (self.first is not None or self.speed != 1.0 or not self.stay):
            raise SclaError("--from, --speed and --no-stay are for --mujoco: Rerun's viewer has a time line of its own")
        require_speed(self.speed)
