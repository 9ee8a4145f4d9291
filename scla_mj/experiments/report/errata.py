"""What the paper's figures can and cannot mean: arithmetic on its own numbers, done here and not quoted."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from scla_mj.experiments import exact, paper
from scla_mj.experiments.report.tables import Row, Table
from scla_mj.grid import PROTOCOLS

_OTHER_ARENAS: Final = (((5, 5), (1, 1)), ((5, 5), (5, 2)), ((7, 7), (4, 4)))


def errata() -> dict[str, Any]:
    """Return what the template does its arithmetic on; it needs no run."""
    any_start, sensed_start = (exact.paper_grid().ceiling_hits_per_1000(protocol) for protocol in PROTOCOLS)
    return {
        "any_start": any_start,
        "sensed_start": sensed_start,
        "beside": exact.next_to_the_target(),
        "rows": np.array(paper.TABLE_5, dtype=np.float64),
        "distances": np.array(list(exact.paper_grid().distances.values())),
        "policies": _policies(),
        "arenas": _arenas(),
    }


def _policies() -> Table:
    columns = {"policy": None, "protocol": None, "hits per 1000": 2, "moves per hit": 2, "% of ceiling": 2}
    rows: list[Row] = []
    for protocol in PROTOCOLS:
        ceiling = exact.paper_grid().ceiling_hits_per_1000(protocol)
        earned = [("shortest path (the ceiling)", ceiling), ("random walk, a bump stays", exact.random_walk(protocol)),
                  ("a coin between the two wired motors beside the target, shortest path elsewhere",
                   exact.coin(protocol))]  # fmt: skip
        if protocol == "any-start":
            earned.append(("perfect next to the target, random elsewhere", exact.next_to_the_target()))
        rows += [(name, protocol, hits, 1000 / hits, 100 * hits / ceiling) for name, hits in earned]
    return Table("policies", columns, rows)


def _arenas() -> Table:
    columns = {"arena": None, "target": None, **{f"ceiling, {protocol}": 2 for protocol in PROTOCOLS}}
    rows: list[Row] = []
    for cells, target in ((paper.CELLS, paper.TARGET), *_OTHER_ARENAS):
        grid = exact.grid_of(cells, target)
        ceilings = (grid.ceiling_hits_per_1000(protocol) for protocol in PROTOCOLS)
        rows.append((f"{cells[0]} x {cells[1]}", str(target), *ceilings))
    return Table("arenas", columns, rows)
