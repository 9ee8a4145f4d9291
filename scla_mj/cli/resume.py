"""`scla-mj resume RUN`: finish an interrupted run; the result is bit-identical to an uninterrupted one."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro.conf

from scla_mj.cli.run_command import Live, carry_out
from scla_mj.config import CHECKPOINT_PERIOD_S

if TYPE_CHECKING:
    from scla_mj.runs.summary import Summary


@dataclass(frozen=True)
class Resume:
    """Finish a run that was killed or stopped; the result is bit-identical to an uninterrupted run."""

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """A run folder that `scla-mj rollout` wrote."""
    brain: str | None = None
    """The run's brain, if it is your own code: package.module:Class, which is imported."""
    checkpoint_period_s: float = CHECKPOINT_PERIOD_S
    """Wall time between two checkpoints."""

    live: Annotated[Live, tyro.conf.arg(name="")] = field(default_factory=Live)

    def run(self) -> int:
        """Resume the run; return the exit code."""
        from scla_mj.engine.resume import resume
        from scla_mj.runs.folder import open_run

        config = open_run(self.path).config

        def run(**how: Any) -> Summary:
            return resume(self.path, brain=self.brain, **how)

        carry_out(self.path, config, self.checkpoint_period_s, self.live, run)
        return 0
