"""How a table's cells read: one number of digits a column, one sign for what is not there."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from scla_mj.errors import SclaError, remedy
from scla_mj.experiments.report.document import Cell, Column, Interval, Mark

ABSENT: Final = "–"
INFINITE: Final = "∞"
_MINUS: Final = "−"


def shown(cell: Cell, column: Column) -> str:
    """Return a cell as a reader sees it."""
    if cell is None:
        return ABSENT
    if isinstance(cell, str):
        return cell
    if isinstance(cell, Mark):
        return cell.text
    if isinstance(cell, Interval):
        if math.isnan(cell.low):
            return ABSENT
        return f"[{number(cell.low, column.decimals)}, {number(cell.high, column.decimals)}]"
    return number(cell, column.decimals)


def number(value: float, decimals: int | None) -> str:
    """Return a number with a fixed count of digits; one too small for them is said to be below their last."""
    if math.isnan(value):
        return ABSENT
    if math.isinf(value):
        return INFINITE if value > 0 else _MINUS + INFINITE
    if decimals is None:
        return f"{value:g}".replace("-", _MINUS)
    least = 10.0**-decimals
    if 0.0 < value < least / 2:
        return f"<{least:.{decimals}f}"
    text = f"{value:.{decimals}f}"
    return text.lstrip("-") if float(text) == 0.0 else text.replace("-", _MINUS)


def write_csv(path: Path, columns: tuple[Column, ...], rows: Iterable[tuple[Cell, ...]]) -> None:
    """Write a table's data in full precision; an interval takes two columns, what is not there stays empty.

    Raises:
        SclaError: the file cannot be written.
    """
    rows = list(rows)
    wide = [any(isinstance(row[index], Interval) for row in rows) for index in range(len(columns))]
    heading: list[str] = []
    for column, split in zip(columns, wide, strict=True):
        heading += [f"{column.heading} {end}" for end in ("low", "high")] if split else [column.heading]
    try:
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(heading)
            writer.writerows(_flat(row, wide) for row in rows)
    except OSError as error:
        raise SclaError(f"cannot write {path}: {error.strerror or error}; {remedy(error, folder='OUT')}") from error


def _flat(row: tuple[Cell, ...], wide: list[bool]) -> list[str]:
    fields: list[str] = []
    for cell, split in zip(row, wide, strict=True):
        ends = (cell.low, cell.high) if isinstance(cell, Interval) else (cell, None) if split else (cell,)
        fields += [_field(end) for end in ends]
    return fields


def _field(cell: Cell) -> str:
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return ""
    return cell.text if isinstance(cell, Mark) else repr(float(cell)) if isinstance(cell, float) else str(cell)
