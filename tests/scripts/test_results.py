"""The committed results: README's table is theirs, and a notice stands where the model's bits have moved on since."""

import importlib.util
import json
import shutil
import sys
from pathlib import Path

import pytest

from scla_mj import RunConfig, rollout, simulate
from scla_mj.errors import SclaError

ROOT = Path(__file__).parents[2]
_SPEC = importlib.util.spec_from_file_location("results", ROOT / "scripts" / "results.py")


@pytest.fixture(scope="module")
def results():
    module = importlib.util.module_from_spec(_SPEC)
    sys.modules["results"] = module  # dataclasses look their module up
    _SPEC.loader.exec_module(module)
    yield module
    del sys.modules["results"]


@pytest.fixture
def root(tmp_path, results):
    """A checkout whose results are of the present bits and of a commit."""
    (tmp_path / "docs" / "results").mkdir(parents=True)
    (tmp_path / "tests").mkdir()
    shutil.copy(ROOT / "tests" / "bits.json", tmp_path / "tests")
    (tmp_path / "README.md").write_text("# A\n\n<!-- results -->\n<!-- /results -->\n\nB\n")
    (tmp_path / "docs" / "results" / "report.md").write_text("# The report\n\n## Summary\n")
    (tmp_path / "docs" / "results" / "ladder.md").write_text("| brain | hits |\n| --- | ---: |\n| a \\| b | 1 |\n")
    where = next(iter(json.loads((ROOT / "tests" / "bits.json").read_text())))
    made_by = {"commit": "abc", "changed": False, "platform": where, "bits": results.bits_digest(tmp_path, where)}
    for folder in ("results", "learners"):
        (tmp_path / "docs" / folder).mkdir(exist_ok=True)
        (tmp_path / "docs" / folder / "made-by.json").write_text(json.dumps(made_by))
    write(results, tmp_path)
    return tmp_path


def write(results, root):
    for path, text in results.texts(root).items():
        path.write_text(text)


def move_bits_on(root):
    file = root / "tests" / "bits.json"
    entries = json.loads(file.read_text())
    for entry in entries.values():
        entry["runs"]["random"]["decided"] = "other"
    file.write_text(json.dumps(entries))


def test_readme_has_the_table_of_the_results_to_the_character_and_the_notice_stands_where_bits_have_moved_on(results):
    for path, text in results.texts(ROOT).items():
        assert path.read_text(encoding="utf-8") == text, f"{path} is out of step: python scripts/results.py"
        assert text.count(results.NOTICE) == (not results.is_current(ROOT))
    ladder = (ROOT / "docs" / "results" / "ladder.md").read_text(encoding="utf-8")
    block = (ROOT / "README.md").read_text(encoding="utf-8").split("<!-- results -->\n")[1]
    assert block.split("<!-- /results -->")[0].removeprefix(f"{results.NOTICE}\n\n") == ladder


def test_results_of_the_present_bits_and_a_commit_can_be_released(results, root):
    assert results.faults(root) == []
    readme = (root / "README.md").read_text()
    assert (
        readme == "# A\n\n<!-- results -->\n| brain | hits |\n| --- | ---: |\n| a \\| b | 1 |\n<!-- /results -->\n\nB\n"
    )
    write(results, root)
    assert (root / "README.md").read_text() == readme


def test_once_bits_have_moved_on_the_notice_is_required_and_nothing_is_released(results, root):
    move_bits_on(root)
    assert len(results.faults(root)) == 4  # README, the report, and the bits of both results
    write(results, root)
    assert (root / "docs/results/report.md").read_text() == f"# The report\n\n{results.NOTICE}\n\n## Summary\n"
    assert results.NOTICE in (root / "README.md").read_text()
    faults = results.faults(root)
    assert [fault.split(" was made with other bits")[0] for fault in faults] == ["docs/results", "docs/learners"]
    shutil.copy(ROOT / "tests" / "bits.json", root / "tests")
    assert len(results.faults(root)) == 2  # the notice must go again
    write(results, root)
    assert results.faults(root) == []


@pytest.mark.parametrize("folder", ["results", "learners"])
@pytest.mark.parametrize("change", [{"commit": "unknown"}, {"changed": True}])
def test_results_that_no_commit_made_are_not_released(results, root, change, folder):
    file = root / "docs" / folder / "made-by.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | change))
    assert results.faults(root) == [f"docs/{folder} was not made by a commit"]


def test_a_report_is_taken_over_whole_once_its_runs_were_made_again(results, root, tmp_path, monkeypatch):
    out = tmp_path / "out"
    config = RunConfig(brain="random", epochs=1, decisions=3, telemetry="off")
    rollout(config, out / "runs" / "random-any-start" / "seed-00", pictures=False)
    for name in ("csv", "figures"):
        (out / name).mkdir()
        (out / name / "new.csv").write_text("new")
    for name in ("report.md", "ladder.md"):
        (out / name).write_text(f"# New {name}\n\n...\n")
    with pytest.raises(SclaError, match=r"has no made-by.json"):
        results.take(out, root)
    shutil.copy(root / "docs" / "results" / "made-by.json", out)
    (root / "docs" / "results" / "csv").mkdir()
    (root / "docs" / "results" / "csv" / "old.csv").write_text("old")
    results.take(out, root)
    assert [path.name for path in (root / "docs" / "results" / "csv").iterdir()] == ["new.csv"]
    assert json.loads((root / "docs" / "results" / "made-by.json").read_text())["decisions made again"] == 3
    write(results, root)
    assert results.faults(root) == []
    other = RunConfig(brain="random", seed=1)
    monkeypatch.setattr(results, "simulate", lambda _: simulate(other))
    with pytest.raises(SclaError, match="made by code with other bits"):
        results.take(out, root)
