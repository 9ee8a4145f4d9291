"""`scla-mj bench`: what a run costs, compared with its bare parts and with other simulators, and how that grows."""

from __future__ import annotations

import functools
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro.conf

from scla_mj.checked import check
from scla_mj.config import RunConfig
from scla_mj.engine.interrupts import terminable
from scla_mj.errors import SclaError

if TYPE_CHECKING:
    from rich.table import Table

    from benchmarks.table import Sheet


@dataclass(frozen=True)
class Bench:
    """Time a run's decisions against bare physics and bare neurons, in turn; print medians and ratios (4 minutes).
    --growth, --long, --seeds, --fleets, --described, --gpu and --peers measure that instead."""

    repetitions: int = 5
    """Repetitions in turn; each figure is a median over them."""
    growth: bool = False
    """Cost against neurons and the arena's size, and an hour without reward (5 minutes)."""
    long: bool = False
    """Memory and speed over 30,000 decisions compared with 3,000 and with their bare parts (6 minutes)."""
    seeds: bool = False
    """Two seeds at once compared with one after the other; wants two free cores (1 minute)."""
    fleets: bool = False
    """The environments, 64 robots at once, and 64 with their brains, compared with their bare parts, on one core and on
    two, which must be free (1 minute)."""
    described: bool = False
    """A network by description compared with the paper's kernel, with ten times its size, and with Brian2 where
    .peers is (1 minute)."""
    gpu: bool = False
    """Moves of 1,024 robots, and decisions of their networks, on an NVIDIA GPU compared with one core; needs the extra
    `warp` (3 minutes)."""
    peers: Path | None = None
    """The python of the peers' environment (docs/performance.md): Brian2, NEST and numpy run the same network; their
    spike trains must be ours (1 minute)."""
    json: Path | None = None
    """File to write the figures to as well; refused if it exists."""
    out: Path | None = None
    """Folder for the tables as CSV and the pictures; nothing there is overwritten."""
    into: Path | None = None
    """Markdown page whose tables, each between <!-- bench: NAME --> and <!-- end -->, are replaced by the new ones."""
    config: Annotated[RunConfig, tyro.conf.arg(name="")] = field(
        default_factory=lambda: RunConfig(epochs=1, decisions=1000)
    )

    def run(self) -> int:
        """Print the tables; return the exit code."""
        from benchmarks import suites  # noqa: F401 (before a signal becomes an exception)

        with terminable():
            return self._measure()

    def _measure(self) -> int:
        from rich.console import Console
        from rich.progress import Progress

        from benchmarks import suites

        names = self._suites()
        self._check(names)
        order = suites.Order(self.config, self.repetitions, self.peers)
        console, sheets = Console(), []
        for name in names:
            suite = suites.SUITES[name]
            with Progress(console=Console(stderr=True), transient=True) as bar:
                task = bar.add_task(name, total=suite.ticks(order))
                result = suites.measure(name, order, functools.partial(bar.advance, task))
            for sheet in result.sheets:
                console.print(_table(sheet))
            if self.out is not None:
                suites.write(self.out, result)
            sheets += result.sheets
        console.print(f"machine: {suites.machine()}")
        self._write(sheets, suites.machine())
        return 0

    def _suites(self) -> list[str]:
        wanted = {
            "growth": self.growth,
            "long": self.long,
            "seeds": self.seeds,
            "fleets": self.fleets,
            "described": self.described,
            "gpu": self.gpu,
            "peers": self.peers is not None,
        }
        return [name for name, chosen in wanted.items() if chosen] or ["rollout"]

    def _check(self, names: list[str]) -> None:
        """Refuse whatever cannot be measured or written, before minutes are spent."""
        from benchmarks import preflight, suites
        from benchmarks.peers_python import require_peers_python
        from benchmarks.replay import require_replayable

        if self.repetitions < 1:
            raise SclaError(f"--repetitions is {self.repetitions}: it must be 1 or more")
        if self.json is not None:
            preflight.require_new_file("--json", self.json)
        if self.into is not None:
            preflight.require_page("--into", self.into, [key for name in names for key in suites.SUITES[name].keys])
        if self.out is not None:
            suites.require_room(self.out, names)
        check(self.config)
        if names != ["seeds"]:  # two seeds are whole runs, of any brain
            require_replayable(self.config)
        if self.gpu:
            preflight.require_printed("--gpu", self.config)
            preflight.require_gpu("--gpu")
        if self.peers is not None:
            require_peers_python(self.peers)

    def _write(self, sheets: list[Sheet], machine: str) -> None:
        from benchmarks.table import replace_tables

        if self.json is not None:
            figures = {"machine": machine, **{sheet.key: sheet.values for sheet in sheets}}
            self.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
        if self.into is not None:
            page = self.into.read_text(encoding="utf-8")
            self.into.write_text(replace_tables(page, sheets, machine=machine), encoding="utf-8")


def _table(sheet: Sheet) -> Table:
    from rich.table import Table

    table = Table(title=sheet.title, caption=sheet.note)
    for number, name in enumerate(sheet.header):
        table.add_column(name, justify="right" if number else "left")
    for row in sheet.rows:
        table.add_row(*row)
    return table
