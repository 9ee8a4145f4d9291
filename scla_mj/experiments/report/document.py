"""A report as data: sections of paragraphs, tables and figures. HTML and Markdown are two ways to write it down."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from matplotlib.figure import Figure as Chart


class Code(NamedTuple):
    """Words to set as code."""

    text: str


class Strong(NamedTuple):
    """Words to stress."""

    text: str


Inline = str | Code | Strong
Text = str | tuple[Inline, ...]


class Interval(NamedTuple):
    """A cell that holds two ends; a table's file gives each its own column."""

    low: float
    high: float


class Mark(NamedTuple):
    """A cell that judges: `kind` is "good", "bad" or "open"."""

    text: str
    kind: str


Cell = str | int | float | Interval | Mark | None


class Column(NamedTuple):
    """A table's column: numbers with `decimals` digits after the point, aligned on it; None for words."""

    heading: str
    decimals: int | None = None


@dataclass(frozen=True)
class Paragraph:
    """Running text."""

    text: Text


@dataclass(frozen=True)
class Bullets:
    """A list."""

    items: tuple[Text, ...]


@dataclass(frozen=True)
class Listing:
    """Text to copy: a command."""

    text: str


@dataclass(frozen=True)
class Table:
    """A table; `key` names its file, `caption` says what was measured and how."""

    key: str
    caption: Text
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    long: bool = False
    """Folded away in HTML until asked for."""


@dataclass(frozen=True)
class Figure:
    """A chart with the data that it shows; `key` names its files."""

    key: str
    caption: Text
    chart: Chart
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]


Block = Paragraph | Bullets | Listing | Table | Figure


@dataclass(frozen=True)
class Section:
    """A chapter; `key` is its anchor."""

    key: str
    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Document:
    """The whole report."""

    title: str
    lead: Text
    sections: tuple[Section, ...]

    def blocks(self) -> Iterator[Block]:
        """Every block, in order."""
        for section in self.sections:
            yield from section.blocks

    def numbers(self) -> dict[str, str]:
        """Return the label of every table and figure by its key: Table 1, Table 2, Figure 1."""
        labels: dict[str, str] = {}
        for kind in (Table, Figure):
            keys = [block.key for block in self.blocks() if isinstance(block, kind)]
            labels |= {f"{kind.__name__}:{key}": f"{kind.__name__} {number}" for number, key in enumerate(keys, 1)}
        return labels


def inlines(text: Text) -> tuple[Inline, ...]:
    """Return a text as its pieces."""
    return (text,) if isinstance(text, str) else text


def plain(text: Text) -> str:
    """Return a text without its markup."""
    return "".join(piece if isinstance(piece, str) else piece.text for piece in inlines(text))
