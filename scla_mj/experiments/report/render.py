"""The template filled in as Markdown, and the Markdown as one HTML page that needs nothing else.

Values are text: the template's own words are Markdown, whatever it prints of a run or an experiment is escaped.
"""

from __future__ import annotations

import html
import io
import re
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib import resources
from string import Template
from typing import Any, Final

from jinja2 import Environment, FunctionLoader, StrictUndefined
from markdown_it import MarkdownIt
from markdown_it.tree import SyntaxTreeNode
from markupsafe import Markup

from scla_mj.experiments.report.coverage import in_catalogue
from scla_mj.experiments.report.tables import Figure, Table, number, shown
from scla_mj.experiments.report.wording import mean_text, seeds_text
from scla_mj.runs import drawing

_MARKDOWN: Final = MarkdownIt("commonmark", {"html": False}).enable("table")
_SPECIAL: Final = re.compile(r"([\\`*_\[\]<>|~#&])")
_THEMED: Final = {drawing.INK: "var(--ink)", drawing.SOFT: "var(--soft)", drawing.RULE: "var(--rule)"}
"""A chart's neutral colours follow the page's, light or dark."""
_VERDICTS: Final = {"reached": "good", "missed": "bad", "not judged": "open", "not measured": "open"}
_ROWS_SHOWN: Final = 50
"""A longer table is folded away in HTML until asked for."""


def render_markdown(contents: Mapping[str, Any]) -> tuple[str, list[Table]]:
    """Return the report (GitHub's Markdown, figures linked as PNG), and the tables and figures in its order."""
    seen: list[Table] = []

    def show(table: Table, caller: Callable[[], str]) -> Markup:
        """Number a table or figure, under the caption that the template gives it."""
        label = f"{table.kind} {1 + sum(each.kind == table.kind for each in seen)}"
        seen.append(table)
        caption = f"{caller().strip()}\n{escape(table.setting)}".strip()
        if isinstance(table, Figure):
            return Markup(f"\n![{label}: {caption.splitlines()[0]}]({table.picture})\n\n**{label}.** {caption}\n")
        return Markup(f"\n**{label}.** {caption}\n\n{markdown_rows(table)}\n")

    text = _environment().get_template("report.md.j2").render(contents, show=show)
    return _tidy(text), seen


def render_ladder(contents: Mapping[str, Any]) -> str:
    """Return the table of the ladder and the claims made of it, as Markdown that can stand in another page."""
    return _tidy(
        _environment().get_template("ladder.md.j2").render(contents, rows=lambda table: Markup(markdown_rows(table)))
    )


def _tidy(text: str) -> str:
    return re.sub(r"\n{3,}", "\n\n", text).strip() + "\n"


def _environment() -> Environment:
    environment = Environment(
        undefined=StrictUndefined, finalize=escape, autoescape=True, trim_blocks=True, lstrip_blocks=True,
        loader=FunctionLoader(_read),
    )  # fmt: skip
    environment.filters |= {
        "fixed": number,
        "capital": lambda title: title[:1].upper() + title[1:],
        "code": lambda text: Markup(_line(text)),
        "mean_text": mean_text,
        "seeds_text": seeds_text,
        "in_catalogue": in_catalogue,
    }
    return environment


def escape(value: object) -> Markup:
    """Return a value in one line, such that Markdown shows it as it is; Markdown already, as of a macro, stays."""
    if isinstance(value, Markup):
        return value
    return Markup(_SPECIAL.sub(r"\\\1", _line(number(value) if isinstance(value, float) else str(value))))


def _line(text: str) -> str:
    return re.sub(r"[\r\n]+", " ", text)


def _read(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")


def markdown_rows(table: Table) -> str:
    """Return a table as GitHub's Markdown."""
    decimals = table.columns.values()
    lines: list[Sequence[str]] = [list(map(escape, table.columns)), ["---" if n is None else "---:" for n in decimals]]
    lines += [[escape(shown(*pair)) for pair in zip(row, decimals, strict=True)] for row in table.rows]
    return "\n".join(f"| {' | '.join(fields)} |" for fields in lines)


def render_html(text: str, figures: Sequence[Figure]) -> str:
    """Return the Markdown as a page: style and charts inside, no script, nothing to fetch."""
    nodes = SyntaxTreeNode(_MARKDOWN.parse(text)).children
    for node in nodes:
        if node.type == "heading" and node.nester_tokens:
            node.nester_tokens.opening.attrSet("id", _slug(node))
    title, *chapters = (node.children[0] for node in nodes if node.type == "heading")
    contents = [f'<li><a href="#{_slug(name.parent)}">{_html(name)}</a></li>' for name in chapters if name.parent]
    return Template(_read("page.html")).substitute(
        title=_html(title),
        style=_read("page.css").strip(),
        contents="\n".join(contents),
        body="".join(_blocks(nodes, {figure.picture: figure for figure in figures})),
    )


def _blocks(nodes: Sequence[SyntaxTreeNode], figures: Mapping[str, Figure]) -> Iterator[str]:
    """Yield every block, a chart or a table together with its caption."""
    waiting = deque(nodes)
    while waiting:
        node = waiting.popleft()
        if node.type == "paragraph" and (image := node.children[0].children[0]).type == "image":
            words = "".join(part.content for part in image.children)
            chart, caption = _svg(figures[str(image.attrs["src"])], words), waiting.popleft().children[0]
            yield f'<figure class="chart">\n{chart}\n<figcaption>{_html(caption)}</figcaption>\n</figure>\n'
        elif node.type == "paragraph" and waiting and waiting[0].type == "table":
            caption, table = node.children[0], _table(waiting.popleft())
            yield f'<figure class="table">\n<figcaption>{_html(caption)}</figcaption>\n{table}</figure>\n'
        else:
            yield _html(node)


def _html(node: SyntaxTreeNode) -> str:
    return str(_MARKDOWN.renderer.render(node.to_tokens(), _MARKDOWN.options, {}))


def _table(node: SyntaxTreeNode) -> str:
    grid = f'<div class="scroll">{_html(node)}</div>\n'
    for verdict, kind in _VERDICTS.items():
        grid = grid.replace(f"<td>{verdict}</td>", f'<td><span class="mark {kind}">{verdict}</span></td>')
    count = sum(len(part.children) for part in node.children if part.type == "tbody")
    return grid if count <= _ROWS_SHOWN else f"<details><summary>Show all {count} rows</summary>\n{grid}</details>\n"


def _slug(heading: SyntaxTreeNode) -> str:
    return re.sub(r"\W+", "-", heading.children[0].content.lower()).strip("-")


def _svg(figure: Figure, description: str) -> str:
    """Return the chart as inline SVG whose names are its own on the page and whose neutrals follow the page's."""
    buffer = io.StringIO()
    drawing.save(figure.chart, buffer, kind="svg", salt=figure.key)
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.DOTALL)
    text = re.sub(r'\b(id="|href="#|url\(#)', rf"\g<1>{figure.key}-", text)
    for colour, variable in _THEMED.items():
        text = text.replace(colour, variable)
    return text.replace("<svg", f'<svg role="img" aria-label="{html.escape(description)}"', 1)
