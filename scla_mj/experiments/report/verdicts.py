"""Whether a target is reached: the measured figure beside the wanted one."""

from __future__ import annotations

import math
from typing import NamedTuple

from scla_mj.experiments.catalogue.experiment import Target
from scla_mj.experiments.report.document import Interval
from scla_mj.experiments.report.evidence import Evidence, estimate
from scla_mj.experiments.statistics import span_means


class Verdict(NamedTuple):
    """A target judged; `reached` and `measured` are None where it could not be."""

    evidence: Evidence
    target: Target
    measured: float | None
    interval: Interval | None
    reached: bool | None


def judge(evidence: Evidence, target: Target) -> Verdict:
    """Compare what was measured with what was wanted; a target needs every seed and every epoch that it names."""
    if not evidence.measured or evidence.gaps or target.last_epoch > evidence.epochs:
        return Verdict(evidence, target, None, None, None)
    values = evidence.percent if "percent" in target.statistic else evidence.hits
    seeds = span_means(values, target.first_epoch, target.last_epoch)
    mean = estimate(seeds)
    interval = None if math.isnan(mean.low) else Interval(mean.low, mean.high)
    if target.statistic == "interval holds":
        reached = interval is not None and bool(interval.low <= target.low and target.high <= interval.high)
        return Verdict(evidence, target, mean.mean, interval, reached)
    worst = target.statistic == "worst seed percent of ceiling"
    measured = float(seeds.min()) if worst else mean.mean
    return Verdict(evidence, target, measured, None if worst else interval, bool(target.low <= measured <= target.high))
