"""Whether a target is reached: what was measured, compared with what was wanted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from scla_mj.experiments import statistics
from scla_mj.experiments.experiment import Target
from scla_mj.experiments.report.evidence import Array, Evidence
from scla_mj.experiments.report.study import Study
from scla_mj.experiments.report.tables import INTERVAL, Interval, Row, Table, measured, span_text
from scla_mj.experiments.report.wording import distinct, setting

_WORST: Final[dict[str, Callable[[Array], Any]]] = {"worst": np.min, "least": np.min, "most": np.max}


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
    seeds = _seed_values(evidence, target)
    if target.statistic.startswith("equivalent"):
        return _equivalence(evidence, target, seeds, [_seed_values(rival, target) for rival in rivals if rival])
    if rivals:
        target = target._replace(low=max(float(_seed_values(rival, target).mean()) for rival in rivals if rival))
    mean, interval = _summary(target, seeds)
    return Verdict(evidence, target, mean, interval, bool(target.low <= mean <= target.high))


def _summary(target: Target, seeds: Array) -> tuple[float, Interval | None]:
    """Return the mean over seeds with its interval, or the worst of them."""
    worst = target.statistic.split()[0]
    if worst not in _WORST:
        return measured(seeds)
    return float(_WORST[worst](seeds)), None


def _equivalence(evidence: Evidence, target: Target, seeds: Array, rivals: Sequence[Array]) -> Verdict:
    """Judge by the 90 % interval; a single seed has none and reaches nothing."""
    margin, middle = (target.high - target.low) / 2.0, (target.high + target.low) / 2.0
    found = statistics.equivalence(seeds, rivals[0] + middle if rivals else middle, margin)
    mean, low, high = (value + middle for value in found[:3])
    return Verdict(evidence, target, mean, Interval(low, high), found.p_value <= statistics.TEST_LEVEL)


def _covers(evidence: Evidence | None, target: Target) -> bool:
    if evidence is None or evidence.reduced or evidence.gaps:
        return False
    return bool(evidence.runs) and target.last_epoch <= evidence.epochs and _measurable(evidence, target)


def _measurable(evidence: Evidence, target: Target) -> bool:
    return "weight" not in target.statistic or evidence.weights is not None


def _seed_values(evidence: Evidence, target: Target) -> Array:
    span = target.first_epoch, target.last_epoch
    weights = evidence.weights_over(*span) if "weight" in target.statistic else None
    if weights is not None:
        return weights.gap if "gap" in target.statistic else getattr(weights, target.statistic.split()[0])
    stretch = evidence.over(*span)
    return stretch.percent if "percent" in target.statistic else stretch.hits


def targets_table(judged: Sequence[Verdict]) -> Table:
    """Return one row per target: what was wanted, what was measured, and the verdict."""
    columns = {"experiment": None, "target": None, "epochs": None, "measured": 2, INTERVAL: 2, "verdict": None}
    return Table("targets", columns, [_row(verdict) for verdict in judged])


def _row(verdict: Verdict) -> Row:
    experiment, target = verdict.evidence.experiment, verdict.target
    span = span_text(target.first_epoch, target.last_epoch)
    return experiment.title, _wanted(verdict), span, verdict.measured, verdict.interval, _word(verdict)


def _word(verdict: Verdict) -> str:
    unknown = "not judged" if verdict.evidence.reduced else "not measured"
    return {True: "reached", False: "missed", None: unknown}[verdict.reached]


def _wanted(verdict: Verdict) -> str:
    target = verdict.target
    raised = target.rivals and verdict.reached is not None and not target.statistic.startswith("equivalent")
    return f"{target.text}: {target.low:.1f}" if raised else target.text


def forms_table(judged: Sequence[Verdict], study: Study, brain: str, other: str) -> Table:
    """Return the targets of one form of SCLA with what the other form earns in the same worlds and epochs.

    Both are in the target's own unit; of an equivalence each form's own mean is shown, and the verdict is the test's.
    """
    columns = {"experiment": None, "must reach": None, "epochs": None, "unit": None, "one dopamine": 2, INTERVAL: 2,
               "as printed": 2, f"as printed: {INTERVAL}": 2, "verdict": None}  # fmt: skip
    rows: list[Row] = []
    own = [each for each in judged if each.evidence.experiment.config.brain == brain and each.evidence.runs]
    pairs = [(each.evidence, study.with_brain(each.evidence, other)) for each in own]
    for verdict, pair in zip(own, pairs, strict=True):
        item, target = verdict.evidence, verdict.target
        both = (cell for each in pair for cell in _shown(each, target))
        span, unit = span_text(target.first_epoch, target.last_epoch), _unit(target)
        rows.append((item.experiment.title, _wanted(verdict), span, unit, *both, _word(verdict)))
    shown = distinct(each for pair in pairs for each in pair if each)
    return Table("forms", columns, rows, setting(*shown) if shown else "")


def _shown(item: Evidence | None, target: Target) -> tuple[float | None, Interval | None]:
    if item is None or target.last_epoch > item.epochs or not _measurable(item, target):
        return None, None
    return _summary(target, _seed_values(item, target))


def _unit(target: Target) -> str:
    return "mV" if "weight" in target.statistic else "%" if "percent" in target.statistic else "hits per 1000"
