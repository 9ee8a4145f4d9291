"""Many robots on a GPU next to the same on one core: decisions a second, and whether they come to the same."""

from __future__ import annotations

import dataclasses
import statistics
import time
from collections.abc import Callable
from typing import Any, Final, NamedTuple, TypeVar

import numpy as np
import warp as wp
from numpy.typing import NDArray

from benchmarks.gpu.drive import WarpBodies
from benchmarks.gpu.simulation import WarpSimulation
from benchmarks.table import Sheet
from benchmarks.timing import Watch
from scla_mj.checked import CheckedConfig, check
from scla_mj.config import RunConfig
from scla_mj.engine.build import simulate_fleet
from scla_mj.grid import ACTIONS
from scla_mj.loop.fleet import Came, Fleet

ROBOTS: Final = 1024
MORE_ROBOTS: Final = 8192
WARM_UP: Final = 2
"""Turns that are not counted: the first compiles, and the second is recorded as a graph."""
TURNS: Final = 2
"""Turns per repetition, each of one decision of every robot."""
_T = TypeVar("_T")
_SAME: Final = ("executed", "outcome", "hit", "fallen")
_TIMES: Final = ("duration_s", "crossed_s")


class Alike(NamedTuple):
    """Decisions compared, those that came to the same, and those that also took the same times; the largest distance
    in m between the places where robots were then."""

    compared: int = 0
    outcomes: int = 0
    times: int = 0
    apart_m: float = 0.0

    def after(self, one: Came, other: Came, same: NDArray[np.bool_], fleets: tuple[Fleet, Fleet]) -> Alike:
        """Return the count with one more turn, of whose robots only those are the `same` that still were before."""
        same = same & np.logical_and.reduce([getattr(one, name) == getattr(other, name) for name in _SAME])
        timed = same & np.logical_and.reduce([getattr(one, name) == getattr(other, name) for name in _TIMES])
        apart_m = self.apart_m
        for robot in np.flatnonzero(timed).tolist():
            places = [fleet.qpos(robot)[:2] for fleet in fleets]
            apart_m = max(apart_m, float(np.abs(places[0] - places[1]).max()))
        return Alike(self.compared + len(same), self.outcomes + int(same.sum()), self.times + int(timed.sum()), apart_m)


class Took(NamedTuple):
    """Seconds of every turn, by contender; of the robots with brains on the GPU, also those in moves and networks."""

    core: list[float]
    gpu: list[float]
    moves: list[float]
    networks: list[float]


def measure(config: RunConfig, *, repetitions: int, watch: Watch) -> Sheet:
    """Time one decision of all robots at a time, on one core and on the current Warp device in turn."""
    checked = check(dataclasses.replace(config, brain="scla-printed"))
    turns = WARM_UP + TURNS * repetitions
    actions = np.random.Generator(np.random.PCG64(config.seed)).integers(0, len(ACTIONS), (turns, MORE_ROBOTS))
    moves, alike = _moves(checked, actions[:, :ROBOTS])
    watch()
    brains, decided = _brains(checked, turns)
    watch()
    more = Fleet(checked, MORE_ROBOTS, threads=1, body=WarpBodies)
    took = [_timed(_acted, more, turn)[1] for turn in actions]
    watch()
    return sheet(moves, brains, took, alike, decided)


def _moves(checked: CheckedConfig, actions: NDArray[np.int64]) -> tuple[Took, Alike]:
    """Let all take the same random moves."""
    seed, number, took, alike = checked.config.seed, actions.shape[1], Took([], [], [], []), Alike()
    one, many = Fleet(checked, number, threads=1), Fleet(checked, number, threads=1, body=WarpBodies)
    for robot in range(number):
        one.reseed(robot, seed + robot)
        many.reseed(robot, seed + robot)
    for turn in actions:
        came, core_s = _timed(one.act, turn)
        same, gpu_s = _timed(many.act, turn)
        alike = alike.after(came, same, (one.cells == many.cells).all(axis=1), (one, many))
        took.core.append(core_s + _timed(_respawn, one, came)[1])
        took.gpu.append(gpu_s + _timed(_respawn, many, same)[1])
    return took, alike


def _brains(checked: CheckedConfig, turns: int) -> tuple[Took, Alike]:
    """Let brains decide; what a robot does depends on all its decisions before."""
    took, alike, seeds = Took([], [], [], []), Alike(), [checked.config.seed + robot for robot in range(ROBOTS)]
    one, many = simulate_fleet(checked, seeds, threads=1), WarpSimulation(checked, seeds)
    for _ in range(turns):
        before = many.bodies.took_s, many.networks.took_s
        came, core_s = _timed(one.step)
        same, gpu_s = _timed(many.step)
        chosen = np.array([ours == theirs for ours, theirs in zip(one.chosen, many.chosen, strict=True)])
        alike = alike.after(came, same, chosen, (one.fleet, many.fleet))
        took.core.append(core_s)
        took.gpu.append(gpu_s)
        took.moves.append(many.bodies.took_s - before[0])
        took.networks.append(many.networks.took_s - before[1])
    return took, alike


def _acted(fleet: Fleet, actions: NDArray[np.int64]) -> None:
    _respawn(fleet, fleet.act(actions))


def _respawn(fleet: Fleet, came: Came) -> None:
    for robot in np.flatnonzero(came.hit | came.fallen).tolist():
        fleet.respawn(robot)


def _timed(work: Callable[..., _T], *arguments: Any) -> tuple[_T, float]:
    started_s = time.perf_counter()
    return work(*arguments), time.perf_counter() - started_s


def sheet(moves: Took, brains: Took, more: list[float], alike: Alike, decided: Alike) -> Sheet:
    """Return the table; the first turns are not counted."""
    s = {
        f"moves, {ROBOTS:,} robots, one core": moves.core,
        f"moves, {ROBOTS:,} robots, GPU": moves.gpu,
        f"moves, {MORE_ROBOTS:,} robots, GPU": more,
        f"moves and networks, {ROBOTS:,} robots, one core": brains.core,
        f"moves and networks, {ROBOTS:,} robots, GPU": brains.gpu,
        "of which moves": brains.moves,
        "of which networks": brains.networks,
    }
    median_s = {name: statistics.median(turns[WARM_UP:]) for name, turns in s.items()}
    per_s = {name: (MORE_ROBOTS if turns is more else ROBOTS) / median_s[name] for name, turns in s.items()}
    rows, core = [], 1.0
    for name, rate in per_s.items():
        if name.endswith("one core"):
            core = rate
        of_all = not name.startswith("of which")
        over = f"{rate / core:.1f}" if of_all and not name.endswith("one core") else ""
        rows.append((name, f"{1000 * median_s[name]:.1f}", f"{rate:,.0f}" if of_all else "", over))
    return Sheet(
        "gpu",
        "Decisions a second on a GPU, wall-clock time",
        ("what", "ms for a decision of all", "decisions per s", "over one core"),
        tuple(rows),
        f"{_compared('Moves', alike)} {_compared('With networks', decided)} The rest of a decision is Python on one "
        f"core: automata, senses, respawns. GPU: {wp.get_device().name}.",
        {f"{name}, decisions per s": rate for name, rate in per_s.items()}
        | {"moves alike": alike.outcomes / alike.compared, "decisions alike": decided.outcomes / decided.compared},
    )


def _compared(what: str, alike: Alike) -> str:
    return (
        f"{what}: {alike.outcomes:,} of {alike.compared:,} decisions came to the same on both "
        "(decision, cell, outcome, hit), "
        f"{alike.times:,} in the same times, at most {1e6 * alike.apart_m:.1f} µm apart."
    )
