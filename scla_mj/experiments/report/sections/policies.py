"""What the automata have learned, cell by cell."""

from __future__ import annotations

from scla_mj.checked import check
from scla_mj.experiments.report.document import Cell, Column, Figure, Paragraph, Section
from scla_mj.experiments.report.evidence import Evidence, Study
from scla_mj.experiments.report.policy_chart import Policy, nearer, policy_chart
from scla_mj.experiments.report.sections import parts
from scla_mj.grid import Action


def policies(study: Study) -> Section:
    """Return the maps of every experiment with automata, ablations left out."""
    items = [item for item in study.group("paper", "comparison", "world") if item.probabilities is not None]
    if not items:
        return Section("policies", "Policies", (Paragraph("None of the runs here has automata."),))
    drawn = [_policy(item) for item in items]
    rows = tuple(row for policy in drawn for row in _rows(policy))
    columns = (Column("experiment"), Column("x", 0), Column("y", 0), *(Column(action.label, 4) for action in Action))
    caption = (
        "Action probabilities of every cell's automaton at the end of the run, mean over seeds. Shade: the probability "
        "of an action that brings the target (star) one move nearer; arrow: the mean step; grey: closed cells. Beside "
        "the target SCLA's network decides, not the automaton, so those four cells may stay as they began. "
        f"{parts.setting(*items)}"
    )
    figure = Figure("policies", caption, policy_chart(drawn), (*columns, Column("nearer", 4)), rows)
    return Section("policies", "Policies", (figure,))


def _policy(item: Evidence) -> Policy:
    assert item.probabilities is not None
    config = item.experiment.config
    return Policy(item.experiment.title, check(config).grid(config.epochs), item.probabilities)


def _rows(policy: Policy) -> list[tuple[Cell, ...]]:
    return [
        (
            policy.title, cell.x, cell.y,
            *(float(value) for value in policy.probabilities[cell.x - 1, cell.y - 1]),
            nearer(policy.grid, policy.probabilities, cell),
        )
        for cell in policy.grid.open_cells()
        if cell != policy.grid.target
    ]  # fmt: skip
