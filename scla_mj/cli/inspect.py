"""`scla-mj inspect RUN`: what the recording alone says, and whether the run's other files agree."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro.conf


@dataclass(frozen=True)
class Inspect:
    """Read a run's recording alone, print what it holds, and compare it with the run's other files."""

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """A run folder that `scla-mj rollout` wrote."""

    def run(self) -> int:
        """Print the comparison; return 0 if all agrees, 1 if not."""
        raise NotImplementedError
