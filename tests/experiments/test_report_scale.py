"""A report says of which runs it speaks: all that OUT holds, at what scale, and targets only at the full one."""

import csv
import dataclasses

import numpy as np
import pytest
from synthetic_out import learning, write_runs

from scla_mj.experiments.campaign import run_folder
from scla_mj.experiments.catalogue import CATALOGUE
from scla_mj.experiments.report import charts, write_report
from scla_mj.experiments.report.coverage import covered, is_reduced
from scla_mj.experiments.report.study import gather
from scla_mj.experiments.report.verdicts import judge
from scla_mj.experiments.report.wording import setting

BY_NAME = {experiment.name: experiment for experiment in CATALOGUE}
COMMAND = "scla-mj reproduce OUT"


def scaled(name, *, seeds=1, epochs=2, decisions=60):
    full = BY_NAME[name]
    config = dataclasses.replace(full.config, epochs=epochs, decisions=decisions)
    return dataclasses.replace(full, config=config, seeds=full.seeds[:seeds])


def write(out, *experiments):
    for experiment in experiments:
        write_runs(out, experiment, learning(1.5))


def report_of(out, *experiments):
    write_report(out, experiments, command=COMMAND)
    return (out / "report.md").read_text(encoding="utf-8")


def rows_of(out, name):
    with (out / "csv" / f"{name}.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """A quick look at two experiments: one seed, two epochs of 60 decisions."""
    out = tmp_path_factory.mktemp("small")
    asked = scaled("scla-printed-any-start"), scaled("automaton-any-start")
    write(out, *asked)
    return out, report_of(out, *asked)


def test_a_reduced_report_says_so_on_top_and_judges_no_target(small):
    out, text = small
    top = text[text.index("## Summary") :].split("\n\n")[1]
    assert top.startswith("**These are reduced-scale runs**: 1 seed and 2 epochs of 60 decisions, where the catalogue")
    assert "10 seeds and 20 or 30 epochs of 1000 decisions" in top and "not judged" in top
    assert {row["verdict"] for row in rows_of(out, "table-targets")} == {"not judged"}
    assert "targets reached" not in text


@pytest.mark.parametrize("scale", [{"seeds": 9}, {"epochs": 29}, {"decisions": 999}])
def test_less_of_anything_is_a_reduced_scale(scale):
    full = BY_NAME["scla-printed-any-start"]
    whole = {"seeds": 10, "epochs": 30, "decisions": 1000}
    assert is_reduced(scaled("scla-printed-any-start", **(whole | scale)))
    assert not is_reduced(full)


def test_a_reduced_rival_leaves_the_target_open(small):
    out, _ = small
    study = gather(out, [scaled("automaton-any-start")])
    judged = dataclasses.replace(study.evidence[0].experiment, name="of-my-own")
    mine = dataclasses.replace(study.evidence[0], experiment=judged)
    target = BY_NAME["scla-printed-any-start"].targets[2]._replace(rivals=(), low=0.0)
    assert judge(study, mine, target).reached is True
    assert judge(study, mine, target._replace(rivals=("automaton-any-start",))).reached is None


def test_a_report_of_a_part_does_not_claim_the_whole(small):
    _, text = small
    assert "Every run of every experiment" not in text
    assert f"it covers 2 of the catalogue's {len(CATALOGUE)} experiments" in text


def test_runs_shorter_than_the_window_have_no_decisions_to_mastery_and_single_seeds_no_effect_size(small):
    out, _ = small
    for row in rows_of(out, "table-brains-any-start"):
        assert (row["decisions to 90 %"], row["reached by"]) == ("", "")
    tests = rows_of(out, "table-tests-brains")
    assert tests
    assert {(row["Hedges' g"], row["Cliff's δ"]) for row in tests} == {("", "")}


def test_the_beginnings_axis_starts_at_no_decision(small):
    out, _ = small
    study = gather(out, [scaled("scla-printed-any-start")])
    _, early = charts.brain_curves("any-start", study.evidence, study)
    (axes,) = early.chart.axes
    assert axes.get_xlim() == (0.0, pytest.approx(102.0))
    assert all(np.ptp(line.get_xdata()) > 0 for line in axes.lines[:2])  # ceiling and random walk are lines


def test_each_protocol_is_named_with_its_own_ceiling(tmp_path):
    both = scaled("scla-printed-sensed-start"), scaled("scla-printed-any-start")
    write(tmp_path, *both)
    said = setting(*gather(tmp_path, both).evidence)
    assert said.startswith(
        "Protocol sensed-start (ceiling 1000.00, chance 333.33) and any-start (ceiling 400.00, chance 31.58), in hits"
    )


def test_asking_for_another_experiment_keeps_the_first_in_the_report(tmp_path):
    first, second = scaled("scla-printed-any-start"), scaled("random-any-start", seeds=2)
    write(tmp_path, first, second)
    assert [e.name for e in covered(tmp_path, [first])] == ["scla-printed-any-start", "random-any-start"]
    text = report_of(tmp_path, scaled("random-any-start", seeds=1))
    assert {row["brain"]: row["seeds"] for row in rows_of(tmp_path, "table-brains-any-start")} == {
        first.title: "1",
        second.title: "2",
    }
    assert "not run" not in text


def test_seeds_that_the_catalogue_does_not_have_are_covered_too(tmp_path):
    asked = dataclasses.replace(scaled("scla-printed-any-start"), seeds=(12, 11))
    write(tmp_path, asked, scaled("scla-printed-any-start"))
    (experiment,) = covered(tmp_path, [asked])
    assert experiment.seeds == (11, 12, 200)


def test_a_later_report_takes_its_predecessors_files_away_and_no_others(tmp_path):
    sensed, walk = scaled("scla-printed-sensed-start"), scaled("random-any-start")
    write(tmp_path, sensed, walk)
    report_of(tmp_path, sensed, walk)
    mine = [tmp_path / "csv" / "table-mine.csv", tmp_path / "figures" / "mine.png", tmp_path / "precious.txt"]
    for path in mine:
        path.write_text("mine")
    with (tmp_path / "report-files.txt").open("a") as listed:
        listed.write("precious.txt\ncsv/../precious.txt\n")
    assert (tmp_path / "csv" / "table-table-5.csv").exists()
    run_folder(tmp_path, sensed, sensed.seeds[0]).rename(tmp_path / "elsewhere")
    report_of(tmp_path, walk)
    assert [path.read_text() for path in mine] == ["mine"] * 3
    kept = {f"{f.parent.name}/{f.name}" for f in (*tmp_path.glob("csv/*"), *tmp_path.glob("figures/*"))}
    assert kept - {"csv/table-mine.csv", "figures/mine.png"} == set(
        (tmp_path / "report-files.txt").read_text().splitlines()
    )
    assert "csv/table-table-5.csv" not in kept and "figures/weights-sensed-start.png" not in kept
    assert not list(tmp_path.glob(".*"))
