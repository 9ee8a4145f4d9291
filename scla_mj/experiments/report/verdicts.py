"""Whether a target is reached: what was measured, compared with what was wanted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from scla_mj.experiments import statistics
from scla_mj.experiments.experiment import Target
from scla_mj.experiments.report.evidence import Array, Evidence, Study
from scla_mj.experiments.report.tables import INTERVAL, Interval, Row, Table, measured, span_text


class Verdict(NamedTuple):
    """A target judged; `reached` and `measured` are None where it could not be."""

    evidence: Evidence
    target: Target
    measured: float | None = None
    interval: Interval | None = None
    reached: bool | None = None


def verdicts(study: Study) -> list[Verdict]:
    """Return every target of every experiment, judged."""
    return [judge(study, item, target) for item in study.evidence for target in item.experiment.targets]


def judge(study: Study, evidence: Evidence, target: Target) -> Verdict:
    """Compare what was measured with what was wanted.

    A target needs every seed and every epoch that it names, at the catalogue's scale, of the experiment and its rivals.
    """
    rivals = [study.named(name) for name in target.rivals]
    if not all(_covers(item, target) for item in (evidence, *rivals)):
        return Verdict(evidence, target)
    seeds = _seed_means(evidence, target)
    if target.statistic.startswith("equivalent"):
        return _equivalence(evidence, target, seeds, [_seed_means(rival, target) for rival in rivals if rival])
    if rivals:
        target = target._replace(low=max(float(_seed_means(rival, target).mean()) for rival in rivals if rival))
    mean, interval = measured(seeds)
    if target.statistic == "worst seed percent of ceiling":
        mean, interval = float(seeds.min()), None
    return Verdict(evidence, target, mean, interval, bool(target.low <= mean <= target.high))


def _equivalence(evidence: Evidence, target: Target, seeds: Array, rivals: Sequence[Array]) -> Verdict:
    """Judge by the 90 % interval; a single seed has none and reaches nothing."""
    margin, middle = (target.high - target.low) / 2.0, (target.high + target.low) / 2.0
    found = statistics.equivalence(seeds, rivals[0] + middle if rivals else middle, margin)
    mean, low, high = (value + middle for value in found[:3])
    return Verdict(evidence, target, mean, Interval(low, high), found.p_value <= statistics.TEST_LEVEL)


def _covers(evidence: Evidence | None, target: Target) -> bool:
    if evidence is None or evidence.reduced or evidence.gaps:
        return False
    return bool(evidence.runs) and target.last_epoch <= evidence.epochs


def _seed_means(evidence: Evidence, target: Target) -> Array:
    stretch = evidence.over(target.first_epoch, target.last_epoch)
    return stretch.percent if "percent" in target.statistic else stretch.hits


def targets_table(judged: Sequence[Verdict]) -> Table:
    """Return one row per target: what was wanted, what was measured, and the verdict."""
    columns = {"experiment": None, "target": None, "epochs": None, "measured": 2, INTERVAL: 2, "verdict": None}
    return Table("targets", columns, [_row(verdict) for verdict in judged])


def _row(verdict: Verdict) -> Row:
    experiment, target = verdict.evidence.experiment, verdict.target
    unknown = "not judged" if verdict.evidence.reduced else "not measured"
    word = {True: "reached", False: "missed", None: unknown}[verdict.reached]
    span = span_text(target.first_epoch, target.last_epoch)
    raised = target.rivals and verdict.reached is not None and not target.statistic.startswith("equivalent")
    wanted = f"{target.text}: {target.low:.1f}" if raised else target.text
    return experiment.title, wanted, span, verdict.measured, verdict.interval, word
