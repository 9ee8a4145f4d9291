"""The tables of results: experiments side by side, next to the paper's figures, and tested against their baselines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from scla_mj.experiments import paper, statistics
from scla_mj.experiments.exact import next_to_the_target
from scla_mj.experiments.report.evidence import Array, Evidence
from scla_mj.experiments.report.study import Study
from scla_mj.experiments.report.tables import INTERVAL, Cell, Interval, Row, Table, measured, span_text
from scla_mj.experiments.report.wording import labels, setting
from scla_mj.grid import PROTOCOLS

_SEEDS_OF_AN_EFFECT: Final = 3
"""Of fewer seeds an effect size says next to nothing: two against two lie wholly apart by chance one time in three."""
_SKILL: Final = {"above chance, %": 1, "moves nearer, %": 2, "regret": 2}
_IN_PERCENT: Final = {"epoch 1, %": 1, "settled, %": 2, INTERVAL: 2, "worst seed, %": 1, **_SKILL}
_SPEED: Final = {"decisions to 90 %": 0, "reached by": None, "epochs": None, "seeds": 0}
_OF_THE_LADDER: Final = {"epoch 1": 1, "settled": 1, "% of ceiling": 1, "above chance, %": 1, "regret": 2}
_LEFT_OUT: Final = (": % of ceiling", ": above chance, %", "sensed-start: regret")
_COLUMNS: Final[dict[str, dict[str, int | None]]] = {
    "brain": {"epoch 1": 1, "settled": 2, INTERVAL: 2, "% of ceiling": 1, "moves per hit": 2, **_SKILL, **_SPEED},
    "world": {"ceiling": 2, **_IN_PERCENT, "moves per hit": 2, **_SPEED},
    "ablation": {"what it asks": None, "protocol": None, **_IN_PERCENT, **_SPEED},
}


def comparison(kind: str, key: str, items: Sequence[Evidence]) -> Table:
    """Return one row per experiment, of the columns for its `kind`: a brain, a world or an ablation."""
    columns = {kind: None, **_COLUMNS[kind]}
    rows = [{kind: item.experiment.title, **_measures(item, percent="settled, %" in columns)} for item in items]
    return Table(key, columns, [tuple(row[name] for name in columns) for row in rows], setting(*items))


def _measures(item: Evidence, *, percent: bool) -> dict[str, Cell]:
    """Return all that a table may show of an experiment; its interval is that of the percent of ceiling, or of hits."""
    settled = item.settled
    decisions, reached = _mastery(item)
    return {
        "what it asks": item.experiment.question,
        "protocol": item.experiment.config.protocol,
        "ceiling": item.ceilings[-1],
        "epoch 1": item.hits[:, 0].mean(),
        "epoch 1, %": item.percent[:, 0].mean(),
        "settled": settled.hits.mean(),
        "settled, %": settled.percent.mean(),
        INTERVAL: measured(settled.percent if percent else settled.hits)[1],
        "worst seed, %": settled.percent.min(),
        "% of ceiling": settled.percent.mean(),
        "moves per hit": settled.moves_per_hit,
        "above chance, %": settled.above_chance.mean(),
        "moves nearer, %": settled.nearer.mean(),
        "regret": settled.regret.mean(),
        "decisions to 90 %": decisions,
        "reached by": reached,
        "epochs": settled.epochs,
        "seeds": len(item.runs),
    }


def _mastery(item: Evidence) -> tuple[float | None, str | None]:
    """Return the median decision at which the seeds reached mastery (None if half never did), and how many did.

    Both are None for runs that are shorter than the window over which mastery is measured.
    """
    if item.experiment.config.epochs * item.experiment.config.decisions < statistics.WINDOW_DECISIONS:
        return None, None
    reached = sorted(math.inf if run.mastery is None else float(run.mastery) for run in item.runs)
    count, half = sum(map(math.isfinite, reached)), len(reached) // 2
    known = math.isfinite(reached[half])  # the upper of the middle two, where their mean is the median
    return float(np.median(reached)) if known else None, f"{count} of {len(reached)}"


def ladder(study: Study) -> Table | None:
    """Return every brain of the ladder, SCLA and its bounds, over the same epochs: both protocols, and crossed wheels.

    None if there are no runs of any; the least number of epochs says which count as settled.
    """
    items = study.group("paper", "comparison", "ladder")
    crossed = [item for item in study.group("world") if item.crossed_epoch == 1]
    if not items:
        return None
    last = min(item.epochs for item in (*items, *crossed))
    first, span = 1, statistics.settled_span(last)
    columns: dict[str, int | None] = {"brain": None}
    parts = []
    for protocol in PROTOCOLS:
        columns |= {f"{protocol}: {name}": decimals for name, decimals in _OF_THE_LADDER.items()}
        parts.append([item for item in items if item.experiment.config.protocol == protocol])
    for protocol in PROTOCOLS:
        columns[f"crossed wheels, {protocol}: settled"] = 1
        parts.append([item for item in crossed if item.experiment.config.protocol == protocol])
    columns["seeds"] = None
    rows: list[Row] = []
    for brain in dict.fromkeys(item.brain for item in items):
        own = [next((item for item in part if item.brain == brain), None) for part in parts]
        known = [item for item in own if item]
        title = known[0].experiment.title.removesuffix(f", {known[0].experiment.config.protocol}")
        plain = [cell for item in own[: len(PROTOCOLS)] for cell in _rung(item, first, span)]
        cross = [item.over(*span).hits.mean() if item else None for item in own[len(PROTOCOLS) :]]
        seeds = dict.fromkeys(len(item.runs) for item in known)
        rows.append((title, *plain, *cross, " or ".join(map(str, seeds))))
    said = f"Settled: epochs {span_text(*span)} of every run. {setting(*items, *crossed)}"
    return Table("ladder", columns, rows, said)


def brief(ladder: Table) -> Table:
    """Return the ladder for a first page: without what follows from its other columns."""
    kept = [index for index, name in enumerate(ladder.columns) if not name.endswith(_LEFT_OUT)]
    names = list(ladder.columns)
    rows = [tuple(row[index] for index in kept) for row in ladder.rows]
    return Table(ladder.key, {names[index]: ladder.columns[names[index]] for index in kept}, rows, ladder.setting)


def _rung(item: Evidence | None, first: int, span: tuple[int, int]) -> tuple[Cell, ...]:
    if item is None:
        return (None,) * len(_OF_THE_LADDER)
    settled = item.over(*span)
    return (item.over(first, first).hits.mean(), settled.hits.mean(), settled.percent.mean(),
            settled.above_chance.mean(), settled.regret.mean())  # fmt: skip


def jump_table(key: str, items: Sequence[Evidence]) -> Table:
    """Return the epochs from the one before the target's jump, of several brains in the same world."""
    columns: dict[str, int | None] = {"epoch": 0, "ceiling": 2, "chance": 2}
    for name in labels(items):
        columns |= {f"{name}: hits per 1000": 2, f"{name}: {INTERVAL}": 2, f"{name}: % of ceiling": 1,
                    f"{name}: above chance, %": 1}  # fmt: skip
    one, rows = items[0], list[Row]()
    for epoch in range(max(1, one.jump_epoch - 1), one.epochs + 1):
        stretches = [item.over(epoch, epoch) for item in items]
        cells = [cell for each in stretches
                 for cell in (*measured(each.hits), each.percent.mean(), each.above_chance.mean())]  # fmt: skip
        rows.append((epoch, one.ceilings[epoch - 1], one.chances[epoch - 1], *cells))
    return Table(key, columns, rows, setting(*items))


def table_5(items: Sequence[Evidence]) -> Table:
    """Return the paper's Table 5 next to our epochs, for each form of SCLA under each protocol."""
    columns: dict[str, int | None] = {"epoch": None, "paper": 2}
    for name in (item.experiment.title for item in items):
        columns |= {name: 2, f"{name}: {INTERVAL}": 2}
    last = min(len(paper.TABLE_5), *(item.epochs for item in items))
    rows: list[Row] = []
    for first, end in [(epoch, epoch) for epoch in range(1, last + 1)] + [(1, last)]:
        ours = [cell for item in items for cell in measured(item.over(first, end).hits)]
        rows.append((span_text(first, end), float(np.mean(paper.TABLE_5[first - 1 : end])), *ours))
    rows[-1] = (f"mean of {rows[-1][0]}", *rows[-1][1:])
    bounds = [(name, None, *(cell for item in items for cell in (getattr(item, values)[0], None)))
              for name, values in (("chance", "chances"), ("ceiling", "ceilings"))]  # fmt: skip
    return Table("table-5", columns, [*rows, *bounds], setting(*items))


def automaton(item: Evidence) -> Table:
    """Return what the automaton alone earns: the paper's, what is exact, and ours."""
    columns = {"source": None, "epochs": None, "hits per 1000": 2, INTERVAL: 2, "moves per hit": 2}
    exact = next_to_the_target()
    rows: list[Row] = [
        ("paper, the automaton alone", None, paper.AUTOMATON_HITS, None, paper.AUTOMATON_MOVES),
        ("exact: perfect next to the target, random elsewhere", None, exact, None, 1000.0 / exact),
    ]
    first, last = paper.AUTOMATON_SPAN
    papers = [item.over(first, min(last, item.epochs))] if first <= item.epochs else []
    rows += [("ours", each.epochs, *measured(each.hits), each.moves_per_hit) for each in (*papers, item.settled)]
    return Table("automaton", columns, rows, setting(item))


def differences(key: str, items: Sequence[Evidence], study: Study) -> tuple[Table, bool] | None:
    """Return the tests of `items` against their baselines in percent of ceiling, and whether all of them are exact.

    Each is tested in the first epoch and when both have settled; None if there is no baseline.
    """
    baselines = [(item, study.named(item.experiment.baseline)) for item in items]
    tests = [
        (item, other, span_text(*span), compare_over(item, other, *span))
        for item, other in baselines
        if other
        for span in shared_spans(item, other)
    ]
    if not tests:
        return None
    adjusted = statistics.holm(np.array([result.p_value for *_, result in tests]))
    columns = {
        "experiment": None, "against": None, "epochs": None, "difference": 2, INTERVAL: 2, "p": 4, "p (Holm)": 4,
        "Hedges' g": 2, "Cliff's δ": 2, "seeds": None,
    }  # fmt: skip
    rows: list[Row] = []
    for (item, other, epochs, result), p_value in zip(tests, adjusted, strict=True):
        seeds = len(item.runs), len(other.runs)
        effects = (result.hedges_g, result.cliffs_delta) if min(seeds) >= _SEEDS_OF_AN_EFFECT else (None, None)
        rows.append((item.experiment.title, other.experiment.title, epochs, result.difference,
                     Interval(result.low, result.high), result.p_value, p_value, *effects,
                     f"{seeds[0]}, {seeds[1]}"))  # fmt: skip
    return Table(f"tests-{key}", columns, rows, setting(*items)), all(result.exact for *_, result in tests)


def shared_spans(item: Evidence, baseline: Evidence) -> list[tuple[int, int]]:
    """Return the first epoch and the epochs in which both have settled; both of the changed world where it changes."""
    first, last = item.changed_epoch, min(item.epochs, baseline.epochs)
    return list(dict.fromkeys([(first, first), item.settled_within(last)]))


def compare_over(item: Evidence, baseline: Evidence, first: int, last: int) -> statistics.Difference:
    """Test an experiment against its baseline over the same epochs of both."""
    return statistics.compare(item.over(first, last).percent, baseline.over(first, last).percent)


def final_weights(item: Evidence) -> tuple[Array, Array]:
    """Return the mean agreeing and the mean opposite weight at the end, in mV, of every seed (seeds,)."""
    assert item.weights is not None
    agreeing, opposite = item.papers
    return item.weights[:, -1, agreeing].mean(axis=1), item.weights[:, -1, opposite].mean(axis=1)
