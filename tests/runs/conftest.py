"""Decisions made by a seeded walk on the paper's floor, as the loop would hand them over."""

from collections.abc import Iterator

import numpy as np
import pytest

from scla_mj.grid import Action, Cell, Grid
from scla_mj.signals import Activity, Decision, DecisionRecord, Move, Outcome, Percept

EMPTY = np.zeros(0, dtype=np.int32)


def activity(weight: float) -> Activity:
    return Activity(EMPTY, EMPTY, 0, 50, 50, np.full(8, weight), np.zeros(8))


def walk(epochs: int, decisions: int, *, spiking: bool = True) -> Iterator[DecisionRecord]:
    """Yield a random walk's decisions; durations, errors and spike counts are drawn too."""
    rng, grid = np.random.default_rng(5), Grid((5, 5), Cell(3, 3), 0.3)
    cell, time_s = Cell(1, 1), 0.0
    for number in range(epochs * decisions):
        action = Action(int(rng.integers(4)))
        after = grid.after(cell, action)
        outcome = Outcome.MOVED if after != cell else Outcome.BLOCKED
        sensed = grid.sensed_from(cell)
        spikes = tuple(int(count) for count in rng.integers(0, 40, 4)) if spiking else None
        chosen = Decision(action, None if sensed is not None else action, spikes)
        duration_s = float(rng.uniform(0.5, 1.5))
        move = Move(outcome, cell, after, duration_s, float(rng.uniform(0, 0.003)), float(rng.normal(0, 0.001)), False,
                    np.zeros((0, 12)))  # fmt: skip
        hit = after == grid.target
        epoch, decision = divmod(number, decisions)
        yield DecisionRecord(epoch + 1, decision + 1, time_s, Percept(cell, sensed), chosen, chosen.action, move, hit,
                             activity(number + 1.0) if spiking else None)  # fmt: skip
        cell, time_s = Cell(1, 1) if hit else after, time_s + duration_s


@pytest.fixture(name="walk")
def walk_fixture():
    return walk
