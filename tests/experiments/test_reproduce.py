"""Experiments of one's own: run, compared and judged like the catalogue's, and refused before anything runs."""

import csv
import dataclasses
import re
import subprocess
import sys
from pathlib import Path

import pytest

from scla_mj.config import RunConfig
from scla_mj.errors import SclaError
from scla_mj.experiments.catalogue import CATALOGUE, Experiment, Target, with_settings
from scla_mj.experiments.reproduce import reproduce

PAGE = Path(__file__).parents[2] / "docs" / "extending.md"
WALK = RunConfig(epochs=1, decisions=20, telemetry="off", brain="random")
MINE = Experiment("mine", "comparison", "my walk", "?", WALK, (0, 1))


def rows_of(out, name):
    with (out / "csv" / f"{name}.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_the_documented_experiment_is_run_compared_and_judged(tmp_path):
    section = PAGE.read_text(encoding="utf-8").split("\n## An experiment\n")[1]
    script = tmp_path / "gentle.py"
    script.write_text(re.search(r"```python\n(.*?)```", section, re.DOTALL)[1], encoding="utf-8")
    done = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    out = tmp_path / "out"
    assert done.stdout == f"The report:  {Path('out') / 'report.html'}\n"
    assert [row["ablation"] for row in rows_of(out, "table-ablations-scla")] == ["penalty rate 0.1"]
    against = {row["against"] for row in rows_of(out, "table-tests-ablations-scla")}
    assert against == {"SCLA with one dopamine, any-start"}
    assert rows_of(out, "table-targets")[0]["verdict"] in ("reached", "missed")
    assert "A Python call of `reproduce` wrote the report" in (out / "report.md").read_text(encoding="utf-8")


def test_progress_is_told_from_the_start_and_what_is_there_is_not_run_again(tmp_path):
    told = []
    watch = lambda done, total, job: told.append((done, total, job and job.folder.name))  # noqa: E731
    assert reproduce([MINE], tmp_path, workers=1, watch=watch) == tmp_path / "report.html"
    assert told[0] == (0, 2, None)
    assert sorted(told[1:]) == [(1, 2, told[1][2]), (2, 2, told[2][2])]
    reproduce([MINE], tmp_path, workers=1, watch=watch)
    assert told[3:] == [(0, 0, None)]


@pytest.mark.parametrize(
    ("experiments", "words"),
    [
        ([MINE, MINE], "2 experiments are named mine"),
        ([dataclasses.replace(MINE, name=CATALOGUE[0].name)], "is an experiment of the catalogue"),
        ([dataclasses.replace(MINE, baseline="theirs")], "compared with theirs, which is not an experiment"),
        ([dataclasses.replace(MINE, targets=(Target("", 1, 1, "mean hits per 1000", 0.0, rivals=("x",)),))], "with x"),
        ([dataclasses.replace(MINE, config=with_settings(WALK, epochs=0))], "epochs"),
    ],
)
def test_what_cannot_be_run_or_told_apart_is_refused_before_anything_runs(experiments, words, tmp_path):
    with pytest.raises(SclaError, match=words):
        reproduce(experiments, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["../up", "a/b", "", ".", "..", "a b", "a\nb", "<b>", "-x"])
def test_a_name_is_a_plain_folders(name):
    with pytest.raises(SclaError, match="cannot be named"):
        dataclasses.replace(MINE, name=name)


def test_a_seed_is_named_once():
    with pytest.raises(SclaError, match="names a seed twice"):
        dataclasses.replace(MINE, seeds=(1, 1))


@pytest.mark.parametrize("epochs", [1, 14])
def test_a_smaller_scale_leaves_everything_else_and_a_configuration_that_can_run(epochs):
    full = next(experiment for experiment in CATALOGUE if experiment.name == "target-jump-scla-dopamine-any-start")
    small = full.at_scale((3,), epochs, 40)
    assert (small.seeds, small.config.epochs, small.config.decisions) == ((3,), epochs, 40)
    assert small.config.task.jump_epoch == min(11, epochs)
    assert small.at_scale(full.seeds, 14, 1000).config.task.jump_target == full.config.task.jump_target


def test_a_folder_that_is_moved_while_its_runs_are_made_gets_no_report_in_its_old_place(tmp_path):
    def move(done, total, job):
        if job is None:
            (tmp_path / "out").rename(tmp_path / "moved")

    with pytest.raises(SclaError, match="was moved or removed while its runs were made"):
        reproduce([dataclasses.replace(MINE, seeds=(0,))], tmp_path / "out", workers=1, watch=move)
    assert not list(tmp_path.rglob("report.html"))
