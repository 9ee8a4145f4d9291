"""docs/extending.md: every code block of it runs, in the order of its section."""

import importlib
import re
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[1] / "docs" / "extending.md").read_text(encoding="utf-8")
SECTIONS = {text.split("\n", 1)[0]: text for text in PAGE.split("\n## ")[1:]}
A_SCREEN = 80


@pytest.mark.parametrize("title", SECTIONS)
def test_a_section_runs_as_it_stands(title, tmp_path, monkeypatch):
    blocks = re.findall(r"```python\n(.*?)```", SECTIONS[title], re.DOTALL)
    assert blocks
    name = "extending_" + re.sub(r"\W+", "_", title.lower())
    (tmp_path / f"{name}.py").write_text("\n\n".join(blocks), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    importlib.import_module(name)


@pytest.mark.parametrize("title", SECTIONS)
def test_a_section_is_a_page_of_a_screen(title):
    assert len(SECTIONS[title].splitlines()) <= A_SCREEN
