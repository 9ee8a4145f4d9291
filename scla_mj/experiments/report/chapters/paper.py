"""The paper's own results next to ours: Table 5, the automaton alone, Figure 3."""

from __future__ import annotations

from typing import Any

import numpy as np

from scla_mj.experiments import paper, statistics
from scla_mj.experiments.exact import beside_the_target
from scla_mj.experiments.report.chapters import shared
from scla_mj.experiments.report.evidence import Evidence, Study
from scla_mj.experiments.report.tables import Cell, Row, Table


def paper_results(study: Study) -> dict[str, Any]:
    """Return the paper's figures, each next to ours and to what is possible."""
    both = [study.of_brain("scla", protocol) for protocol in ("sensed-start", "any-start")]
    present = [item for item in both if item is not None]
    automaton = study.of_brain("automaton", "any-start")
    return {
        "table_5": _table_5(present) if present else None,
        "automaton": _automaton(automaton) if automaton else None,
        "figures_3": [(shared.weights_figure(item), item.experiment.config.network)
                      for item in present if item.weights is not None],
    }  # fmt: skip


def _table_5(items: list[Evidence]) -> Table:
    columns: dict[str, int | None] = {"epoch": None, "paper": 2}
    for name in (item.experiment.config.protocol for item in items):
        columns |= {f"ours, {name}": 2, f"{name}: {shared.INTERVAL}": 2, f"{name}: % of ceiling": 1}
    last = min(len(paper.TABLE_5), *(item.epochs for item in items))
    spans = [(epoch, epoch) for epoch in range(1, last + 1)] + [(1, last)]
    rows: list[Row] = []
    for first, end in spans:
        ours = [cell for item in items for cell in _cells(item, first, end)]
        rows.append((shared.span_text(first, end), float(np.mean(paper.TABLE_5[first - 1 : end])), *ours))
    rows[-1] = (f"mean of {rows[-1][0]}", *rows[-1][1:])
    ceilings = [cell for item in items for cell in (float(item.ceilings[0]), None, 100.0)]
    return Table("table-5", columns, [*rows, ("ceiling", None, *ceilings)], shared.setting(*items))


def _cells(item: Evidence, first: int, last: int) -> tuple[Cell, Cell, Cell]:
    hits, percent = (statistics.span_means(values, first, last) for values in (item.hits, item.percent))
    return *shared.measured(hits), float(percent.mean())


def _automaton(item: Evidence) -> Table:
    columns = {"source": None, "epochs": None, "hits per 1000": 2, shared.INTERVAL: 2, "moves per hit": 2}
    exact = beside_the_target()
    rows: list[Row] = [
        ("paper, the automaton alone", None, paper.AUTOMATON_HITS, None, paper.AUTOMATON_MOVES),
        ("exact: perfect beside the target, random elsewhere", None, exact, None, 1000.0 / exact),
    ]
    first, last = paper.AUTOMATON_SPAN
    for start, end in ((first, min(last, item.epochs)), statistics.settled_span(item.epochs)):
        if start <= end:
            hits = statistics.span_means(item.hits, start, end)
            moves = float(statistics.moves_per_hit(hits).mean())
            rows.append(("ours", shared.span_text(start, end), *shared.measured(hits), moves))
    return Table("automaton", columns, rows, shared.setting(item))
