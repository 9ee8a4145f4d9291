"""The site: docs/*.md as they are, and pages of its own: index.rst, api.rst, run.md; .ci/run builds it."""

import re
from typing import Any

import scla_mj

project, author, version = "scla_mj", "the scla_mj authors", scla_mj.__version__
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode"]
exclude_patterns = ["results/ladder.md", "learners/*.md"]  # parts of other pages
nb_execution_mode = "off"  # as it was stored
html_theme = "furo"
html_title = f"scla_mj {version}"
html_copy_source = False
myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]
default_role = "code"
autodoc_typehints = "signature"
autodoc_default_options = {"members": True, "show-inheritance": False, "imported-members": True}
autodoc_member_order = "groupwise"
napoleon_use_ivar = True
napoleon_use_param = False
napoleon_use_rtype = False


def _tables(lines: list[str]) -> list[str]:
    """Return a docstring's lines with Markdown's tables as reStructuredText's."""
    out: list[str] = []
    for line in lines:
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if not line.lstrip().startswith("|"):
            out.append(line)
        elif not all(re.fullmatch(r":?-+:?", cell) for cell in cells):
            indent = " " * (len(line) - len(line.lstrip()))
            if not out or not out[-1].startswith(f"{indent}   "):
                out += ["", f"{indent}.. list-table::", f"{indent}   :header-rows: 1", ""]
            out += [f"{indent}   {'* -' if not n else '  -'} {cell}" for n, cell in enumerate(cells)]
    return out


def _docstring(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    if lines[0].startswith("Alias for field number"):  # namedtuple's own; the class says what it is
        lines.clear()
    lines[:] = [re.sub(r"-\*| \*=", lambda star: star[0].replace("*", r"\*"), line) for line in _tables(lines)]


def _page(app: Any, name: str, text: list[str]) -> None:
    text[0] = text[0].replace("](../README.md#what-a-run-contains)", "](run.md)")


def setup(app: Any) -> None:
    """Connect what this file adds."""
    app.connect("autodoc-process-docstring", _docstring, priority=100)
    app.connect("source-read", _page)
