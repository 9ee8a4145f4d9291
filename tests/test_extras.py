"""Extras: the table of the refusals is that of pyproject.toml."""

import re
import tomllib
from pathlib import Path

import pytest

from scla_mj import extras
from scla_mj.errors import SclaError

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = {
    name: {re.match(r"[\w-]+", line)[0].lower() for line in lines}
    for name, lines in PROJECT["optional-dependencies"].items()
}


def test_every_library_is_brought_by_the_extra_that_its_refusal_names():
    assert {name: extra for name, extra in extras.EXTRA_OF.items() if name.replace("_", "-") not in EXTRAS[extra]} == {}
    assert set(EXTRAS) - set(extras.EXTRA_OF.values()) <= {"dev", "docs", "sb3"}


def test_the_quickstart_says_what_every_extra_is_for():
    page = (ROOT / "docs" / "quickstart.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| `(\w+)` \|", page, re.M)) == set(EXTRAS) - {"dev"}


@pytest.mark.parametrize(
    ("version", "line"),
    [
        ((3, 12), "pip install 'scla-mj[dm]'"),
        ((3, 13), "pip install 'scla-mj[dm]' && pip install --no-deps dm-control==1.0.50"),
    ],
)
def test_where_labmaze_has_no_wheels_the_line_goes_round_it(version, line, monkeypatch):
    monkeypatch.setattr("sys.version_info", version)
    assert extras.install_line("dm") == line
    assert line.endswith(EXTRAS_DM) if version == (3, 13) else "python_version < '3.13'" in PIN


PIN = next(line for line in PROJECT["dependencies"] if line.startswith("dm-control"))
EXTRAS_DM = PIN.partition(" ")[0]


def test_a_library_that_is_not_there_is_refused_with_the_line_that_installs_it(monkeypatch):
    monkeypatch.setitem(extras.EXTRA_OF, "nosuchlibrary", "gym")
    with pytest.raises(SclaError, match=r"^a picture needs nosuchlibrary, .*: run pip install 'scla-mj\[gym\]'$"):
        extras.need("nosuchlibrary", "a picture")
