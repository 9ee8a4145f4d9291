"""README and docs: what they name in the checkout is there."""

import re
import shlex
from pathlib import Path

import pytest

from scla_mj.cli.main import COMMANDS
from scla_mj.cli.options import parse

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]
AN_ENVIRONMENT = re.compile(r"scla_mj/\w+-v\d+")
TO_BE_WRITTEN = {"scla_mj/telemetry/views/pace.py"}  # by the reader of docs/extending.md


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_relative_link_leads_somewhere(page):
    text = page.read_text(encoding="utf-8")
    links = [link for link in re.findall(r"\]\(([^)\s]+)\)", text) if "://" not in link]
    for path, _, heading in (link.partition("#") for link in links):
        target = page.parent / path if path else page
        assert target.exists(), f"{page.name} links to {path}"
        if heading:
            assert heading in headings(target), f"{page.name} links to {path}#{heading}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_path_that_a_page_names_exists(page):
    named = re.findall(
        r"\b(?:scla_mj|tests|benchmarks|docs|scripts|assets)/[\w./*-]*\w", page.read_text(encoding="utf-8")
    )
    files = [path for path in named if path not in TO_BE_WRITTEN and not AN_ENVIRONMENT.fullmatch(path)]
    assert [path for path in files if not any(ROOT.glob(path))] == []


RUN_BY = {
    "README.md": "tests/test_api.py",
    "bridge.md": "tests/brain/test_bridge.py",
    "environments.md": "tests/test_api.py",
    "extending.md": "tests/test_extending.py",
    "network.md": "tests/test_api.py",
    "own-brain.md": "tests/brain/test_brains.py",
    "python.md": "tests/test_api.py",
    "quickstart.md": "tests/test_api.py",
    "sweeps.md": "tests/experiments/test_sweeps.py",
}
"""Where the programs of each page are run."""


def test_every_program_of_every_page_is_run_or_says_why_not():
    running = {page.name for page in PAGES if re.search(r"(?<!-->\n)```python\n", page.read_text(encoding="utf-8"))}
    assert running == set(RUN_BY)
    for page, module in RUN_BY.items():
        assert page in (ROOT / module).read_text(encoding="utf-8").replace('" / "', "/")
    for page in PAGES:
        for mark in re.findall(r"<!-- (.*?) -->\n```", page.read_text(encoding="utf-8")):
            assert re.match(r"ci: |not run: \w+", mark)


def test_every_command_of_every_page_is_one_that_the_command_line_takes():
    lines = {line for page in PAGES for line in re.findall(r"^(?: {4})?scla-mj (.+)$", page.read_text("utf-8"), re.M)}
    wanted = [
        line for line in sorted(lines) if not {"[", "--help", "--config", "...", "bench"} & {*line, *line.split()}
    ]
    assert len(wanted) > 20
    for line in wanted:
        parse(COMMANDS, shlex.split(line, comments=True), prog="scla-mj")


def test_the_site_has_every_page():
    listed = set(re.findall(r"^   ([\w/-]+)$", (ROOT / "docs" / "index.rst").read_text(encoding="utf-8"), re.M))
    assert {page.stem for page in PAGES if page.parent.name == "docs"} <= listed, "name the page in docs/index.rst"


def headings(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as GitHub makes them."""
    found = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading).lower().replace(" ", "-") for heading in found}
