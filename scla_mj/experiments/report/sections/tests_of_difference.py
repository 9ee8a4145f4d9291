"""Whether an experiment differs from the one it is compared with, and by how much."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from scla_mj.experiments import statistics
from scla_mj.experiments.report.document import Cell, Column, Table
from scla_mj.experiments.report.evidence import Evidence, Study, generator
from scla_mj.experiments.report.sections import parts

_SEEDS_OF_AN_EFFECT: Final = 3
"""Of fewer seeds an effect size says next to nothing: two against two lie wholly apart by chance one time in three."""


class Pair(NamedTuple):
    """One comparison: an experiment and its baseline over the same epochs."""

    item: Evidence
    baseline: Evidence
    first: int
    last: int
    result: statistics.Difference


def difference_table(key: str, what: str, items: Sequence[Evidence], study: Study) -> list[Table]:
    """Return the table of tests of `items` against their baselines, in the first epoch and settled; none if none."""
    pairs = [pair for item in items for pair in pairs_of(item, study.named(item.experiment.baseline))]
    if not pairs:
        return []
    adjusted = statistics.holm(np.array([pair.result.p_value for pair in pairs]))
    columns = (
        Column("experiment"), Column("against"), Column("epochs"), Column("difference", 2), Column("p", 4),
        Column("p (Holm)", 4), Column("Hedges' g", 2), Column("Cliff's δ", 2), Column("seeds"),
    )  # fmt: skip
    exact = "exact" if all(pair.result.exact for pair in pairs) else "exact where 200 000 splits suffice, else sampled"
    caption = (
        f"Tests of difference of {what} against its baseline: percentage points of ceiling, over the same epochs of "
        f"both. Two-sided permutation test over seeds ({exact}), adjusted for the {len(pairs)} tests of this table "
        f"(Holm); effect sizes: Hedges' g (infinite where no seed varies) and Cliff's δ. "
        f"{parts.setting(*items)}"
    )
    return [Table(f"tests-{key}", caption, columns, tuple(map(_row, pairs, adjusted.tolist())))]


def pairs_of(item: Evidence, baseline: Evidence | None) -> list[Pair]:
    """Return the comparisons of an experiment: epoch 1, and the span when both have settled."""
    if baseline is None:
        return []
    spans = dict.fromkeys([(1, 1), statistics.settled_span(min(item.epochs, baseline.epochs))])
    return [Pair(item, baseline, first, last, compare_spans(item, baseline, first, last)) for first, last in spans]


def compare_spans(item: Evidence, baseline: Evidence, first: int, last: int) -> statistics.Difference:
    """Test the percent of ceiling over a span of epochs."""
    values, others = (statistics.span_means(each.percent, first, last) for each in (item, baseline))
    return statistics.compare(values, others, rng=generator())


def _effect_sizes(pair: Pair) -> tuple[Cell, Cell]:
    if min(len(pair.item.runs), len(pair.baseline.runs)) < _SEEDS_OF_AN_EFFECT:
        return None, None
    return pair.result.hedges_g, pair.result.cliffs_delta


def _row(pair: Pair, adjusted: float) -> tuple[Cell, ...]:
    result = pair.result
    return (
        pair.item.experiment.title, pair.baseline.experiment.title, parts.span_text(pair.first, pair.last),
        result.difference, result.p_value, adjusted, *_effect_sizes(pair),
        f"{len(pair.item.runs)}, {len(pair.baseline.runs)}",
    )  # fmt: skip
