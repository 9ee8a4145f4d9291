"""The first chapter: what was asked, what came out."""

from __future__ import annotations

from itertools import groupby

from scla_mj.experiments import statistics
from scla_mj.experiments.catalogue import CATALOGUE
from scla_mj.experiments.report.coverage import in_catalogue
from scla_mj.experiments.report.document import (
    Block,
    Bullets,
    Cell,
    Column,
    Interval,
    Mark,
    Paragraph,
    Section,
    Strong,
    Table,
    Text,
)
from scla_mj.experiments.report.evidence import Evidence, Study
from scla_mj.experiments.report.sections import parts
from scla_mj.experiments.report.verdicts import Verdict, judge
from scla_mj.grid import PROTOCOLS


def summary(study: Study) -> Section:
    """Return the verdict on every target, and the list of what is missing."""
    verdicts = [judge(study, item, target) for item in study.evidence for target in item.experiment.targets]
    blocks: list[Block] = [*_scale(study), *_headlines(study), *_counts(verdicts)]
    if verdicts:
        blocks.append(_table(verdicts))
    return Section("summary", "Summary", (*blocks, *_missing(study)))


def _headlines(study: Study) -> list[Block]:
    """Return what SCLA and the automaton alone earned, in a sentence each."""
    items = [study.of_brain(brain, protocol) for brain in ("scla", "automaton") for protocol in PROTOCOLS]
    sentences = [_headline(item) for item in items if item is not None]
    return [Bullets(tuple(sentences))] if sentences else []


def _headline(item: Evidence) -> Text:
    span = statistics.settled_span(item.epochs)
    hits, percent = (statistics.span_means(values, *span) for values in (item.hits, item.percent))
    return (
        Strong(parts.opening(item.experiment.title)),
        f": {parts.mean_with_interval(hits, 1)} of at most {item.ceilings[-1]:g} hits per 1000 decisions over epochs "
        f"{parts.span_text(*span)}, {percent.mean():.1f} % of the ceiling; {item.hits[:, 0].mean():.1f} in the first "
        "epoch.",
    )


def _scale(study: Study) -> tuple[Block, ...]:
    """Say on top where experiments are smaller than the catalogue's, so that no figure is taken for a full one."""
    reduced = [item.experiment for item in study.evidence if item.reduced]
    if not reduced:
        return ()
    own = parts.scale_text(reduced)
    full = parts.scale_text([each for each in map(in_catalogue, reduced) if each is not None])
    which = ":" if len(reduced) == len(study.evidence) else f" of {', '.join(each.name for each in reduced)}:"
    text = f"{which} {own}, where the catalogue has {full}; the targets of such runs are not judged."
    return (Paragraph((Strong("These are reduced-scale runs"), text)),)


def _counts(verdicts: list[Verdict]) -> tuple[Block, ...]:
    verdicts = [verdict for verdict in verdicts if not verdict.evidence.reduced]
    if not verdicts:
        return ()
    reached, missed, unknown = (sum(v.reached is kind for v in verdicts) for kind in (True, False, None))
    tail = f", {unknown} could not be judged from the runs that are here" if unknown else ""
    return (Paragraph((Strong(f"{reached} of {len(verdicts)} targets reached"), f", {missed} missed{tail}.")),)


def _table(verdicts: list[Verdict]) -> Table:
    columns = (
        Column("experiment"), Column("target"), Column("epochs"), Column("measured", 2),
        Column(parts.INTERVAL, 2), Column("verdict"),
    )  # fmt: skip
    caption = (
        "Every target beside what was measured, in the target's own unit: hits per 1000 decisions, or percent of the "
        f"ceiling. Mean over seeds with its {parts.INTERVAL}, or the worst seed. Protocol, ceiling and seeds of each "
        "experiment stand in its own table below."
    )
    return Table("targets", caption, columns, tuple(_row(verdict) for verdict in verdicts))


def _row(verdict: Verdict) -> tuple[Cell, ...]:
    experiment, target = verdict.evidence.experiment, verdict.target
    unknown = Mark("not judged" if verdict.evidence.reduced else "not measured", "open")
    mark = {
        True: Mark("reached", "good"), False: Mark("missed", "bad"), None: unknown,
    }[verdict.reached]  # fmt: skip
    span = parts.span_text(target.first_epoch, target.last_epoch)
    wanted = f"{target.text}: {target.low:.1f}" if target.rivals and verdict.reached is not None else target.text
    interval: Interval | None = verdict.interval
    return experiment.title, wanted, span, verdict.measured, interval, mark


def _missing(study: Study) -> tuple[Block, ...]:
    """Name what is not in OUT, so that nothing is taken for measured that is not."""
    gaps = study.gaps()
    if not gaps:
        return (Paragraph(_complete(study)),)
    items = []
    for (experiment, reason), group in groupby(gaps, key=lambda gap: (gap.experiment, gap.reason)):
        items.append((Strong(experiment), f": {parts.seeds_text([gap.seed for gap in group])}: {reason}"))
    return Paragraph("Missing from this report:"), Bullets(tuple(items))


def _complete(study: Study) -> str:
    """Say that nothing is missing, and of what: of the catalogue only if all of it is here at its full scale."""
    whole = {item.experiment.name for item in study.evidence if not item.reduced}
    if whole >= {experiment.name for experiment in CATALOGUE}:
        return "Every run of every experiment is here and complete."
    count = sum(in_catalogue(item.experiment) is not None for item in study.evidence)
    return (
        "Every run that this report covers is here and complete; it covers "
        f"{count} of the catalogue's {len(CATALOGUE)} experiments."
    )
