"""README and docs: what they name in the checkout is there."""

import re
from pathlib import Path

import pytest

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


def headings(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as GitHub makes them."""
    found = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading).lower().replace(" ", "-") for heading in found}
