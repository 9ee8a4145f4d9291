"""What a measurement says: one table for the terminal and for Markdown, plain numbers for JSON and CSV."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

from scla_mj.errors import SclaError

ONE_REPETITION: Final = "a single repetition allows no verdict; take more."
BOUND_ABOVE: Final = "noise: a part costs more than the whole that contains it; measure again on a quiet machine."
_VERDICT: Final = re.compile(r"(?<= )(?:met|missed)$")


class Sheet(NamedTuple):
    """One table. `key` names it in files; `rows` are as they are shown; `values` are the same figures as numbers."""

    key: str
    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str
    values: dict[str, float]


def markdown(sheet: Sheet) -> str:
    """Return the table as GitHub's Markdown, under its title and with its note."""
    ruler = ["---"] + ["---:"] * (len(sheet.header) - 1)
    lines = [_line(sheet.header), _line(tuple(ruler)), *(_line(row) for row in sheet.rows)]
    return "\n".join([f"**{sheet.title}**", "", *lines, "", sheet.note, ""])


def comma_separated(sheet: Sheet) -> str:
    """Return the table as CSV."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([sheet.header, *sheet.rows])
    return text.getvalue()


def replace_tables(text: str, sheets: Sequence[Sheet], *, machine: str) -> str:
    """Return a Markdown page with these tables, each between its `<!-- bench: KEY -->` and the next `<!-- end -->`.

    Raises:
        SclaError: the page has no such place for one of them.
    """
    require_places(text, [sheet.key for sheet in sheets])
    for sheet in sheets:
        table = f"{markdown(sheet)}\nMeasured on {machine}.\n"
        text = _place(sheet.key).sub(_between(table), text)
    return text


def require_places(text: str, keys: Sequence[str]) -> None:
    """Find on a Markdown page the place of every table that these keys name.

    Raises:
        SclaError: one has none.
    """
    for key in keys:
        if not _place(key).search(text):
            raise SclaError(f"the page has no line <!-- bench: {key} --> with <!-- end --> behind it")


def against(value: float, target: float, *, at_least: bool = False) -> str:
    """Say whether a figure reaches its target."""
    reached = value >= target if at_least else value <= target
    return f"{'≥' if at_least else '≤'} {target:g} {'met' if reached else 'missed'}"


def doubted(sheet: Sheet, why: str, *, row: str | None = None) -> Sheet:
    """Return the table with `?` for its verdicts, or for that of one row, and a note that says why."""
    rows = tuple(
        tuple(_VERDICT.sub("?", cell) for cell in cells) if row in (None, cells[0]) else cells for cells in sheet.rows
    )
    return sheet._replace(rows=rows, note=f"{sheet.note} ?: {why}".strip())


def _place(key: str) -> re.Pattern[str]:
    return re.compile(rf"(<!-- bench: {re.escape(key)} -->\n).*?(<!-- end -->)", re.DOTALL)


def _between(table: str) -> Callable[[re.Match[str]], str]:
    return lambda match: f"{match[1]}{table}{match[2]}"


def _line(cells: tuple[str, ...]) -> str:
    return "| " + " | ".join(cells) + " |"
