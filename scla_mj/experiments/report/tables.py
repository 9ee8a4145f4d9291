"""A report's tables and figures as data: how a cell reads in print, and how the same rows are written to a CSV."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Final, NamedTuple

from matplotlib.figure import Figure as Chart

from scla_mj.experiments import statistics
from scla_mj.runs.atomic import writing

CSV: Final = "csv"
FIGURES: Final = "figures"
ABSENT: Final = "–"
INTERVAL: Final = f"{100 * statistics.CONFIDENCE:.0f} % interval"
"""The heading of a column of intervals over seeds."""
_MINUS: Final = "−"


class Interval(NamedTuple):
    """A cell with two ends; a CSV gives each its own column."""

    low: float
    high: float


Cell = str | int | float | Interval | None
Row = tuple[Cell, ...]


@dataclass(frozen=True)
class Table:
    """A table, saved as `csv/table-KEY.csv`."""

    key: str
    columns: Mapping[str, int | None]
    """Headings, each with the decimals of its numbers; None for a column of words."""
    rows: Sequence[Row]
    setting: str = ""
    """What ends the caption: protocol, ceiling, seeds and epochs of the runs."""

    @property
    def kind(self) -> str:
        """What the caption calls it."""
        return type(self).__name__

    @property
    def data(self) -> str:
        """The CSV, seen from OUT."""
        return f"{CSV}/{self.kind.lower()}-{self.key}.csv"


@dataclass(frozen=True)
class Figure(Table):
    """A chart, saved as `figures/KEY.png`, and the rows that it shows."""

    _: KW_ONLY
    chart: Chart

    @property
    def picture(self) -> str:
        """The PNG, seen from OUT."""
        return f"{FIGURES}/{self.key}.png"


def measured(values: statistics.Array) -> tuple[float, Interval | None]:
    """Return a mean over seeds (seeds,) and its interval as two cells; None for a single seed."""
    mean = statistics.estimate(values)
    return mean.mean, None if math.isnan(mean.low) else Interval(mean.low, mean.high)


def span_text(first: int, last: int) -> str:
    """Return epochs as a table prints them."""
    return str(first) if first == last else f"{first}–{last}"


def shown(cell: Cell, decimals: int | None) -> str:
    """Return a cell as a reader sees it."""
    match cell:
        case None:
            return ABSENT
        case str():
            return cell
        case Interval():
            ends = f"[{number(cell.low, decimals)}, {number(cell.high, decimals)}]"
            return ABSENT if math.isnan(cell.low) else ends
        case _:
            return number(cell, decimals)


def number(value: float, decimals: int | None = None) -> str:
    """Return a number with a fixed count of digits; one too small for them is said to be below their last."""
    if math.isnan(value):
        return ABSENT
    if math.isinf(value):
        return "∞" if value > 0 else f"{_MINUS}∞"
    if decimals is None:
        return f"{value:g}".replace("-", _MINUS)
    least = 10.0**-decimals
    if 0.0 < value < least / 2:
        return f"<{least:.{decimals}f}"
    text = f"{value:.{decimals}f}"
    return text.lstrip("-") if float(text) == 0.0 else text.replace("-", _MINUS)


def write_csv(path: Path, table: Table) -> None:
    """Write the rows in full precision; an interval takes two columns, what is absent stays empty.

    Raises:
        SclaError: the file cannot be written.
    """
    wide = [any(isinstance(row[index], Interval) for row in table.rows) for index in range(len(table.columns))]
    heading: list[str] = []
    for name, split in zip(table.columns, wide, strict=True):
        heading += [f"{name} low", f"{name} high"] if split else [name]
    with writing(path, folder="OUT"), path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(heading)
        writer.writerows(_flat(row, wide) for row in table.rows)


def _flat(row: Row, wide: Sequence[bool]) -> list[str]:
    fields: list[str] = []
    for cell, split in zip(row, wide, strict=True):
        ends = tuple(cell) if isinstance(cell, Interval) else (cell, None) if split else (cell,)
        fields += [_field(end) for end in ends]
    return fields


def _field(cell: str | float | None) -> str:
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return ""
    return repr(float(cell)) if isinstance(cell, float) else str(cell)
