"""The statistics against closed forms, exact enumerations and published values."""

import itertools
import math

import numpy as np
import pytest
from scipy import stats

from scla_mj.experiments import statistics as st


@pytest.fixture
def rng():
    return np.random.default_rng(11)


def test_an_interval_of_zeros_and_ones_is_the_binomials_own(rng):
    """Resampling 12 ones of 30 draws a binomial: its quantiles are the interval's ends."""
    found = st.estimate(np.repeat([0.0, 1.0], [18, 12]), rng=rng)
    tail = (1 - st.expanded_level(0.95, 30)) / 2
    assert found.mean == pytest.approx(0.4)
    assert (found.low, found.high) == tuple(stats.binom(30, 0.4).ppf([tail, 1 - tail]) / 30)


def test_ten_seeds_give_an_interval_as_wide_as_students_t(rng):
    values = stats.norm.ppf((np.arange(10) + 0.5) / 10)
    found = st.estimate(values, rng=rng)
    student = stats.t(9, loc=values.mean(), scale=stats.sem(values)).interval(0.95)
    assert found.high - found.low == pytest.approx(student[1] - student[0], rel=0.03)


def test_the_interval_of_ten_seeds_holds_the_truth_as_often_as_students_t(rng):
    """The plain percentile bootstrap holds it 5 times in 100 less often."""
    samples = rng.normal(3.0, 2.0, (400, 10))
    ends = np.array([st.estimate(sample, rng=rng) for sample in samples])
    student = stats.t(9, loc=samples.mean(axis=1), scale=stats.sem(samples, axis=1)).interval(0.95)
    covered, students = (np.mean((low <= 3.0) & (high >= 3.0)) for low, high in (ends[:, 1:].T, student))
    assert covered == pytest.approx(students, abs=0.02)


def test_expanding_fades_with_many_seeds():
    assert st.expanded_level(0.95, 10) == pytest.approx(1 - 2 * 0.0086, abs=2e-4)
    assert st.expanded_level(0.95, 100_000) == pytest.approx(0.95, abs=1e-4)


def test_seeds_that_all_agree_have_an_interval_of_no_width(rng):
    assert st.estimate(np.full(10, 1000.0), rng=rng) == (1000.0, 1000.0, 1000.0)


def test_one_seed_has_a_mean_and_no_interval(rng):
    found = st.estimate(np.array([7.0]), rng=rng)
    assert found.mean == 7.0
    assert math.isnan(found.low)
    assert math.isnan(found.high)


def test_a_span_counts_its_epochs_from_one_and_includes_both_ends():
    epochs = np.array([[1.0, 2.0, 3.0, 4.0], [10.0, 20.0, 30.0, 40.0]])
    assert st.span_means(epochs, 2, 3).tolist() == [2.5, 25.0]
    for first, last in [(0, 2), (3, 2), (1, 5)]:
        with pytest.raises(ValueError, match="within 1 to 4"):
            st.span_means(epochs, first, last)


def test_the_settled_span_of_the_papers_30_epochs_is_11_to_30():
    assert st.settled_span(30) == (11, 30)
    assert st.settled_span(1) == (1, 1)


def test_a_curve_is_every_epochs_own_estimate(rng):
    epochs = rng.normal(size=(6, 3, 2))
    curve = st.learning_curve(epochs, rng=rng)
    assert curve.mean == pytest.approx(epochs.mean(axis=0))
    assert curve.low.shape == (3, 2)
    assert (curve.low < curve.mean).all()
    assert (curve.mean < curve.high).all()


def test_percent_and_moves_follow_a_ceiling_that_jumps():
    hits = np.array([[400.0, 115.0, 0.0]])
    assert st.percent_of_ceiling(hits, np.array([400.0, 230.0, 230.0])).tolist() == [[100.0, 50.0, 0.0]]
    assert st.moves_per_hit(hits)[0] == pytest.approx([2.5, 8.6957, np.inf], abs=1e-4)


def test_mastery_comes_at_the_decision_that_completes_the_window():
    """Nothing up to decision 300, then every decision hits: 180 of the last 200 are reached at decision 480."""
    hits = np.arange(1, 1001) > 300
    assert st.decisions_to_mastery(hits, np.full(1000, 1000.0)) == 480
    assert st.decisions_to_mastery(hits, np.full(1000, 400.0)) == 372  # 72 of 200
    assert st.decisions_to_mastery(np.ones(1000, dtype=bool), np.full(1000, 1000.0)) == 200


def test_mastery_asks_for_the_share_of_each_decisions_own_ceiling():
    hits = np.tile([True, False, False, False], 250)  # 250 a 1000
    ceilings = np.repeat([400.0, 260.0], 500)
    assert st.decisions_to_mastery(hits, np.full(1000, 400.0)) is None
    reached = st.decisions_to_mastery(hits, ceilings)
    window = ceilings[reached - 200 : reached].sum() / 1000
    assert 500 < reached < 700
    assert hits[reached - 200 : reached].sum() >= 0.9 * window


def test_a_run_shorter_than_the_window_never_masters():
    assert st.decisions_to_mastery(np.ones(199, dtype=bool), np.full(199, 400.0)) is None


def test_two_separate_samples_of_ten_differ_at_two_splits_in_184756(rng):
    found = st.compare(np.arange(10.0) + 100, np.arange(10.0), rng=rng)
    assert found.exact
    assert found.p_value == pytest.approx(2 / 184_756, rel=1e-12)
    assert (found.difference, found.cliffs_delta) == (100.0, 1.0)


@pytest.mark.parametrize(("count", "of"), [(3, 3), (5, 4), (4, 6)])
def test_the_p_value_is_that_of_every_split_written_out(rng, count, of):
    values, baseline = rng.normal(0.0, 1.0, count), rng.normal(0.8, 1.0, of)
    pooled, observed = np.concatenate([values, baseline]), values.mean() - baseline.mean()
    tails = []
    for chosen in itertools.combinations(range(count + of), count):
        rest = [index for index in range(count + of) if index not in chosen]
        tails.append(pooled[list(chosen)].mean() - pooled[rest].mean())
    by_hand = 2 * min(np.mean(np.array(tails) >= observed - 1e-12), np.mean(np.array(tails) <= observed + 1e-12))
    assert st.compare(values, baseline, rng=rng).p_value == pytest.approx(min(1.0, by_hand))
    scipys = stats.permutation_test((values, baseline), lambda a, b: np.mean(a) - np.mean(b), n_resamples=np.inf)
    assert st.compare(values, baseline, rng=rng).p_value == pytest.approx(scipys.pvalue)


def test_many_seeds_are_tested_over_random_splits(rng):
    same, other = rng.normal(size=14), rng.normal(size=14)
    found = st.compare(same, other, rng=rng)
    assert not found.exact
    assert found.p_value == pytest.approx(stats.ttest_ind(same, other).pvalue, abs=0.02)


def test_equal_samples_do_not_differ(rng):
    values = np.full(10, 1000.0)
    assert st.compare(values, values, rng=rng) == (0.0, 0.0, 0.0, 1.0, True, 0.0, 0.0)


def test_a_single_seed_cannot_be_tested(rng):
    found = st.compare(np.array([3.0]), np.arange(10.0), rng=rng)
    assert math.isnan(found.p_value)
    assert found.difference == -1.5


def test_hedges_correction_is_his_own():
    """Hedges 1981: c(2) = 1 / sqrt(pi), c(4) = sqrt(2 / pi); two samples of unit pooled deviation, means 1 apart."""
    for count, tabled in [(2, 1 / math.sqrt(math.pi)), (3, math.sqrt(2 / math.pi))]:
        unit = np.linspace(-1.0, 1.0, count)
        unit /= unit.std(ddof=1)
        assert st.hedges_g(unit + 1.0, unit) == pytest.approx(tabled)
        assert st.hedges_g(unit, unit + 1.0) == pytest.approx(-tabled)


def test_samples_without_any_spread_are_infinitely_far_apart():
    assert st.hedges_g(np.full(3, 2.0), np.full(3, 1.0)) == math.inf
    assert st.hedges_g(np.full(3, 0.0), np.full(3, 1.0)) == -math.inf


def test_cliffs_delta_is_mann_whitneys_u_on_another_scale(rng):
    values, baseline = rng.integers(0, 6, 9).astype(float), rng.integers(2, 8, 7).astype(float)
    u = stats.mannwhitneyu(values, baseline, method="asymptotic").statistic
    assert st.cliffs_delta(values, baseline) == pytest.approx(2 * u / (9 * 7) - 1)


def test_holms_adjustment_is_his_own_step_down():
    assert st.holm(np.array([0.01, 0.04, 0.03, 0.005])) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert st.holm(np.array([0.6, math.nan, 0.9]))[[0, 2]] == pytest.approx([1.0, 1.0])
    assert math.isnan(st.holm(np.array([0.6, math.nan]))[1])


def test_equivalence_is_two_one_sided_welch_tests(rng):
    one, other, margin = rng.normal(3.0, 1.0, 7), rng.normal(3.4, 2.5, 10), 2.0
    found = st.equivalence(one, other, margin)
    below = stats.ttest_ind(one, other + margin, equal_var=False, alternative="less").pvalue
    above = stats.ttest_ind(one, other - margin, equal_var=False, alternative="greater").pvalue
    assert found.p_value == pytest.approx(max(below, above))
    interval = stats.ttest_ind(one, other, equal_var=False).confidence_interval(0.9)
    assert (found.low, found.high) == pytest.approx((interval.low, interval.high))
    assert found.difference == pytest.approx(one.mean() - other.mean())


def test_equivalence_to_an_exact_value_is_two_one_sided_t_tests(rng):
    values = rng.normal(115.0, 4.0, 10)
    found = st.equivalence(values, 115.38, 6.0)
    below = stats.ttest_1samp(values, 121.38, alternative="less").pvalue
    above = stats.ttest_1samp(values, 109.38, alternative="greater").pvalue
    assert found.p_value == pytest.approx(max(below, above))


def test_means_exactly_a_margin_apart_pass_for_equivalent_at_most_one_time_in_twenty(rng):
    samples = rng.normal(0.0, 1.0, (4000, 2, 10))
    passed = [st.equivalence(one + 1.5, other, 1.5).p_value <= 0.05 for one, other in samples]
    assert np.mean(passed) == pytest.approx(0.05, abs=0.012)


def test_samples_that_do_not_vary_are_equivalent_or_not_and_one_seed_says_nothing():
    same = np.full(10, 400.0)
    assert st.equivalence(same, same, 1.0) == (0.0, 0.0, 0.0, 0.0)
    assert st.equivalence(same, same + 2.0, 1.0).p_value == 1.0
    assert np.isnan(st.equivalence(same[:1], same, 1.0).p_value)


def test_percent_above_chance_runs_from_chance_to_the_ceiling():
    found = st.percent_above_chance(np.array([1000 / 3, 1000.0, 0.0]), np.full(3, 1000 / 3), np.full(3, 1000.0))
    assert found == pytest.approx([0.0, 100.0, -50.0])
    alike = st.percent_above_chance(np.array([30.0]), np.array([31.578947368421]), np.array([31.578947368422]))
    assert np.isnan(alike).all()  # action noise of 3/4: no policy is above chance
