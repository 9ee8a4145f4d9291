"""Robots with a brain each whose physics and networks run on a device; automata, like every draw, stay on the CPU."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.gpu.drive import WarpBodies
from benchmarks.gpu.network import WarpNetworks
from scla_mj.anatomy import POPULATIONS, SENSORY
from scla_mj.brain.scla import SclaBrain
from scla_mj.checked import CheckedConfig, check
from scla_mj.grid import Action
from scla_mj.loop.fleet import Fleet
from scla_mj.loop.fleet_simulation import FleetSimulation
from scla_mj.signals import Decision, Feedback, Percept


class _Row:
    """A network of many as its brain sees it, which others advance; `released` is its row of theirs."""

    populations, watched, spike_count = POPULATIONS, (), 0

    def __init__(self, released: NDArray[np.float64]) -> None:
        self._released = released

    def advance(self, steps: int) -> NDArray[np.int64]:
        return np.zeros(len(POPULATIONS), np.int64)

    def release_dopamine(self, amount: NDArray[np.float64], *, delay_steps: int = 0) -> None:
        self._released += amount


class _RowBrain(SclaBrain):
    """`decide` in two parts, before and after its network is advanced."""

    def __init__(self, checked: CheckedConfig, row: Any) -> None:
        self._row = row
        super().__init__(checked)

    def build_network(self, checked: CheckedConfig) -> Any:
        return self._row

    def ask(self, percept: Percept) -> tuple[Action | None, int]:
        """Return the advised action, and the population that is driven."""
        if percept.sensed is not None:
            return None, int(percept.sensed)
        advised = self.automata.draw(percept.cell)
        return advised, len(SENSORY) + int(advised)

    def answer(self, advised: Action | None, counts: NDArray[np.int64]) -> Decision:
        """Return the decision of the spikes by population."""
        return self._decided(advised, counts)


class WarpSimulation(FleetSimulation):
    """`simulate_fleet` on the current Warp device: every robot is a `Simulation` of its own seed, but in float32.

    Attributes:
        bodies, networks: what runs on the device.
    """

    def __init__(self, checked: CheckedConfig, seeds: Sequence[int]) -> None:
        config = checked.config
        self.bodies = WarpBodies(checked, len(seeds))
        fleet = Fleet(checked, len(seeds), threads=1, body=lambda *_: self.bodies)
        self.networks = WarpNetworks(checked, seeds)
        self._currents = np.repeat([config.network.sensory_drive, config.network.advice_drive], len(SENSORY))
        self._clock = checked.clock
        each = [check(dataclasses.replace(config, seed=seed)) for seed in seeds]
        rows = map(_Row, self.networks.released)
        self._brains = [_RowBrain(one, row) for one, row in zip(each, rows, strict=True)]
        for robot, seed in enumerate(seeds):
            fleet.reseed(robot, seed)
        super().__init__(fleet, self._brains)

    def _decide(self, before: list[Percept]) -> list[Decision]:
        asked = [brain.ask(percept) for brain, percept in zip(self._brains, before, strict=True)]
        driven = np.array([population for _, population in asked])
        thought = self.networks.advance(np.full(len(asked), self._clock.thinking_steps), driven, self._currents[driven])
        each = zip(self._brains, asked, thought, strict=True)
        return [brain.answer(advised, counts) for brain, (advised, _), counts in each]

    def _learn(self, feedbacks: list[Feedback], durations_s: list[float]) -> None:
        steps = np.rint(np.array(durations_s) * 1000.0 / self._clock.neural_step_ms).astype(np.int64)
        self.networks.advance(steps, np.full(len(steps), -1), np.zeros(len(steps)))
        for brain, feedback in zip(self._brains, feedbacks, strict=True):
            brain.learn(feedback)
