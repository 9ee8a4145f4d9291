"""What many seeds say: means with intervals, learning speed, and tests of difference. Arrays in, named results out.

A seed is the unit of every statistic: decisions within a run are correlated, seeds are not.
"""

from __future__ import annotations

import functools
import itertools
import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats

from scla_mj.markov import has_room

Array = NDArray[np.float64]

CONFIDENCE: Final = 0.95
BOOTSTRAP_RESAMPLES: Final = 9999
"""Resamples of an interval: its ends then move by less than a hundredth of its width between generators."""
PERMUTATIONS: Final = 200_000
"""At or above C(20, 10) = 184 756, so that ten seeds against ten are tested over every split, exactly."""
TEST_LEVEL: Final = 0.05
"""Of each of the two one-sided tests of equivalence, whose interval therefore has 90 %."""
MASTERY: Final = 0.9
"""The share of the ceiling that counts as having learned."""
WINDOW_DECISIONS: Final = 200
"""Decisions over which that share must be earned: 80 expected hits at the paper's ceiling of 400."""
LEAST_SEEDS: Final = 4
"""Of an interval that is drawn: a bootstrap's ends lie within the values, too close where they are fewer."""
SEED: Final = 20_07
"""Any fixed number: one quantity has one interval wherever it is shown."""


class Estimate(NamedTuple):
    """A mean over seeds with its interval; `low` and `high` are NaN where a single seed allows none."""

    mean: float
    low: float
    high: float


class Curve(NamedTuple):
    """A mean over seeds and its interval for every epoch, each (epochs, ...)."""

    mean: Array
    low: Array
    high: Array


class Equivalence(NamedTuple):
    """How far two means are apart, with the interval that must lie within the margin, and the larger one-sided p."""

    difference: float
    low: float
    high: float
    p_value: float


class Difference(NamedTuple):
    """One sample against another: the difference of means, its interval and p-value, and two standard effect sizes.

    `low`, `high` and `p_value` are NaN where a sample has a single seed. `hedges_g` is infinite where neither sample
    varies.
    """

    difference: float
    low: float
    high: float
    p_value: float
    exact: bool
    hedges_g: float
    cliffs_delta: float


def estimate(values: Array, *, rng: np.random.Generator | int = SEED) -> Estimate:
    """Return the mean of one value per seed (n,), with a bootstrap interval over the seeds.

    The interval is the percentile bootstrap, expanded for few seeds (Hesterberg 2015, The American Statistician 69,
    371) to be as wide as Student's t; with ten seeds the plain one is 18 % narrower.
    """
    values = np.asarray(values, dtype=np.float64)
    mean = float(values.mean())
    if len(values) < 2:
        return Estimate(mean, math.nan, math.nan)
    if np.ptp(values) == 0.0:
        return Estimate(mean, mean, mean)
    interval = stats.bootstrap(
        (values,),
        np.mean,
        n_resamples=BOOTSTRAP_RESAMPLES,
        confidence_level=expanded_level(CONFIDENCE, len(values)),
        method="percentile",
        rng=rng,
    ).confidence_interval
    return Estimate(mean, float(interval.low), float(interval.high))


def expanded_level(confidence: float, count: int) -> float:
    """Return the level at which a percentile bootstrap of `count` values is as wide as Student's t."""
    t = stats.t.ppf((1.0 + confidence) / 2.0, count - 1)
    return float(1.0 - 2.0 * stats.norm.cdf(-t * math.sqrt(count / (count - 1))))


def span_means(epochs: Array, first: int, last: int) -> Array:
    """Return every seed's mean (seeds,) over the epochs `first` to `last`, from 1 and inclusive, of (seeds, epochs)."""
    if not 1 <= first <= last <= epochs.shape[1]:
        raise ValueError(f"epochs {first} to {last} are not within 1 to {epochs.shape[1]}")
    return np.asarray(epochs[:, first - 1 : last].mean(axis=1))


def settled_span(epochs: int) -> tuple[int, int]:
    """Return the epochs that count as learned: the last two thirds, 11 to 30 of the paper's 30."""
    return epochs // 3 + 1, epochs


def learning_curve(epochs: Array, *, rng: np.random.Generator | None = None) -> Curve:
    """Return the mean and interval over seeds of every epoch of (seeds, epochs) or (seeds, epochs, series)."""
    rng = rng or np.random.Generator(np.random.PCG64(SEED))  # one for all columns
    columns = epochs.reshape(len(epochs), -1).T
    estimates = np.array([estimate(column, rng=rng) for column in columns])
    return Curve(*estimates.T.reshape(3, *epochs.shape[1:]))


def band(values: Array) -> Curve:
    """Return the mean over seeds of (seeds, ...) and what a figure shows around it.

    That is the interval, or of fewer seeds than `LEAST_SEEDS` their range.
    """
    if 1 < len(values) < LEAST_SEEDS:
        return Curve(values.mean(axis=0), values.min(axis=0), values.max(axis=0))
    return learning_curve(values)


def percent_of_ceiling(hits_per_1000: Array, ceilings: Array) -> Array:
    """Return 100 * hits / ceiling; `ceilings` is (epochs,) and may change where a target jumps."""
    return np.asarray(100.0 * hits_per_1000 / ceilings)


def percent_above_chance(hits_per_1000: Array, chances: Array, ceilings: Array) -> Array:
    """Return 100 * (hits - chance) / (ceiling - chance), by epoch (epochs,); NaN where no policy is above chance."""
    room = np.where(has_room(chances, ceilings), ceilings - chances, np.nan)
    return np.asarray(100.0 * (hits_per_1000 - chances) / room)


def moves_per_hit(hits_per_1000: Array) -> Array:
    """Return 1000 / hits per 1000 decisions: infinite where nothing was hit."""
    hits = np.asarray(hits_per_1000, dtype=np.float64)
    moves = np.full(hits.shape, np.inf)
    np.divide(1000.0, hits, out=moves, where=hits > 0.0)
    return moves


def decisions_to_mastery(
    hits: NDArray[np.bool_], ceilings: Array, *, share: float = MASTERY, window: int = WINDOW_DECISIONS
) -> int | None:
    """Return the first decision, from 1, at which the last `window` decisions earned `share` of their ceiling, or None.

    `hits` (n,) says for every decision of a run whether it hit; `ceilings` (n,) is the ceiling in hits per 1000 that
    held for it. The least possible answer is `window`.
    """
    if len(hits) < window:
        return None
    earned, possible = (np.convolve(values, np.ones(window), "valid") for values in (hits, ceilings / 1000.0))
    reached = np.flatnonzero(earned >= share * possible - 1e-9)  # the sums of ceilings round in their last digits
    return int(reached[0]) + window if len(reached) else None


def compare(values: Array, baseline: Array, *, rng: np.random.Generator | int = SEED) -> Difference:
    """Test whether two samples of seeds differ in their mean: two-sided, by permutation.

    Exact where there are at most `PERMUTATIONS` ways to split the seeds, else over that many random ones.
    The seeds are taken as independent samples: two brains with the same seed share the first start only.
    The interval is Welch's, at `CONFIDENCE`.
    """
    values, baseline = np.asarray(values, dtype=np.float64), np.asarray(baseline, dtype=np.float64)
    splits = math.comb(len(values) + len(baseline), len(values))
    difference, error, freedom = _welch(values, baseline)
    half = _half_width(error, freedom, CONFIDENCE)
    return Difference(
        difference,
        difference - half,
        difference + half,
        _permutation_p_value(values, baseline, rng) if min(len(values), len(baseline)) > 1 else math.nan,
        splits <= PERMUTATIONS,
        hedges_g(values, baseline),
        cliffs_delta(values, baseline),
    )


def equivalence(values: Array, reference: Array | float, margin: float) -> Equivalence:
    """Test whether a mean differs by less than `margin` from another sample's, or from an exact value.

    Two one-sided t tests (Schuirmann 1987, J. Pharmacokinet. Biopharm. 15, 657), Welch's for two samples. Both reject
    at `TEST_LEVEL` if and only if the interval lies within the margin. All but the difference is NaN for a single seed.
    """
    difference, error, freedom = _welch(values, reference)
    half = _half_width(error, freedom, 1.0 - 2.0 * TEST_LEVEL)
    if error == 0.0:
        p_value = 0.0 if abs(difference) < margin else 1.0
    else:
        p_value = float(special.stdtr(freedom, (abs(difference) - margin) / error))
    return Equivalence(difference, difference - half, difference + half, p_value)


def _welch(values: Array, reference: Array | float) -> tuple[float, float, float]:
    """Return the difference of means, its standard error and Welch's degrees of freedom.

    Both are NaN where a sample has a single seed, the degrees of freedom also where no sample varies.
    """
    samples = [np.asarray(values, dtype=np.float64)]
    samples += [] if isinstance(reference, float | int) else [np.asarray(reference, dtype=np.float64)]
    difference = float(samples[0].mean() - np.mean(reference))
    if min(map(len, samples)) < 2:
        return difference, math.nan, math.nan
    parts = [float(sample.var(ddof=1)) / len(sample) for sample in samples]
    squares = sum(part**2 / (len(sample) - 1) for part, sample in zip(parts, samples, strict=True))
    return difference, math.sqrt(sum(parts)), sum(parts) ** 2 / squares if squares else math.nan


def _half_width(error: float, freedom: float, confidence: float) -> float:
    return error * float(special.stdtrit(freedom, (1.0 + confidence) / 2.0)) if error else 0.0


def hedges_g(values: Array, baseline: Array) -> float:
    """Return the difference in pooled standard deviations, with the exact small-sample correction (Hedges 1981)."""
    freedom = len(values) + len(baseline) - 2
    difference = float(np.mean(values) - np.mean(baseline))
    if freedom < 2:
        return math.nan
    squares = sum(float(np.sum((sample - np.mean(sample)) ** 2)) for sample in (values, baseline))
    if squares == 0.0:
        return math.copysign(math.inf, difference) if difference else 0.0
    log_gammas = special.gammaln(freedom / 2) - special.gammaln((freedom - 1) / 2)
    correction = math.exp(log_gammas) / math.sqrt(freedom / 2)
    return float(correction * difference / math.sqrt(squares / freedom))


def cliffs_delta(values: Array, baseline: Array) -> float:
    """Return P(value > baseline) - P(value < baseline) over all pairs, from -1 to 1 (Cliff 1993)."""
    return float(np.sign(np.subtract.outer(values, baseline)).mean())


def holm(p_values: Array) -> Array:
    """Return p-values adjusted for testing all of them together (Holm 1979); NaN stays NaN and is not counted."""
    adjusted = np.full(len(p_values), np.nan)
    order = np.argsort(p_values, kind="stable")[: np.count_nonzero(~np.isnan(p_values))]  # NaN sorts last
    steps = p_values[order] * np.arange(len(order), 0, -1)
    adjusted[order] = np.minimum(np.maximum.accumulate(steps), 1.0)
    return adjusted


def _permutation_p_value(values: Array, baseline: Array, rng: np.random.Generator | int) -> float:
    """Return twice the smaller tail of the difference of means over every split, or over `PERMUTATIONS` random ones.

    The exact test is our own because a report makes dozens of them over the same splits: it sums the whole table of
    splits at once and keeps it. For ten seeds against ten that takes 0.09 s the first time and 0.016 s from then on,
    where `scipy.stats.permutation_test` takes 2.65 s for the same p.
    """
    pooled, count = np.concatenate([values, baseline]), len(values)
    if math.comb(len(pooled), count) > PERMUTATIONS:
        sampled = stats.permutation_test(
            (values, baseline),
            lambda a, b, axis: np.mean(a, axis=axis) - np.mean(b, axis=axis),
            n_resamples=PERMUTATIONS,
            batch=20_000,
            rng=rng,
        )
        return float(sampled.pvalue)
    sums = pooled[_splits(len(pooled), count)].sum(axis=1)
    slack = 1e-12 * float(np.abs(pooled).sum())  # splits that tie with the one observed, but for rounding
    observed = float(values.sum())
    tail = min(np.mean(sums >= observed - slack), np.mean(sums <= observed + slack))
    return min(1.0, 2.0 * float(tail))


@functools.lru_cache(maxsize=4)
def _splits(total: int, count: int) -> NDArray[np.int8]:
    """Return every choice of `count` of `total` indices, one per row."""
    flat = itertools.chain.from_iterable(itertools.combinations(range(total), count))
    return np.fromiter(flat, dtype=np.int8).reshape(-1, count)
