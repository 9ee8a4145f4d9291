"""A document as one HTML page that needs nothing else: style and figures inside, no script, nothing to fetch."""

from __future__ import annotations

import html
import io
import re
from importlib import resources
from string import Template
from typing import Final

from matplotlib.figure import Figure as Chart

from scla_mj.experiments.report import charts
from scla_mj.experiments.report.cells import shown
from scla_mj.experiments.report.document import (
    Block,
    Bullets,
    Cell,
    Code,
    Column,
    Document,
    Figure,
    Inline,
    Interval,
    Listing,
    Mark,
    Paragraph,
    Section,
    Strong,
    Table,
    Text,
    inlines,
    plain,
)

_THEMED: Final = {charts.INK: "var(--ink)", charts.SOFT: "var(--soft)", charts.RULE: "var(--rule)"}
"""A chart's neutral colours follow the page's, light or dark."""


def render_html(document: Document) -> str:
    """Return the page."""
    labels = document.numbers()
    style, page = (_template(name) for name in ("page.css", "page.html"))
    return Template(page).substitute(
        title=html.escape(document.title),
        style=style.strip(),
        lead=_text(document.lead),
        contents="\n".join(
            f'<li><a href="#{section.key}">{html.escape(section.title)}</a></li>' for section in document.sections
        ),
        body="\n".join(_section(section, labels) for section in document.sections),
    )


def _template(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")


def _section(section: Section, labels: dict[str, str]) -> str:
    blocks = "\n".join(_block(block, labels) for block in section.blocks)
    return f'<section id="{section.key}">\n<h2>{html.escape(section.title)}</h2>\n{blocks}\n</section>'


def _block(block: Block, labels: dict[str, str]) -> str:
    match block:
        case Paragraph():
            return f"<p>{_text(block.text)}</p>"
        case Bullets():
            return "<ul>" + "".join(f"<li>{_text(item)}</li>" for item in block.items) + "</ul>"
        case Listing():
            return f"<pre><code>{html.escape(block.text)}</code></pre>"
        case Table():
            return _table(block, labels[f"Table:{block.key}"])
        case Figure():
            caption = _caption(block.caption, labels[f"Figure:{block.key}"])
            picture = _svg(block.chart, block.key, plain(block.caption))
            return f'<figure class="chart" id="figure-{block.key}">\n{picture}\n{caption}\n</figure>'


def _table(table: Table, label: str) -> str:
    numeric = [_is_numeric(column, [row[index] for row in table.rows]) for index, column in enumerate(table.columns)]
    heads = "".join(
        f"<th{_numeric_class(right)}>{html.escape(column.heading)}</th>"
        for column, right in zip(table.columns, numeric, strict=True)
    )
    rows = "\n".join("<tr>" + "".join(map(_cell, row, table.columns, numeric)) + "</tr>" for row in table.rows)
    grid = f'<div class="scroll"><table>\n<thead><tr>{heads}</tr></thead>\n<tbody>\n{rows}\n</tbody>\n</table></div>'
    if table.long:
        grid = f"<details><summary>Show all {len(table.rows)} rows</summary>\n{grid}\n</details>"
    return f'<figure class="table" id="table-{table.key}">\n{_caption(table.caption, label)}\n{grid}\n</figure>'


def _is_numeric(column: Column, cells: list[Cell]) -> bool:
    return column.decimals is not None or any(isinstance(cell, int | float | Interval) for cell in cells)


def _numeric_class(right: bool) -> str:
    return ' class="n"' if right else ""


def _cell(cell: Cell, column: Column, right: bool) -> str:
    text = html.escape(shown(cell, column))
    if isinstance(cell, Mark):
        text = f'<span class="mark {cell.kind}">{text}</span>'
    return f"<td{_numeric_class(right)}>{text}</td>"


def _caption(text: Text, label: str) -> str:
    return f"<figcaption><b>{label}.</b> {_text(text)}</figcaption>"


def _text(text: Text) -> str:
    return "".join(_inline(piece) for piece in inlines(text))


def _inline(piece: Inline) -> str:
    match piece:
        case Code():
            return f"<code>{html.escape(piece.text)}</code>"
        case Strong():
            return f"<strong>{html.escape(piece.text)}</strong>"
        case _:
            return html.escape(piece)


def _svg(chart: Chart, key: str, description: str) -> str:
    """Return the chart as inline SVG whose names are its own on the page and whose neutrals follow the page's."""
    buffer = io.StringIO()
    charts.save(chart, buffer, kind="svg", salt=key)
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.DOTALL)
    text = re.sub(r'\b(id="|href="#|url\(#)', rf"\g<1>{key}-", text)
    for colour, variable in _THEMED.items():
        text = text.replace(colour, variable)
    return text.replace("<svg", f'<svg role="img" aria-label="{html.escape(description)}"', 1)
