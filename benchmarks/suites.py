"""Which measurements belong together, what they write, and how often they tick: one suite a command."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable
from pathlib import Path
from typing import Final, NamedTuple

from benchmarks import charts, described, fleets, growth, kernel_parts, moves, peers_race, processes, rollouts
from benchmarks.crosscheck import CHECKS
from benchmarks.preflight import require_folder
from benchmarks.table import ONE_REPETITION, Sheet, comma_separated, doubted
from benchmarks.timing import Watch
from scla_mj.config import RunConfig
from scla_mj.errors import SclaError

_STARTS_AT_MOST: Final = 3
_TIMED: Final = ("rollout", "network", "move", "start", "neurons", "arenas", "seeds", "peers", "described", "gpu")
"""The tables whose figures are medians over the repetitions; the others count bytes, or repeat in their own way."""


class Order(NamedTuple):
    """What to measure with: the run's settings, the repetitions, the peers' python where one was named."""

    config: RunConfig
    repetitions: int
    peers: Path | None


class Result(NamedTuple):
    """The tables, and by file name what draws a picture of them."""

    sheets: list[Sheet]
    pictures: dict[str, Callable[[Path], None]]


class Suite(NamedTuple):
    """`keys`: of its tables. `pictures`: their file names. `ticks`: how often `run` calls its watch."""

    keys: tuple[str, ...]
    pictures: tuple[str, ...]
    ticks: Callable[[Order], int]
    run: Callable[[Order, Watch], Result]


def _rollout(order: Order, watch: Watch) -> Result:
    config, repetitions = order.config, order.repetitions
    sheets = rollouts.sheets(rollouts.measure(config, repetitions=repetitions, watch=watch))
    sheets.append(kernel_parts.sheet(kernel_parts.measure(config, repetitions=repetitions, watch=watch)))
    sheets.append(moves.measure(config, repetitions=repetitions, watch=watch))
    sheets.append(processes.start_up(repetitions=min(repetitions, _STARTS_AT_MOST), watch=watch))
    return Result(sheets, {})


def _growth(order: Order, watch: Watch) -> Result:
    config, repetitions = order.config, order.repetitions
    neurons, sizes = growth.neurons(config, repetitions=repetitions, watch=watch)
    arenas, edges = growth.arenas(config, repetitions=repetitions, watch=watch)
    pictures: dict[str, Callable[[Path], None]] = {
        "neurons.png": lambda file: charts.draw_neurons(sizes, file),
        "arenas.png": lambda file: charts.draw_arenas(edges, file),
    }
    return Result([neurons, arenas, growth.unrewarded(config, watch=watch)], pictures)


def _long(order: Order, watch: Watch) -> Result:
    return Result([processes.long_run(order.config, watch=watch)], {})


def _seeds(order: Order, watch: Watch) -> Result:
    return Result([processes.two_seeds(order.config, repetitions=order.repetitions, watch=watch)], {})


def _fleets(order: Order, watch: Watch) -> Result:
    return Result(fleets.measure(order.config, repetitions=order.repetitions, watch=watch), {})


def _peers(order: Order, watch: Watch) -> Result:
    assert order.peers is not None
    return Result(peers_race.race(order.config, order.peers, repetitions=order.repetitions, watch=watch), {})


def _described(order: Order, watch: Watch) -> Result:
    return Result([described.measure(order.config, order.peers, repetitions=order.repetitions, watch=watch)], {})


def _gpu(order: Order, watch: Watch) -> Result:
    from benchmarks.gpu import race  # only where the extra `warp` is installed

    return Result([race.measure(order.config, repetitions=order.repetitions, watch=watch)], {})


def _rollout_ticks(order: Order) -> int:
    return 3 * (order.repetitions + 1) + min(order.repetitions, _STARTS_AT_MOST)


SUITES: Final = {
    "rollout": Suite(("rollout", "recording", "network", "move", "start"), (), _rollout_ticks, _rollout),
    "growth": Suite(
        ("neurons", "arenas", "unrewarded"),
        ("neurons.png", "arenas.png"),
        lambda order: 2 * (order.repetitions + 1) + growth.HOUR_S // 60 + 1,
        _growth,
    ),
    "long": Suite(("long",), (), lambda _: 3, _long),
    "seeds": Suite(("seeds",), (), lambda order: order.repetitions, _seeds),
    "fleets": Suite(("fleets", "cores"), (), lambda _: 3, _fleets),
    "described": Suite(("described",), (), lambda order: order.repetitions + 1, _described),
    "gpu": Suite(("gpu",), (), lambda _: 3, _gpu),
    "peers": Suite(
        ("crosscheck", "peers"),
        (),
        lambda order: order.repetitions + 1 + sum(len(check.peers) for check in CHECKS),
        _peers,
    ),
}


def measure(name: str, order: Order, watch: Watch) -> Result:
    """Run a suite; what a single repetition timed is not judged."""
    result = SUITES[name].run(order, watch)
    if order.repetitions > 1:
        return result
    sheets = [doubted(sheet, ONE_REPETITION) if sheet.key in _TIMED else sheet for sheet in result.sheets]
    return result._replace(sheets=sheets)


def files_of(names: list[str]) -> list[str]:
    """Return the names of the files that these suites write."""
    tables = [f"{key}.csv" for name in names for key in SUITES[name].keys]
    return tables + [picture for name in names for picture in SUITES[name].pictures]


def require_room(folder: Path, names: list[str]) -> None:
    """Refuse to write over anything, before anything is measured.

    Raises:
        SclaError: one of the files exists, or the folder is a file or may not be written to.
    """
    require_folder("--out", folder)
    for file in files_of(names):
        if (folder / file).exists():
            raise SclaError(f"{folder / file} exists already: choose another folder")


def write(folder: Path, result: Result) -> None:
    """Write every table as CSV, and the pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    for sheet in result.sheets:
        (folder / f"{sheet.key}.csv").write_text(comma_separated(sheet), encoding="utf-8")
    for name, draw in result.pictures.items():
        draw(folder / name)


def machine() -> str:
    """Name the processor and the number of its cores."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return f"{models[0] if models else platform.machine()}, {os.cpu_count()} cores"
