"""What a bench cannot measure or write is refused in one sentence before it measures anything."""

import inspect
import re
import sys
from pathlib import Path

import pytest

from benchmarks import peers_race, suites, table
from benchmarks.command import Bench
from benchmarks.peers import INSTALL, MODULES
from scla_mj.cli.main import main
from scla_mj.errors import SclaError

PAGE = Path(__file__).parents[2] / "docs" / "performance.md"


@pytest.fixture
def refused(monkeypatch, capsys):
    """Return the one sentence of a bad call; a suite that is run all the same fails the test."""

    def measured(*_):
        raise AssertionError("the bench measured before it refused")

    monkeypatch.setattr(suites, "SUITES", {name: suite._replace(run=measured) for name, suite in suites.SUITES.items()})

    def refuse(*options):
        assert main(["bench", *map(str, options)]) == 2
        sentence = capsys.readouterr().err
        assert sentence.startswith("scla-mj: ")
        assert sentence.count("\n") == 1, sentence
        return sentence

    return refuse


def program(file, text):
    """Write an executable script."""
    file.write_text(text)
    file.chmod(0o755)
    return file


def test_an_interpreter_that_is_no_python_is_refused_with_the_line_that_makes_one(refused, tmp_path):
    echo = program(tmp_path / "echo", '#!/bin/sh\necho "$@"\n')
    for wrong in ("/bin/true", "/bin/false", echo):
        sentence = refused("--peers", wrong)
        assert f"--peers {wrong} is not a Python" in sentence
        assert INSTALL in sentence
    assert "--peers has no value" in refused("--peers", "")
    assert "is not a file" in refused("--peers", tmp_path)


def test_an_interpreter_without_the_packages_is_refused_by_their_names(refused, tmp_path):
    bare = program(tmp_path / "python", f'#!/bin/sh\nexec "{sys.executable}" -S -E "$@"\n')
    sentence = refused("--peers", bare)
    assert f"lacks {', '.join(MODULES)}:" in sentence
    assert INSTALL in sentence


def test_a_worker_that_ends_without_a_result_is_reported_in_a_sentence(tmp_path):
    with pytest.raises(SclaError, match="ended early: it said nothing"):
        peers_race.run_to_the_end(Path("/bin/true"), "numpy", tmp_path / "job.npz", tmp_path / "result.npz")


def test_a_file_or_folder_that_cannot_be_written_is_refused(refused, tmp_path):
    (tmp_path / "file").write_text("mine")
    assert "is not a folder" in refused("--json", tmp_path / "nowhere" / "y.json")
    assert "is a file, not a folder" in refused("--json", tmp_path / "file" / "y.json")
    assert "--json has no value" in refused("--json", "")
    assert "is a file" in refused("--out", tmp_path / "file")
    assert "is a file" in refused("--out", tmp_path / "file" / "below")
    assert {path.name for path in tmp_path.iterdir()} == {"file"}


def test_a_folder_that_may_not_be_written_to_is_refused(refused, tmp_path, monkeypatch):
    monkeypatch.setattr("os.access", lambda *_: False)  # a superuser may write anywhere
    for option, value in (("--json", tmp_path / "y.json"), ("--out", tmp_path / "new"), ("--into", PAGE)):
        assert "may not be written to" in refused(option, value)


def test_a_page_without_a_place_for_every_table_of_the_suite_is_refused(refused, tmp_path):
    page = tmp_path / "page.md"
    page.write_text("<!-- bench: long -->\n<!-- end -->\n")
    assert "no line <!-- bench: seeds -->" in refused("--long", "--seeds", "--into", page)
    page.write_bytes(b"\xff\xfe")
    assert "UTF-8" in refused("--into", page)
    table.require_places(PAGE.read_text(encoding="utf-8"), suites.SUITES["rollout"].keys)


def test_no_suite_that_needs_the_network_takes_another_brain(refused):
    for suite in ("--growth", "--long"):
        assert "--brain random has no network" in refused(suite, "--brain", "random")
    assert "without delay" in refused("--growth", "--plasticity.dopamine-delay-s", "0.1")


def test_the_help_and_the_page_name_the_same_minutes():
    written = inspect.getsource(Bench)  # the help is made of its docstrings, in columns
    listed = re.findall(r"^\| `scla-mj bench.*\| (\d+) minutes? \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert len(listed) == len(suites.SUITES)
    assert re.findall(r"\((\d+) minutes?\)", written) == listed
