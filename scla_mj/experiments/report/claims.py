"""What may be said of SCLA next to the best of the ladder, and what its network did: computed, in figures and words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from scla_mj.experiments import statistics
from scla_mj.experiments.report.evidence import Evidence, Stretch
from scla_mj.experiments.report.study import Study
from scla_mj.experiments.report.tables import Interval, Row, Table, span_text
from scla_mj.experiments.report.wording import distinct, setting
from scla_mj.experiments.scale import FIRST_MARGIN, SETTLED_MARGIN

FORMS: Final = {"scla-dopamine": "one dopamine", "scla-printed": "as printed"}
"""The two forms of SCLA and what tables call them."""
DIFFERENCE_INTERVAL: Final = f"{100 * statistics.CONFIDENCE:.0f} % interval of the difference"


class Claim(NamedTuple):
    """An experiment next to another over the same epochs, in percentage points of the ceiling."""

    item: Evidence
    rival: Evidence
    first: int
    last: int
    margin: float
    """Within how many points the two count as equal."""
    p_holm: float
    """Adjusted for all claims that are made together."""

    @property
    def epochs(self) -> str:
        """As a sentence names them."""
        return f"epoch{'s' if self.last > self.first else ''} {span_text(self.first, self.last)}"

    @property
    def own(self) -> Stretch:
        """The experiment over these epochs."""
        return self.item.over(self.first, self.last)

    @property
    def other(self) -> Stretch:
        """The rival over these epochs."""
        return self.rival.over(self.first, self.last)

    @property
    def difference(self) -> statistics.Difference:
        """The experiment less the rival."""
        return statistics.compare(self.own.percent, self.other.percent)

    @property
    def equal(self) -> bool:
        """Whether both one-sided tests reject a difference of the margin or more."""
        found = statistics.equivalence(self.own.percent, self.other.percent, self.margin)
        return found.p_value <= statistics.TEST_LEVEL

    @property
    def words(self) -> str:
        """What the tests allow to say."""
        if math.isnan(self.p_holm):
            return "not tested: a single seed"
        if self.p_holm > statistics.TEST_LEVEL:
            within = f"within {self.margin:g} points"
            return f"the same {within} (TOST)" if self.equal else f"neither different nor shown to be the same {within}"
        word = "more" if self.difference.difference > 0.0 else "less"
        return f"{word}, by less than {self.margin:g} points (TOST)" if self.equal else word


def best_of_ladder(study: Study) -> list[Claim]:
    """Return the claims of both forms of SCLA against whoever of the ladder earned most over the same epochs.

    They are of the first epoch and of the epochs in which all of them have settled, in both protocols.
    """
    ladder = dict(study.by_protocol("ladder"))
    found = []
    for item in study.of_brains(*FORMS):
        rivals = ladder.get(item.experiment.config.protocol, [])
        last = min(each.epochs for each in (item, *rivals))
        for span, margin in _spans(last):
            earned = [float(rival.over(*span).hits.mean()) for rival in rivals]
            found += [Claim(item, rivals[int(np.argmax(earned))], *span, margin, math.nan)] if rivals else []
    return _adjusted(found)


def without_network(study: Study) -> list[Claim]:
    """Return the claims of both forms of SCLA against the automata that decide everywhere, in both protocols."""
    found = []
    for item in study.of_brains(*FORMS):
        bare = study.named(f"automata-everywhere-{item.experiment.config.protocol}")
        if bare:
            spans = _spans(min(item.epochs, bare.epochs))
            found += [Claim(item, bare, *span, margin, math.nan) for span, margin in spans]
    return _adjusted(found)


def _spans(last: int) -> list[tuple[tuple[int, int], float]]:
    spans = {(1, 1): FIRST_MARGIN}
    return list((spans | {statistics.settled_span(last): SETTLED_MARGIN}).items())


def _adjusted(claims: Sequence[Claim]) -> list[Claim]:
    p_values = statistics.holm(np.array([claim.difference.p_value for claim in claims]))
    return [claim._replace(p_holm=float(p)) for claim, p in zip(claims, p_values, strict=True)]


def claims_table(key: str, claims: Sequence[Claim]) -> Table:
    """Return one row per claim: both sides, the difference with its interval and effect sizes, and what they allow."""
    columns = {"experiment": None, "epochs": None, "hits per 1000": 1, "compared with": None, "its hits": 1,
               "difference, points": 2, DIFFERENCE_INTERVAL: 2, "Hedges' g": 2, "Cliff's δ": 2, "p (Holm)": 4,
               "verdict": None}  # fmt: skip
    rows: list[Row] = []
    for claim in claims:
        found = claim.difference
        rows.append((claim.item.experiment.title, span_text(claim.first, claim.last), float(claim.own.hits.mean()),
                     claim.rival.experiment.title, float(claim.other.hits.mean()), found.difference,
                     Interval(found.low, found.high), found.hedges_g, found.cliffs_delta, claim.p_holm,
                     claim.words))  # fmt: skip
    return Table(key, columns, rows, setting(*distinct(each for claim in claims for each in (claim.item, claim.rival))))


def relayed(items: Sequence[Evidence]) -> tuple[int, int]:
    """Return in how many decisions an automaton had drawn the direction, and in how many the network followed it."""
    runs = [run for item in items for run in item.runs]
    return sum(run.advised for run in runs), sum(run.relayed for run in runs)
