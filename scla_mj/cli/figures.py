"""`scla-mj figures RUN...`: draw a stored run's figures again, or those of several runs for a paper."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro.conf

from scla_mj.errors import SclaError


@dataclass(frozen=True)
class Figures:
    """Draw the figures of a run again, complete or stopped; with --out those of one or several runs for a paper.

    With --out: hits and mean weights over the decisions on a log scale and a histogram of the weights (`learning`),
    the paper's Figure 3 (`weights`) and the policy. Runs that differ only in their seed give one line with the 95 %
    interval of its mean (of two or three, their range). Without --out the pictures in the run folder are drawn anew.
    """

    paths: Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """Run folders that `scla-mj rollout` wrote."""

    out: Path | None = None
    """A folder for the files; none of them may be there already. Needed for more than one run."""

    formats: tuple[Literal["png", "pdf", "svg"], ...] = ("png", "pdf", "svg")
    """File formats in --out; the sizes are in millimetres, for columns of 85 and 180 mm."""

    def run(self) -> int:
        """Draw the figures; return the exit code.

        Raises:
            SclaError: there is no run, it has no summary yet, a file is damaged, or the figures cannot be drawn.
        """
        from scla_mj.engine.completion import draw_again

        if not self.paths:
            raise SclaError("no RUN is named: name the folder of at least one run")
        if self.out is None and len(self.paths) > 1:
            raise SclaError("several runs have no folder in common: say with --out where their figures go")
        if self.out is None:
            files = draw_again(self.paths[0])
        else:
            from scla_mj.runs.figures import import_plots

            import_plots()
            from scla_mj.experiments.figures import draw_runs

            files = draw_runs(self.paths, self.out, kinds=self.formats)
        for file in files:
            print(f"Drawn:  {file}")
        for line in filter(None, dict.fromkeys(map(_not_drawn, self.paths))):
            print(line)
        return 0


def _not_drawn(path: Path) -> str:
    """Return which figures a run's brain has nothing for, and why; empty if it has all."""
    from scla_mj.engine.stored_run import StoredRun

    run = StoredRun(path)
    lacks = {
        "weights (no synapses that change)": run.brain.weights is None or run.anatomy is None,
        "policy (no action probabilities)": run.brain.probabilities is None,
    }
    names = ", ".join(name for name, lacking in lacks.items() if lacking)
    return names and f"Not drawn for {run.config.brain}: {names}"
