"""An OUT folder without a simulator: runs whose hits follow a known curve, put down by the run folder's own writers."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from scla_mj.anatomy import PAPER_ANATOMY
from scla_mj.checked import check
from scla_mj.config import RunConfig
from scla_mj.engine.account import Account
from scla_mj.experiments.campaign import run_folder
from scla_mj.experiments.experiment import Experiment
from scla_mj.grid import Action
from scla_mj.markov import ceiling_hits_per_1000, hits_per_1000, uniform_policy
from scla_mj.runs.brain import write_brain
from scla_mj.runs.decisions import DecisionLog
from scla_mj.runs.folder import create, made
from scla_mj.runs.summary import write_summary
from scla_mj.signals import Activity, Decision, DecisionRecord, Move, Outcome, Percept, Snapshot

Skill = Callable[[int], float]
"""The chance of a hit, from 0 (a random walk) to 1 (the ceiling), by epoch."""

SCLA = ("scla", "scla-printed", "scla-dopamine")
SPIKING = (*SCLA, "network")
_EMPTY = np.zeros(0, dtype=np.int32)
_TRAJECTORY = np.zeros((0, 12))


def learning(rate: float) -> Skill:
    return lambda epoch: 1.0 - float(np.exp(-rate * epoch))


def write_runs(out: Path, experiment: Experiment, skill: Skill, *, decisions: int | None = None) -> None:
    """Write every seed's run; with `decisions` only that many of each run, as a killed one leaves them."""
    for seed in experiment.seeds:
        config = dataclasses.replace(experiment.config, seed=seed)
        with made(run_folder(out, experiment, seed)) as place:
            run = create(place, config, PAPER_ANATOMY if config.brain in SPIKING else None)
        account = Account(check(config))
        with DecisionLog(run.path) as log:
            for number, record in enumerate(records(config, skill)):
                if number == decisions:
                    break
                log.write(record)
                account.add(record, 3600.0)
        write_summary(run.path, dataclasses.replace(account.summary(), wall_s=30.0))
        write_brain(run.path, snapshot(config, skill), anatomy=PAPER_ANATOMY)


def records(config: RunConfig, skill: Skill) -> Iterator[DecisionRecord]:
    rng = np.random.default_rng(config.seed + sum(map(ord, config.brain)))
    for epoch in range(1, config.epochs + 1):
        grid = check(config).grid(epoch)
        ceiling = ceiling_hits_per_1000(grid, config.protocol, action_noise=config.task.action_noise)
        walk = hits_per_1000(grid, config.protocol, uniform_policy(grid))
        chance = (walk + (ceiling - walk) * skill(epoch)) / 1000.0
        cell = grid.start_cells("sensed-start")[0]
        move = Move(Outcome.MOVED, cell, grid.target, 1.0, 0.001, 0.0, False, _TRAJECTORY)
        hits = rng.random(config.decisions) < chance
        for decision, hit in enumerate(hits.tolist(), 1):
            yield DecisionRecord(epoch, decision, float(decision), Percept(cell, None), Decision(Action.UP), Action.UP,
                                 move, hit, activity(config, skill(epoch)))  # fmt: skip


def activity(config: RunConfig, skill: float) -> Activity | None:
    if config.brain not in SPIKING:
        return None
    agrees = np.array([1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 0.0])
    means = np.where(agrees > 0, 1.0 + 2.9 * skill, 1.0 - 0.7 * skill) + 0.02 * np.arange(8) + 0.01 * config.seed
    return Activity(_EMPTY, _EMPTY, 0, 50, 50, means, np.zeros(8))


def snapshot(config: RunConfig, skill: Skill) -> Snapshot:
    """Automata as sure of their way as the last epoch's skill."""
    if config.brain not in (*SCLA, "automaton"):
        return Snapshot()
    grid, sure = check(config).grid(config.epochs), skill(config.epochs)
    probabilities = uniform_policy(grid) * (1.0 - sure)
    for cell in grid.open_cells():
        good = [action for action, beyond in grid.neighbours(cell) if grid.distances[beyond] < grid.distances[cell]]
        probabilities[cell.x - 1, cell.y - 1, good[0] if good else Action.UP] += sure
    probabilities /= probabilities.sum(axis=2, keepdims=True)
    return Snapshot(None, probabilities)
