"""`scla-mj render RUN FILE`: a stretch of a stored run as a video, an animation or a picture."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro.conf

from scla_mj.cli.options import require_speed
from scla_mj.engine.interrupts import terminable
from scla_mj.errors import SclaError


@dataclass(frozen=True)
class Render:
    """Show some decisions of a stored run as a video, from its recording (docs/viewing.md); needs no display."""

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """A run folder that `scla-mj rollout` wrote; without a recording it is simulated again up to there."""
    file: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="FILE")]
    """What to write: .mp4, .gif, or .png, which is the last moment alone."""
    first: Annotated[int | None, tyro.conf.arg(name="from", metavar="DECISION")] = None
    """The first decision to show, counted over the run from 1. By default the run's first."""
    last: Annotated[int | None, tyro.conf.arg(name="to", metavar="DECISION")] = None
    """The last decision to show. By default 20 are shown, each about a second."""
    epoch: int | None = None
    """Start with the first decision of this epoch."""
    camera: Literal["angled", "top"] = "angled"
    """Where it is seen from."""
    size: tuple[int, int] = (640, 480)
    """Width and height in pixels, at most 1920 and 1440; even ones for .mp4."""
    fps: int = 30
    """Frames per second; a .gif keeps hundredths of a second."""
    speed: float = 1.0
    """Simulated seconds per second."""
    overlay: bool = True
    """Write epoch, decision, hits and what is sensed and done over the picture, and the last spikes."""
    draft: bool = False
    """Without shadows and smooth edges: some three times as fast."""
    overwrite: bool = False
    """Write over FILE if it is there."""

    @terminable()
    def run(self) -> int:
        """Render; return the exit code.

        Raises:
            SclaError: the run, these decisions or FILE cannot be, or nothing here can draw or encode.
        """
        from scla_mj.cli.progress import frames_bar
        from scla_mj.engine.stored_run import load_run
        from scla_mj.render.film import Film, make_film, span_of

        self._check()
        run = load_run(self.path)
        decisions = span_of(run, self.first, self.last, self.epoch)
        film = Film(self.camera, self.size, self.fps, self.speed, overlay=self.overlay, draft=self.draft)
        with frames_bar() as show:
            frames = make_film(run, decisions, self.file, film, overwrite=self.overwrite, show=show)
        shown = f"{frames} frames, decisions {decisions.start} to {decisions.stop - 1}"
        if self.file.suffix.lower() == ".png":
            shown = f"the end of decision {decisions.stop - 1}"
        print(f"Written:  {self.file}, {shown}")
        return 0

    def _check(self) -> None:
        if not 1 <= self.fps <= 120:
            raise SclaError(f"--fps is {self.fps}: it must be 1 to 120")
        require_speed(self.speed)
        if self.file.suffix.lower() == ".mp4" and any(side % 2 for side in self.size):
            raise SclaError(f"--size is {self.size[0]} {self.size[1]}: both must be even for .mp4")
