"""What a report may say of SCLA: against the best of the ladder over the same epochs, and equal only by test."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats
from small_out import BY_NAME, fill, hits_by_hand, read_csv

from scla_mj.experiments.report import write_report
from scla_mj.experiments.report.claims import Claim, best_of_ladder, relayed, without_network
from scla_mj.experiments.report.study import gather
from scla_mj.experiments.scale import CHOSEN_ON, TEN_SEEDS

SOME = [BY_NAME[name] for name in ("scla-any", "one-any", "rung", "automata-everywhere-any-start")]


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("claims")
    fill(folder, SOME)
    write_report(folder, SOME)
    return folder


def test_the_rival_is_whoever_earned_most_over_the_very_epochs(out):
    claims = best_of_ladder(gather(out, SOME))
    spans = [(name, *span) for name in ("one-any", "scla-any") for span in ((1, 1), (2, 4))]
    assert [(claim.item.experiment.name, claim.first, claim.last) for claim in claims] == spans
    for claim in claims:
        span = slice(claim.first - 1, claim.last)
        earned = {rung.name: hits_by_hand(out, rung)[:, span].mean() for rung in SOME[2:]}
        assert claim.rival.experiment.name == max(earned, key=earned.get)
        own, other = (
            hits_by_hand(out, each.experiment)[:, span].mean(axis=1) / 4 for each in (claim.item, claim.rival)
        )
        welch = stats.ttest_ind(own, other, equal_var=False).confidence_interval(0.95)
        found = claim.difference
        assert (found.difference, found.low, found.high) == pytest.approx((own.mean() - other.mean(), *welch))


def test_claims_that_are_made_together_are_adjusted_together(out):
    claims = without_network(gather(out, SOME))
    assert len(claims) == 4
    assert max(claim.p_holm for claim in claims) <= 1.0
    assert all(claim.p_holm >= claim.difference.p_value for claim in claims)
    smallest = min(claims, key=lambda claim: claim.difference.p_value)
    assert smallest.p_holm == pytest.approx(min(1.0, 4 * smallest.difference.p_value))


def claim_of(own, other, p_holm):
    sides = (SimpleNamespace(over=lambda *_, values=values: SimpleNamespace(percent=np.array(values)))
             for values in (own, other))  # fmt: skip
    return Claim(*sides, 1, 1, 1.5, p_holm)


@pytest.mark.parametrize(
    ("own", "other", "p_holm", "words"),
    [
        ([99.9, 100.0, 100.1], [99.8, 100.0, 100.2], 0.9, "the same within 1.5 points (TOST)"),
        (
            [90.0, 100.0, 110.0],
            [91.0, 99.0, 110.0],
            0.9,
            "neither different nor shown to be the same within 1.5 points",
        ),
        ([95.0, 95.1, 95.2], [90.0, 90.1, 90.2], 0.01, "more"),
        ([85.0, 85.1, 85.2], [90.0, 90.1, 90.2], 0.01, "less"),
        ([89.5, 89.6, 89.7], [90.0, 90.1, 90.2], 0.01, "less, by less than 1.5 points (TOST)"),
        ([95.0], [90.0], math.nan, "not tested: a single seed"),
    ],
)
def test_equality_is_said_only_by_two_one_sided_tests(own, other, p_holm, words):
    assert claim_of(own, other, p_holm).words == words


def test_the_ladder_for_another_page_has_the_reports_numbers_and_its_claims_against_the_best(out):
    report, ladder = ((out / name).read_text(encoding="utf-8") for name in ("report.md", "ladder.md"))
    bullets = [line for line in ladder.splitlines() if line.startswith("- ")]
    assert len(bullets) == 2 and set(bullets) <= set(report.splitlines())
    table = [line.split(" | ") for line in ladder.splitlines() if line.startswith("| ")]
    width = len(read_csv(out, "table-ladder")[0])
    of_the_report = {row[0]: row for line in report.splitlines() if len(row := line.split(" | ")) == width}
    assert len(table) == 2 + len(SOME)
    for brain, *cells in table[2:]:
        assert set(cells[:-1]) <= set(of_the_report[brain])
    rows = {row["brain"]: row for row in read_csv(out, "table-ladder")}
    assert len(rows) == len(SOME)
    hits = hits_by_hand(out, BY_NAME["rung"])
    assert float(rows["a step"]["any-start: epoch 1"]) == pytest.approx(hits[:, 0].mean())
    assert float(rows["a step"]["any-start: settled"]) == pytest.approx(hits[:, 1:].mean())
    assert rows["a step"]["sensed-start: epoch 1"] == rows["a step"]["crossed wheels, any-start: settled"] == ""


def test_a_network_relays_where_it_decides_as_the_automaton_had_drawn():
    runs = [SimpleNamespace(advised=10, relayed=10), SimpleNamespace(advised=5, relayed=3)]
    assert relayed([SimpleNamespace(runs=runs), SimpleNamespace(runs=runs[:1])]) == (25, 23)


def test_no_seed_of_the_report_was_one_to_choose_settings_on():
    assert not set(CHOSEN_ON) & set(TEN_SEEDS)
