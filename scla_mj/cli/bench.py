"""`scla-mj bench`: what a decision costs, beside the bare physics and the bare neurons that it is made of."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro.conf

from scla_mj.config import RunConfig
from scla_mj.errors import SclaError

if TYPE_CHECKING:
    from rich.table import Table

    from scla_mj.experiments.bench.rollouts import Cost


@dataclass(frozen=True)
class Bench:
    """Time a rollout and its bare parts, interleaved, in CPU time; print medians and ratios."""

    repetitions: int = 5
    """Interleaved repetitions; each figure is a median over them."""
    json: Path | None = None
    """File to write the figures to as well; refused if it exists."""
    config: Annotated[RunConfig, tyro.conf.arg(name="")] = field(
        default_factory=lambda: RunConfig(epochs=1, decisions=1000)
    )

    def run(self) -> int:
        """Print the table; return the exit code."""
        from rich.console import Console
        from rich.progress import track

        from scla_mj.experiments.bench.rollouts import measure

        if self.repetitions < 1:
            raise SclaError(f"--repetitions is {self.repetitions}: it must be 1 or more")
        if self.json is not None and self.json.exists():
            raise SclaError(f"{self.json} exists already: choose another file")
        self.config.check()
        bar = iter(track(range(self.repetitions + 1), "repetitions", console=Console(stderr=True)))
        next(bar)
        cost = measure(self.config, repetitions=self.repetitions, watch=lambda: next(bar, None))
        Console().print(_table(self.config, cost))
        if self.json is not None:
            self.json.write_text(json.dumps(cost._asdict(), indent=2) + "\n", encoding="utf-8")
        return 0


def _table(config: RunConfig, cost: Cost) -> Table:
    from rich.table import Table

    decisions = config.epochs * config.decisions
    table = Table(title=f"CPU time of {decisions} decisions, {config.protocol}")
    table.add_column("what")
    table.add_column("ms a decision", justify="right")
    table.add_column("over bare parts", justify="right")
    table.add_row("bare mj_step, its controls replayed", f"{cost.physics:.3f}", "")
    table.add_row("bare network kernel, its inputs replayed", f"{cost.network:.3f}", "")
    for telemetry in ("off", "light", "full"):
        table.add_row(
            f"whole rollout, telemetry {telemetry}", f"{getattr(cost, telemetry):.3f}", f"{cost.ratio(telemetry):.2f}"
        )
    table.caption = f"network: {cost.network_us_per_step:.2f} us a neural step"
    return table
