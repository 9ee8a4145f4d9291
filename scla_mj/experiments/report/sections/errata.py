"""What the paper's figures can and cannot mean: arithmetic on its own numbers, done here and not quoted."""

from __future__ import annotations

import numpy as np

from scla_mj.experiments import exact, paper
from scla_mj.experiments.report.cells import number
from scla_mj.experiments.report.document import Bullets, Cell, Column, Paragraph, Section, Strong, Table, Text
from scla_mj.grid import PROTOCOLS

_OTHER_FLOORS = (((5, 5), (1, 1)), ((5, 5), (5, 2)), ((7, 7), (4, 4)))


def errata() -> Section:
    """Return the arithmetic; it needs no run."""
    opening = Paragraph(
        "The paper leaves its protocol open, and some of its figures can be checked against the grid alone. Every "
        "number here is computed when the report is written: by breadth-first search, by solving the Markov chain of a "
        "fixed policy, or from the rows of the paper's Table 5."
    )
    items = (_protocol(), _baseline(), _table_mean(), _most_steps(), _equation_2())
    return Section("errata", "Errata and their arithmetic", (opening, Bullets(items), _yardsticks(), _floors()))


def _protocol() -> Text:
    any_start, sensed = (exact.paper_grid().ceiling_hits_per_1000(protocol) for protocol in PROTOCOLS)
    printed = paper.SCLA_HITS
    return (
        Strong(f"{printed:g} hits cannot be any-start."),
        f" From a uniformly drawn cell the shortest path to {paper.TARGET} takes {1000 / any_start:g} moves on "
        f"average: no policy earns more than {any_start:g} hits per 1000 moves; {printed:g} would mean "
        f"{1000 / printed:.3f} moves a hit. If the robot starts beside the target the ceiling is {sensed:g}, and "
        f"{printed:g} is {100 * printed / sensed:.1f} % of it.",
    )


def _baseline() -> Text:
    hits = exact.beside_the_target()
    return (
        Strong(f"{paper.AUTOMATON_HITS:g} hits are {hits:.2f}."),
        " An automaton that is rewarded only for the move into the target learns the cells beside it and nothing else: "
        f"perfect there and random elsewhere earns exactly {hits:.2f} hits per 1000 from any start, {1000 / hits:.2f} "
        f'moves a hit, where the paper has {paper.AUTOMATON_HITS:g} and "approximately {paper.AUTOMATON_MOVES:g}". So '
        "the two figures that the paper compares belong to two protocols.",
    )


def _table_mean() -> Text:
    rows = np.array(paper.TABLE_5, dtype=np.float64)
    deviation = rows.std(ddof=1)
    return (
        Strong(f"Table 5 averages {rows.mean():.2f}"),
        f", not {paper.SCLA_HITS:g}: its {len(rows)} rows run from {rows.min():g} to {rows.max():g} with a standard "
        f"deviation of {deviation:.1f}. The two differ by less than the standard error of such a mean, "
        f"{deviation / np.sqrt(len(rows)):.1f}; the paper's may be over all {paper.EPOCHS} epochs, of which it prints "
        f"{len(rows)}.",
    )


def _most_steps() -> Text:
    distances = list(exact.paper_grid().distances.values())
    far = sum(distance > paper.MOST_STEPS for distance in distances)
    return (
        Strong(f'"At most {paper.MOST_STEPS} steps"'),
        f" holds for no policy from any start: {far} of the {len(distances) - 1} start cells lie further away, the "
        f"corners {max(distances)} moves.",
    )


def _equation_2() -> Text:
    a, b, c = paper.RECOVERY_RATE, paper.RECOVERY_SENSITIVITY, paper.RESET_MV
    return (
        Strong("Equation 2 as printed has no rest."),
        f" With u' = a(bv − c) and Table 2's a = {a:g}, b = {b:g}, c = {number(c, 0)}, at v = {number(c, 0)} mV "
        f"u grows by {a * (b * c - c):.2f} every millisecond without bound; with u' = a(bv − u), as in Izhikevich "
        f"2003, it settles at {number(b * c, 0)}. Equation 1 has − I where the source has + I: as printed, a drive "
        "would silence the neuron.",
    )


def _yardsticks() -> Table:
    columns = (
        Column("policy"),
        Column("protocol"),
        Column("hits per 1000", 2),
        Column("moves a hit", 2),
        Column("% of ceiling", 2),
    )
    rows: list[tuple[Cell, ...]] = []
    for protocol in PROTOCOLS:
        ceiling = exact.paper_grid().ceiling_hits_per_1000(protocol)
        earned = [("shortest path (the ceiling)", ceiling), ("random walk, a bump stays", exact.random_walk(protocol))]
        if protocol == "any-start":
            earned.append(("perfect beside the target, random elsewhere", exact.beside_the_target()))
        rows += [(name, protocol, hits, 1000 / hits, 100 * hits / ceiling) for name, hits in earned]
    caption = (
        f"Exact yardsticks of the paper's floor ({paper.CELLS[0]} x {paper.CELLS[1]}, target {paper.TARGET}): no "
        "seeds, no epochs, solved and not sampled."
    )
    return Table("yardsticks", caption, columns, tuple(rows))


def _floors() -> Table:
    columns = (Column("floor"), Column("target"), *(Column(f"ceiling, {protocol}", 2) for protocol in PROTOCOLS))
    rows: list[tuple[Cell, ...]] = [
        (
            f"{cells[0]} x {cells[1]}",
            str(target),
            *(exact.grid_of(cells, target).ceiling_hits_per_1000(p) for p in PROTOCOLS),
        )
        for cells, target in ((paper.CELLS, paper.TARGET), *_OTHER_FLOORS)
    ]
    caption = "Ceilings of other floors, in hits per 1000 decisions, by search: no seeds, no epochs."
    return Table("floors", caption, columns, tuple(rows))
