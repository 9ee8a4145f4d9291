"""The report over a small OUT whose runs are known: its figures are theirs, and nothing is made up."""

import dataclasses
import re

import numpy as np
import pytest
from scipy import stats
from small_out import BY_NAME, COMMAND, EXPERIMENTS, FOUR, THREE, fill, hits_by_hand, read_csv
from synthetic_out import learning

from scla_mj.experiments import statistics
from scla_mj.experiments.experiment import Target, with_settings
from scla_mj.experiments.report import write_report
from scla_mj.experiments.report.results import shared_spans
from scla_mj.experiments.report.study import gather
from scla_mj.experiments.report.verdicts import judge


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("out")
    fill(folder)
    assert write_report(folder, EXPERIMENTS, command=COMMAND) == folder / "report.html"
    return folder


@pytest.fixture(scope="module")
def study(out):
    return gather(out, EXPERIMENTS)


def test_the_learning_curves_are_those_of_the_decisions(out):
    rows = read_csv(out, "figure-curves-any-start")
    for experiment in (BY_NAME["scla-any"], BY_NAME["automaton-any"], BY_NAME["random-any"]):
        hits = hits_by_hand(out, experiment)
        own = [row for row in rows if row["series"] == experiment.title]
        assert [int(row["epoch"]) for row in own] == [1, 2, 3, 4]
        assert [float(row["hits per 1000"]) for row in own] == pytest.approx(hits.mean(axis=0))
        for row in own:
            assert float(row["95 % interval low"]) <= float(row["hits per 1000"]) <= float(row["95 % interval high"])


def test_the_first_blocks_add_up_to_the_first_epoch(out):
    rows = [row for row in read_csv(out, "figure-early-any-start") if row["series"] == BY_NAME["scla-any"].title]
    assert [float(row["decision"]) for row in rows[:3]] == [100, 200, 300]
    first_epoch = hits_by_hand(out, BY_NAME["scla-any"])[:, 0].mean()
    assert np.mean([float(row["hits per 1000"]) for row in rows[:3]]) == pytest.approx(first_epoch)


def test_verdicts_say_what_was_reached_missed_and_not_measured(out):
    rows = read_csv(out, "table-targets")
    assert [row["verdict"] for row in rows] == [
        "reached", "missed", "not measured", "reached", "reached", "missed", "missed", "not measured"
    ]  # fmt: skip
    percent = hits_by_hand(out, BY_NAME["scla-any"])[:, 1:].mean() / 4.0
    assert float(rows[0]["measured"]) == pytest.approx(percent)
    assert float(rows[6]["measured"]) == pytest.approx(
        hits_by_hand(out, BY_NAME["random-any"]).mean(axis=1).min() / 4.0
    )
    assert rows[2]["measured"] == rows[7]["measured"] == ""


def test_weights_are_judged_by_the_worst_seed_and_epoch_and_both_forms_stand_side_by_side(out):
    rows = [row for row in read_csv(out, "table-forms") if row["experiment"] == BY_NAME["one-any"].title]
    assert [row["verdict"] for row in rows] == ["reached", "reached", "missed"]
    assert [row["unit"] for row in rows] == ["%", "mV", "mV"]
    second, last = (learning(1.5)(epoch) for epoch in (2, 4))
    agreeing, opposite = 0.02 * np.mean([0, 3, 4, 6]), 0.02 * np.mean([1, 2, 5, 7])
    assert float(rows[1]["one dopamine"]) == pytest.approx(3.6 * second + agreeing - opposite)  # in epoch 2
    assert float(rows[2]["one dopamine"]) == pytest.approx(1.0 + 2.9 * last + 0.02 * 6 + 0.01 * 3)  # seed 3, epoch 4
    for column, name in (("one dopamine", "one-any"), ("as printed", "scla-any")):
        assert float(rows[0][column]) == pytest.approx(hits_by_hand(out, BY_NAME[name])[:, 2:].mean() / 4.0)


def test_an_equivalence_is_reached_where_the_ninety_percent_interval_lies_within_the_margin(study):
    walk, large = study.named("random-any"), study.named("large")
    seeds = walk.over(1, 4).hits
    low, high = stats.t.interval(0.9, len(seeds) - 1, seeds.mean(), stats.sem(seeds))
    for margin, reached in ((high - low, True), ((high - low) / 3, False)):
        target = Target("", 1, 4, "equivalent hits per 1000", seeds.mean() - margin, seeds.mean() + margin)
        verdict = judge(study, walk, target)
        assert verdict.reached is reached
        assert (verdict.measured, *verdict.interval) == pytest.approx((seeds.mean(), low, high))
    assert judge(study, walk, Target("", 1, 4, "equivalent hits per 1000", 500.0, 510.0)).reached is False
    assert judge(study, large, Target("", 1, 4, "equivalent hits per 1000", 0.0, 1e6)).reached is False  # one seed


def test_an_equivalence_with_a_rival_is_of_the_difference(study):
    scla, other = study.evidence[0], study.named("scla-sensed")
    wanted = Target("", 1, 4, "equivalent percent of ceiling", -30.0, 30.0, rivals=("scla-sensed",))
    verdict = judge(study, scla, wanted)
    difference = scla.over(1, 4).percent.mean() - other.over(1, 4).percent.mean()
    assert verdict.reached and verdict.measured == pytest.approx(difference)
    assert judge(study, scla, wanted._replace(low=-1e-3, high=1e-3)).reached is False
    assert judge(study, scla, wanted._replace(low=90.0, high=99.0)).reached is False
    assert judge(study, scla, wanted._replace(rivals=("absent",))).reached is None


def test_the_ladder_and_other_bodies_have_chapters_and_tests_of_their_own(out, study):
    assert [row["brain"] for row in read_csv(out, "table-ladder-any-start")] == ["a step", "no network"]
    assert {row["experiment"] for row in read_csv(out, "table-tests-ladder")} == {"a step", "no network"}
    rows = read_csv(out, "table-bodies-crossed-2-any-start")
    assert [(row["world"], row["epochs"]) for row in rows] == [("crossed", "3–4")]
    assert "crossed" not in {row["world"] for row in read_csv(out, "table-worlds")}
    text = (out / "report.md").read_text(encoding="utf-8")
    assert text.index("## The ladder") < text.index("## Other bodies") < text.index("## Ablations")


def test_the_tables_correct_for_chance_and_show_what_start_cells_cannot_disturb(out, study):
    rows = {row["brain"]: row for row in read_csv(out, "table-brains-any-start")}
    item = study.evidence[0]
    hits = hits_by_hand(out, BY_NAME["scla-any"])[:, 1:].mean()
    row = rows[BY_NAME["scla-any"].title]
    assert float(row["above chance, %"]) == pytest.approx(100 * (hits - 31.5789) / (400 - 31.5789), abs=1e-3)
    assert (float(row["moves nearer, %"]), float(row["regret"])) == (100.0, 0.0)  # as the synthetic moves are
    assert item.chances == pytest.approx([31.5789] * 4, abs=1e-4)
    assert study.named("scla-sensed").chances == pytest.approx([333.333] * 4, abs=1e-3)
    assert "ceiling 1000.00, chance 333.33" in (out / "report.md").read_text(encoding="utf-8")


def test_a_rival_sets_the_low_end_and_a_missing_one_leaves_the_target_open(study):
    scla, walk = study.evidence[0], study.named("random-any")
    wanted = Target("at least the walk", 1, 2, "mean hits per 1000", 0.0, rivals=("random-any",))
    verdict = judge(study, scla, wanted)
    assert verdict.reached
    assert verdict.target.low == pytest.approx(walk.hits[:, :2].mean())
    assert judge(study, walk, wanted._replace(rivals=(scla.experiment.name,))).reached is False
    assert judge(study, scla, wanted._replace(rivals=("random-any", "absent"))).reached is None


def test_what_is_missing_or_unfinished_is_named_and_measured_nowhere(out):
    text = (out / "report.md").read_text(encoding="utf-8")
    assert "**absent**: 3 seeds (0 to 2): not run" in text
    assert "**killed**: 3 seeds (0 to 2): unfinished: 500 of 1200 decisions" in text
    assert [row["ablation"] for row in read_csv(out, "table-ablations-scla-printed")] == [
        "no local rule",
        "one dopamine",
    ]
    assert not [
        row
        for row in read_csv(out, "table-tests-ablations-scla-printed")
        if row["experiment"] in ("never run", "killed")
    ]


def test_a_target_is_not_judged_while_a_seed_is_missing(out):
    more = dataclasses.replace(BY_NAME["scla-any"], seeds=(*FOUR, 4))
    study = gather(out, [more])
    (evidence,) = study.evidence
    assert (evidence.seeds, [*evidence.gaps]) == (FOUR, [4])
    assert judge(study, evidence, more.targets[0]).reached is None


def test_a_run_with_other_settings_is_not_taken_for_this_one(out):
    other = dataclasses.replace(
        BY_NAME["no-rule"], config=with_settings(BY_NAME["no-rule"].config, automaton={"discount": 0.5})
    )
    (evidence,) = gather(out, [other]).evidence
    assert not evidence.runs
    assert set(evidence.gaps.values()) == {"made with other settings"}


def test_the_papers_table_5_stands_next_to_ours(out):
    rows = read_csv(out, "table-table-5")
    sensed, printed, one = (BY_NAME[name].title for name in ("scla-sensed", "scla-any", "one-any"))
    assert [row["paper"] for row in rows[:4]] == ["799.0", "778.0", "772.0", "807.0"]
    ours = [float(row[sensed]) for row in rows[:4]]
    assert ours == pytest.approx(hits_by_hand(out, BY_NAME["scla-sensed"]).mean(axis=0))
    assert float(rows[4]["paper"]) == pytest.approx((799 + 778 + 772 + 807) / 4)
    assert float(rows[4][printed]) == pytest.approx(hits_by_hand(out, BY_NAME["scla-any"]).mean())
    assert (rows[5]["epoch"], round(float(rows[5][sensed]), 2), round(float(rows[5][one]), 2)) == (
        "chance",
        333.33,
        31.58,
    )
    assert (rows[6]["epoch"], rows[6][sensed], rows[6][printed]) == ("ceiling", "1000.0", "400.0")


def test_the_jump_is_compared_with_the_new_ceiling(out):
    rows = read_csv(out, "table-jump-1")
    assert [(row["epoch"], float(row["ceiling"])) for row in rows] == [("2", 400.0), ("3", 240.0), ("4", 240.0)]
    for name, label in (("jump", "printed"), ("jump-one", "one")):
        hits = hits_by_hand(out, BY_NAME[name]).mean(axis=0)
        shares = [float(row[f"{label}: % of ceiling"]) for row in rows]
        assert shares == pytest.approx(100 * hits[1:] / [400, 240, 240])
    assert {row["series"] for row in read_csv(out, "figure-jump-1")} == {"printed", "one"}  # one chart of both
    assert not (out / "csv" / "figure-jump-2.csv").exists()


def test_a_test_of_difference_is_over_the_same_epochs_of_both(out):
    rows = read_csv(out, "table-tests-ablations-scla-printed")
    first, settled = (row for row in rows if row["experiment"] == "no local rule")
    assert (first["epochs"], settled["epochs"], settled["seeds"]) == ("1", "2–4", "3, 4")
    ablation, baseline = (hits_by_hand(out, BY_NAME[name]) / 4.0 for name in ("no-rule", "scla-any"))
    difference = ablation[:, 1:].mean() - baseline[:, 1:].mean()
    assert float(settled["difference"]) == pytest.approx(difference)
    g = statistics.hedges_g(ablation[:, 1:].mean(axis=1), baseline[:, 1:].mean(axis=1))
    assert float(settled["Hedges' g"]) == pytest.approx(g)
    assert float(settled["p"]) >= 2 / 35  # three seeds and four split in 35 ways


def test_a_shorter_baseline_sets_the_span(study, tmp_path):
    brief = dataclasses.replace(BY_NAME["random-any"], config=with_settings(BY_NAME["random-any"].config, epochs=2))
    fill(tmp_path, [brief])
    (baseline,) = gather(tmp_path, [brief]).evidence
    assert shared_spans(study.evidence[0], baseline) == [(1, 1), (1, 2)]


def test_figure_3_shows_eight_connections_at_every_epoch(out):
    rows = read_csv(out, "figure-weights-any-start")
    assert len(rows) == 2 * 8 * 4
    own = [row for row in rows if row["experiment"] == BY_NAME["scla-any"].title]
    agreeing = [float(row["mean weight (mV)"]) for row in own if row["series"] == "SU → MU"]
    seeds = 0.01 * np.mean(FOUR)
    assert agreeing == pytest.approx([1.0 + 2.9 * learning(1.5)(epoch) + seeds for epoch in (1, 2, 3, 4)])


def test_one_scalar_dopamine_is_compared_with_the_signed_one(out):
    text = (out / "report.md").read_text(encoding="utf-8")
    end = learning(1.5)(4)
    for title, seeds in (("one dopamine", THREE), ("SCLA, sensed", FOUR)):
        drawn = (
            0.01 * np.mean(seeds) + 0.02 * np.mean([0, 3, 4, 6]),
            0.01 * np.mean(seeds) + 0.02 * np.mean([1, 2, 5, 7]),
        )
        agreeing, opposite = 1.0 + 2.9 * end + drawn[0], 1.0 - 0.7 * end + drawn[1]
        said = re.search(rf"at the end, {title}: agreeing ([\d.]+) .* opposite ([\d.]+) ", text)
        assert [float(value) for value in said.groups()] == pytest.approx([agreeing, opposite], abs=0.006)
    assert len(read_csv(out, "figure-weights-scalar")) == 2 * 8 * 4


def test_a_world_with_action_noise_has_the_ceiling_of_its_own_mdp(out):
    (row,) = (row for row in read_csv(out, "table-worlds") if row["world"] == "p = 0.3")
    assert 31.58 < float(row["ceiling"]) < 0.7 * 400
    percent = 100 * hits_by_hand(out, next(e for e in EXPERIMENTS if e.name == "noisy"))[:, 1:] / float(row["ceiling"])
    assert float(row["settled, %"]) == pytest.approx(percent.mean())
    assert float(row["worst seed, %"]) == pytest.approx(percent.mean(axis=1).min())


def test_a_policys_rows_are_distributions_of_the_open_cells(out):
    rows = [row for row in read_csv(out, "figure-policies") if row["experiment"] == BY_NAME["scla-any"].title]
    assert len(rows) == 24
    for row in rows:
        assert sum(float(row[name]) for name in ("up", "down", "left", "right")) == pytest.approx(1.0)
        assert float(row["nearer"]) > 0.9


def test_the_errata_are_computed_and_come_out_as_docs_errata_has_them(out):
    text = (out / "report.md").read_text(encoding="utf-8")
    for said in ("784.2 hits cannot be any-start", "115 hits are 115.38", "8.67", "Table 5 averages 786.05",
                 "from 750 to 811", "18.5", "no policy earns more than 400"):  # fmt: skip
        assert said in text
    exact = {(row["policy"], row["protocol"]): float(row["hits per 1000"]) for row in read_csv(out, "table-policies")}
    assert exact["random walk, a bump stays", "any-start"] == pytest.approx(31.58, abs=0.005)
    assert exact["random walk, a bump stays", "sensed-start"] == pytest.approx(1000 / 24)
    ceilings = [round(float(row["ceiling, any-start"]), 2) for row in read_csv(out, "table-arenas")]
    assert ceilings == [400.0, 240.0, 282.35, 285.71]


def test_every_caption_of_results_names_protocol_ceiling_seeds_and_epochs(out):
    setting = re.compile(
        r"Protocol \S+-start \(ceiling [\d.]+.*\), in hits per 1000 .*; \d+ seeds?.*; \d+.* epochs of 300 decis"
    )
    text = (out / "report.md").read_text(encoding="utf-8")
    captions = re.findall(r"^\*\*(?:Table|Figure) \d+\.\*\* (.*?)\n\n", text, re.DOTALL | re.MULTILINE)
    assert len(captions) == len(list((out / "csv").iterdir())) > 6 + 12
    general = (
        "Every target and",
        "Exact values",
        "Ceilings of other",
        "Every experiment",
        "The default",
        "Versions and",
    )
    assert {caption for caption in captions if not setting.search(caption)} == {
        caption for caption in captions if caption.startswith(general)
    }
