"""The first chapter: what was asked, what came out, what is missing."""

from __future__ import annotations

from itertools import groupby
from typing import Any

from scla_mj.experiments import statistics
from scla_mj.experiments.catalogue import CATALOGUE
from scla_mj.experiments.report.chapters import shared
from scla_mj.experiments.report.coverage import in_catalogue
from scla_mj.experiments.report.evidence import Evidence, Study
from scla_mj.experiments.report.tables import Row, Table
from scla_mj.experiments.report.verdicts import Verdict, judge
from scla_mj.grid import PROTOCOLS


def summary(study: Study) -> dict[str, Any]:
    """Return the headlines, the verdict on every target, and the list of what is missing."""
    verdicts = [judge(study, item, target) for item in study.evidence for target in item.experiment.targets]
    judged = [verdict.reached for verdict in verdicts if not verdict.evidence.reduced]
    mains = [study.of_brain(brain, protocol) for brain in ("scla", "automaton") for protocol in PROTOCOLS]
    gaps = groupby(study.gaps(), key=lambda gap: (gap.experiment, gap.reason))
    whole = {item.experiment.name for item in study.evidence if not item.reduced}
    return {
        "reduced": _reduced(study),
        "headlines": [_headline(item) for item in mains if item is not None],
        "judged": len(judged),
        "reached": judged.count(True),
        "missed": judged.count(False),
        "unknown": judged.count(None),
        "targets": _table(verdicts) if verdicts else None,
        "gaps": [(name, shared.seeds_text([gap.seed for gap in group]), why) for (name, why), group in gaps],
        "whole": whole >= {experiment.name for experiment in CATALOGUE},
        "covered": sum(in_catalogue(item.experiment) is not None for item in study.evidence),
        "catalogue": len(CATALOGUE),
    }


def _headline(item: Evidence) -> dict[str, Any]:
    """Return what an experiment earned when settled and in its first epoch."""
    span = statistics.settled_span(item.epochs)
    hits, percent = (statistics.span_means(values, *span) for values in (item.hits, item.percent))
    return {
        "title": item.experiment.title,
        "hits": shared.mean_with_interval(hits, 1),
        "ceiling": item.ceilings[-1],
        "epochs": shared.span_text(*span),
        "percent": percent.mean(),
        "first": item.hits[:, 0].mean(),
    }


def _reduced(study: Study) -> dict[str, str] | None:
    """Return which experiments are smaller than the catalogue's, and by how much; None if none is."""
    reduced = [item.experiment for item in study.evidence if item.reduced]
    if not reduced:
        return None
    return {
        "names": "" if len(reduced) == len(study.evidence) else ", ".join(each.name for each in reduced),
        "own": shared.scale_text(reduced),
        "full": shared.scale_text([each for each in map(in_catalogue, reduced) if each is not None]),
    }


def _table(verdicts: list[Verdict]) -> Table:
    columns = {
        "experiment": None, "target": None, "epochs": None, "measured": 2, shared.INTERVAL: 2, "verdict": None
    }  # fmt: skip
    return Table("targets", columns, [_row(verdict) for verdict in verdicts])


def _row(verdict: Verdict) -> Row:
    experiment, target = verdict.evidence.experiment, verdict.target
    unknown = "not judged" if verdict.evidence.reduced else "not measured"
    word = {True: "reached", False: "missed", None: unknown}[verdict.reached]
    span = shared.span_text(target.first_epoch, target.last_epoch)
    wanted = f"{target.text}: {target.low:.1f}" if target.rivals and verdict.reached is not None else target.text
    return experiment.title, wanted, span, verdict.measured, verdict.interval, word
