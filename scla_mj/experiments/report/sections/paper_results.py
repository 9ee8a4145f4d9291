"""The paper's own results beside ours: Table 5, the automaton alone, Figure 3."""

from __future__ import annotations

import numpy as np

from scla_mj.experiments import paper, statistics
from scla_mj.experiments.exact import beside_the_target
from scla_mj.experiments.report.document import Block, Cell, Column, Paragraph, Section, Table
from scla_mj.experiments.report.evidence import Evidence, Study
from scla_mj.experiments.report.sections import parts
from scla_mj.experiments.report.sections.weights_figure import weights_figure


def paper_results(study: Study) -> Section:
    """Return the paper's figures, each beside ours and beside what is possible."""
    blocks: list[Block] = []
    both = [study.of_brain("scla", protocol) for protocol in ("sensed-start", "any-start")]
    present = [item for item in both if item is not None]
    if present:
        blocks.append(_table_5(present))
    automaton = study.of_brain("automaton", "any-start")
    if automaton is not None:
        blocks.append(_automaton(automaton))
    blocks += [weights_figure(item, "The paper's Figure 3: ") for item in present if item.weights is not None]
    if not blocks:
        blocks = [Paragraph("None of the paper's own experiments is among the runs.")]
    return Section("paper", "The paper beside ours", tuple(blocks))


def _table_5(items: list[Evidence]) -> Table:
    columns = [Column("epoch"), Column("paper", 2)]
    for item in items:
        name = item.experiment.config.protocol
        columns += [
            Column(f"ours, {name}", 2),
            Column(f"{name}: {parts.INTERVAL}", 2),
            Column(f"{name}: % of ceiling", 1),
        ]
    span = min(len(paper.TABLE_5), *(item.epochs for item in items))
    rows: list[tuple[Cell, ...]] = []
    for epoch in range(1, span + 1):
        ours = [cell for item in items for cell in _cells(item, epoch, epoch)]
        rows.append((str(epoch), paper.TABLE_5[epoch - 1], *ours))
    mean = float(np.mean(paper.TABLE_5[:span]))
    rows.append(
        (f"mean of {parts.span_text(1, span)}", mean, *(cell for item in items for cell in _cells(item, 1, span)))
    )
    ceilings = [cell for item in items for cell in (float(item.ceilings[0]), None, 100.0)]
    rows.append(("ceiling", None, *ceilings))
    caption = (
        "The paper's Table 5 (hits in 1000 time steps) beside SCLA's hits per 1000 decisions and the ceiling of each "
        f"protocol. The paper does not name its protocol; see the errata. {parts.setting(*items)}"
    )
    return Table("table-5", caption, tuple(columns), tuple(rows))


def _cells(item: Evidence, first: int, last: int) -> tuple[Cell, Cell, Cell]:
    hits, percent = (statistics.span_means(values, first, last) for values in (item.hits, item.percent))
    return *parts.measured(hits), float(percent.mean())


def _automaton(item: Evidence) -> Table:
    first, last = paper.AUTOMATON_SPAN
    columns = (
        Column("source"),
        Column("epochs"),
        Column("hits per 1000", 2),
        Column(parts.INTERVAL, 2),
        Column("moves a hit", 2),
    )
    exact = beside_the_target()
    rows: list[tuple[Cell, ...]] = [
        ("paper, the automaton alone", None, paper.AUTOMATON_HITS, None, paper.AUTOMATON_MOVES),
        ("exact: perfect beside the target, random elsewhere", None, exact, None, 1000.0 / exact),
    ]
    for start, end in ((first, min(last, item.epochs)), statistics.settled_span(item.epochs)):
        if start <= end:
            hits = statistics.span_means(item.hits, start, end)
            moves = float(statistics.moves_a_hit(hits).mean())
            rows.append(("ours", parts.span_text(start, end), *parts.measured(hits), moves))
    caption = (
        f"The cellular learning automaton alone, rewarded only for the move into the target. {parts.setting(item)}"
    )
    return Table("automaton", caption, columns, tuple(rows))
