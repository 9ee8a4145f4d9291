"""`scla-mj figures RUN`: draw a stored run's figures again."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro.conf


@dataclass(frozen=True)
class Figures:
    """Draw the figures of a run again, complete or stopped, from its summary and its brain."""

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """A run folder that `scla-mj rollout` wrote."""

    def run(self) -> int:
        """Draw the figures; return the exit code.

        Raises:
            SclaError: there is no run, it has no summary yet, a file is damaged, or the figures cannot be drawn.
        """
        from scla_mj.engine.completion import draw_again

        for file in draw_again(self.path):
            print(f"Drawn:  {file}")
        return 0
