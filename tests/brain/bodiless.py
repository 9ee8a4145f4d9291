"""Brains on the grid's own transitions, without a body."""

from __future__ import annotations

import numpy as np

from scla_mj.brain.base import Brain
from scla_mj.brain.registry import build_brain
from scla_mj.checked import check
from scla_mj.config import RunConfig
from scla_mj.grid import Action, Cell, Grid, StartProtocol
from scla_mj.signals import Feedback, Outcome, Percept


def build(name, **settings):
    config = RunConfig(brain=name, **settings)
    return build_brain(check(config)), check(config).grid()


def move(grid: Grid, cell: Cell, action: Action, *, crossed: bool = False) -> Feedback:
    """Return the feedback for an action in a cell."""
    after = grid.after(cell, action.opposite if crossed else action)
    outcome = Outcome.BLOCKED if after == cell else Outcome.MOVED
    percepts = (Percept(at, grid.sensed_from(at)) for at in (cell, after))
    return Feedback(next(percepts), action, action, outcome, next(percepts), after == grid.target)


def live(
    brain: Brain,
    grid: Grid,
    decisions: int,
    seed: int = 0,
    *,
    protocol: StartProtocol = "any-start",
    crossed: bool = False,
) -> int:
    """Let a brain decide; return its hits."""
    rng = np.random.default_rng(seed)
    starts = grid.start_cells(protocol)
    cell, hits = starts[rng.integers(len(starts))], 0
    for _ in range(decisions):
        came = move(grid, cell, brain.decide(Percept(cell, grid.sensed_from(cell))).action, crossed=crossed)
        brain.learn(came)
        hits += came.hit
        cell = starts[rng.integers(len(starts))] if came.hit else came.after.cell
    return hits
