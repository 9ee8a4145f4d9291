"""What a measurement says: one table for the terminal and for Markdown, plain numbers for JSON and CSV."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Sequence
from typing import NamedTuple

from scla_mj.errors import SclaError


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
    for sheet in sheets:
        place = re.compile(rf"(<!-- bench: {re.escape(sheet.key)} -->\n).*?(<!-- end -->)", re.DOTALL)
        table = f"{markdown(sheet)}\nMeasured on {machine}.\n"
        text, found = place.subn(_between(table), text)
        if not found:
            raise SclaError(f"the page has no line <!-- bench: {sheet.key} --> with <!-- end --> behind it")
    return text


def against(value: float, target: float, *, at_least: bool = False) -> str:
    """Say whether a figure reaches its target."""
    reached = value >= target if at_least else value <= target
    return f"{'≥' if at_least else '≤'} {target:g} {'met' if reached else 'missed'}"


def _between(table: str) -> Callable[[re.Match[str]], str]:
    return lambda match: f"{match[1]}{table}{match[2]}"


def _line(cells: tuple[str, ...]) -> str:
    return "| " + " | ".join(cells) + " |"
