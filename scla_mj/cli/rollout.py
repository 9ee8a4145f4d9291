"""`scla-mj rollout RUN`: let the robot learn, show how it goes, say what it left behind."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro.conf

from scla_mj.cli.run_command import carry_out
from scla_mj.config import CHECKPOINT_PERIOD_S, RunConfig
from scla_mj.disturbances import DisturbanceSet


@dataclass(frozen=True)
class Rollout:
    """Let the robot learn to reach its target, headless, and keep everything it did in a new folder RUN."""

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """Folder to make; refused if it already holds a run."""
    config: Annotated[RunConfig, tyro.conf.arg(name="")] = field(default_factory=RunConfig)
    disturb: tuple[DisturbanceSet, ...] = ()
    """Sets of disturbances to drive under: shorthand for --disturbance.* (docs/disturbance.md)."""
    checkpoint_period_s: float = CHECKPOINT_PERIOD_S
    """Wall time between two checkpoints, from which `scla-mj resume RUN` can go on; it changes no bit of the run."""

    def run(self) -> int:
        """Run the rollout; return the exit code."""
        from scla_mj.engine.rollout import rollout

        config = self.config  # `--disturb` has been put into figures already: see cli/options.py
        carry_out(
            self.path,
            config,
            self.checkpoint_period_s,
            lambda **how: rollout(config, self.path, **how),
        )
        return 0
