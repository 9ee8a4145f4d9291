"""A document as Markdown (GitHub's), its figures linked as PNG."""

from __future__ import annotations

import re
from typing import Final

from scla_mj.experiments.report.cells import shown
from scla_mj.experiments.report.document import (
    Block,
    Bullets,
    Code,
    Document,
    Figure,
    Inline,
    Listing,
    Paragraph,
    Section,
    Strong,
    Table,
    Text,
    inlines,
    plain,
)
from scla_mj.experiments.report.names import figure_link

_SPECIAL: Final = re.compile(r"([\\`*_\[\]<>|~#])")


def render_markdown(document: Document) -> str:
    """Return the text."""
    labels = document.numbers()
    parts = [f"# {escape(document.title)}", _text(document.lead)]
    parts += [_section(section, labels) for section in document.sections]
    return "\n\n".join(parts) + "\n"


def escape(text: str) -> str:
    """Return words such that Markdown shows them as they are."""
    return _SPECIAL.sub(r"\\\1", text)


def _section(section: Section, labels: dict[str, str]) -> str:
    return "\n\n".join([f"## {escape(section.title)}", *(_block(block, labels) for block in section.blocks)])


def _block(block: Block, labels: dict[str, str]) -> str:
    match block:
        case Paragraph():
            return _text(block.text)
        case Bullets():
            return "\n".join(f"- {_text(item)}" for item in block.items)
        case Listing():
            return f"```sh\n{block.text}\n```"
        case Table():
            return f"**{labels[f'Table:{block.key}']}.** {_text(block.caption)}\n\n{_table(block)}"
        case Figure():
            label = labels[f"Figure:{block.key}"]
            return f"![{escape(plain(block.caption))}]({figure_link(block.key)})\n\n**{label}.** {_text(block.caption)}"


def _table(table: Table) -> str:
    heads = [escape(column.heading) for column in table.columns]
    rules = ["---" if column.decimals is None else "---:" for column in table.columns]
    rows = [
        [escape(shown(cell, column)) for cell, column in zip(row, table.columns, strict=True)] for row in table.rows
    ]
    return "\n".join(f"| {' | '.join(fields)} |" for fields in [heads, rules, *rows])


def _text(text: Text) -> str:
    return "".join(_inline(piece) for piece in inlines(text))


def _inline(piece: Inline) -> str:
    match piece:
        case Code():
            return f"`{piece.text.replace('`', chr(39))}`"
        case Strong():
            return f"**{escape(piece.text)}**"
        case _:
            return escape(piece)
