"""Whether a target is reached: what was measured, compared with what was wanted."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.experiments.catalogue.experiment import Target
from scla_mj.experiments.report.evidence import Evidence, Study, estimate
from scla_mj.experiments.report.tables import Interval
from scla_mj.experiments.statistics import span_means


class Verdict(NamedTuple):
    """A target judged; `reached` and `measured` are None where it could not be."""

    evidence: Evidence
    target: Target
    measured: float | None
    interval: Interval | None
    reached: bool | None


def judge(study: Study, evidence: Evidence, target: Target) -> Verdict:
    """Compare what was measured with what was wanted.

    A target needs every seed and every epoch that it names, at the catalogue's scale, of the experiment and its rivals.
    """
    rivals = [study.named(name) for name in target.rivals]
    if not all(_covers(item, target) for item in (evidence, *rivals)):
        return Verdict(evidence, target, None, None, None)
    seeds = _seed_means(evidence, target)
    if rivals:
        target = target._replace(low=max(float(_seed_means(rival, target).mean()) for rival in rivals if rival))
    mean = estimate(seeds)
    interval = None if math.isnan(mean.low) else Interval(mean.low, mean.high)
    if target.statistic == "interval holds":
        reached = interval is not None and bool(interval.low <= target.low and target.high <= interval.high)
        return Verdict(evidence, target, mean.mean, interval, reached)
    worst = target.statistic == "worst seed percent of ceiling"
    measured = float(seeds.min()) if worst else mean.mean
    return Verdict(evidence, target, measured, None if worst else interval, bool(target.low <= measured <= target.high))


def _covers(evidence: Evidence | None, target: Target) -> bool:
    if evidence is None or evidence.reduced or evidence.gaps:
        return False
    return evidence.measured and target.last_epoch <= evidence.epochs


def _seed_means(evidence: Evidence, target: Target) -> NDArray[np.float64]:
    values = evidence.percent if "percent" in target.statistic else evidence.hits
    return span_means(values, target.first_epoch, target.last_epoch)
