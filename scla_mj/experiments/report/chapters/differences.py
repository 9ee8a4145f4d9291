"""Whether an experiment differs from the one it is compared with, and by how much."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from scla_mj.experiments import statistics
from scla_mj.experiments.report.chapters import shared
from scla_mj.experiments.report.evidence import Evidence, Study, generator
from scla_mj.experiments.report.tables import Cell, Row, Table

_SEEDS_OF_AN_EFFECT: Final = 3
"""Of fewer seeds an effect size says next to nothing: two against two lie wholly apart by chance one time in three."""


class Pair(NamedTuple):
    """One comparison: an experiment and its baseline over the same epochs."""

    item: Evidence
    baseline: Evidence
    first: int
    last: int
    result: statistics.Difference


class Tests(NamedTuple):
    """A table of tests, how many they are, and whether all of them are exact."""

    table: Table
    number: int
    exact: bool


def difference_table(key: str, items: Sequence[Evidence], study: Study) -> Tests | None:
    """Return the tests of `items` against their baselines, in the first epoch and settled; None without any."""
    pairs = [pair for item in items for pair in pairs_of(item, study.named(item.experiment.baseline))]
    if not pairs:
        return None
    adjusted = statistics.holm(np.array([pair.result.p_value for pair in pairs]))
    columns = {
        "experiment": None, "against": None, "epochs": None, "difference": 2, "p": 4, "p (Holm)": 4, "Hedges' g": 2,
        "Cliff's δ": 2, "seeds": None,
    }  # fmt: skip
    table = Table(f"tests-{key}", columns, [*map(_row, pairs, adjusted.tolist())], shared.setting(*items))
    return Tests(table, len(pairs), all(pair.result.exact for pair in pairs))


def pairs_of(item: Evidence, baseline: Evidence | None) -> list[Pair]:
    """Return the comparisons of an experiment in percent of ceiling: epoch 1, and the span when both have settled."""
    if baseline is None:
        return []
    pairs = []
    for span in dict.fromkeys([(1, 1), statistics.settled_span(min(item.epochs, baseline.epochs))]):
        values, others = (statistics.span_means(each.percent, *span) for each in (item, baseline))
        pairs.append(Pair(item, baseline, *span, statistics.compare(values, others, rng=generator())))
    return pairs


def _row(pair: Pair, adjusted: float) -> Row:
    result, seeds = pair.result, (len(pair.item.runs), len(pair.baseline.runs))
    known = min(seeds) >= _SEEDS_OF_AN_EFFECT
    effects: tuple[Cell, Cell] = (result.hedges_g, result.cliffs_delta) if known else (None, None)
    return (
        pair.item.experiment.title, pair.baseline.experiment.title, shared.span_text(pair.first, pair.last),
        result.difference, result.p_value, adjusted, *effects, f"{seeds[0]}, {seeds[1]}",
    )  # fmt: skip
