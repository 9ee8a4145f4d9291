"""Environments and fleets compared with their bare parts: one robot, many, many with brains; on one core and two."""

from __future__ import annotations

import dataclasses
import os
import statistics
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

import gymnasium as gym
import mujoco
import numpy as np

from benchmarks.processes import ask
from benchmarks.replay import Recorded, Recorder, record, replay_network, replay_physics
from benchmarks.rollouts import fresh_network
from benchmarks.table import BOUND_ABOVE, ONE_REPETITION, Sheet, against, doubted
from benchmarks.timing import Watch
from scla_mj.checked import check
from scla_mj.config import RunConfig
from scla_mj.engine.build import build_task, simulate_fleet
from scla_mj.envs.vector import GridMoveVectorEnv, GridTwinVectorEnv
from scla_mj.errors import SclaError
from scla_mj.grid import ACTIONS
from scla_mj.loop.fleet import Fleet
from scla_mj.world.world import World

ROBOTS: Final = 64
WARM_UP: Final = 4
"""Turns that are not counted."""
TURNS: Final = 4
"""Turns per repetition, each of one decision of every robot."""
_TARGETS: Final = {"single": 1.15, "vector": 1.10, "fleet": 1.10}
_SPEED_UP: Final = 1.8
_MEMORY_MB: Final = 0.6
_QUIET: Final = 0.02
"""Cores are free in a turn whose threads waited for one for no more than this share of their CPU time."""
_WHAT: Final = {
    "one": "bare mj_step, one robot",
    "single": "one environment of gym.make",
    "many": f"bare mj_step, {ROBOTS} robots",
    "vector": f"vector environment, {ROBOTS} robots",
    "twin": f"discrete twin, {ROBOTS} robots",
    "physics": f"bare mj_step, {ROBOTS} robots with brains",
    "kernel": f"bare network kernel, {ROBOTS} brains",
    "fleet": f"fleet of {ROBOTS} robots with brains",
}
_OVER: Final = {"single": ("one",), "vector": ("many",), "fleet": ("physics", "kernel")}
_Work = Callable[[int], object]


class Took(NamedTuple):
    """Seconds of one turn: of CPU, on the wall, and those in which a thread was ready and had no core."""

    cpu_s: float
    wall_s: float
    waited_s: float


class Stage(NamedTuple):
    """MuJoCo's own: what the bare physics need of a `World`."""

    model: Any
    data: Any


def measure(config: RunConfig, *, repetitions: int, watch: Watch) -> list[Sheet]:
    """Time every contender in turn, one decision of each robot at a time; all robots must end where the bare ones do.

    Raises:
        SclaError: they do not.
    """
    turns = WARM_UP + TURNS * repetitions
    config = dataclasses.replace(config, epochs=1, decisions=turns)
    moves, check_moves = _moves(config, turns)
    watch()
    brains, check_brains = _brains(config)
    watch()
    took = _in_turn(moves | brains, turns)
    check_moves()
    check_brains()
    memory = ask("memory", {"config": dataclasses.asdict(config), "robots": ROBOTS}, None)
    watch()
    sheets = [cost_sheet({name: took[name] for name in _WHAT}, memory), cores_sheet(took)]
    return sheets if repetitions > 1 else [doubted(sheet, ONE_REPETITION) for sheet in sheets]


def _moves(config: RunConfig, turns: int) -> tuple[dict[str, _Work], Callable[[], None]]:
    """Return the contenders without a brain, which take the same random moves, and a check of where they end."""
    world = World(check(config).grid(), check(config).clock)
    actions = np.random.default_rng(config.seed).integers(0, len(ACTIONS), (turns, ROBOTS))
    alone, *each = (_driven(config, robot, part) for robot, part in [(0, actions.ravel()), *enumerate(actions.T)])
    steps = check(config).clock.physics_steps_per_control
    one, many = _stages(world, 1), _stages(world, ROBOTS)
    bare_one, bare_many = _bare(one, [alone], steps), _bare(many, each, steps)
    twins = GridTwinVectorEnv(ROBOTS, config=config, max_episode_steps=None)
    twins.reset(seed=config.seed)
    env = gym.make("scla_mj.envs:scla_mj/GridMove-v0", config=config, max_episode_steps=-1)
    env.reset(seed=config.seed)
    vectors = {threads: GridMoveVectorEnv(ROBOTS, config=config, max_episode_steps=None, threads=threads)
               for threads in (1, 2)}  # fmt: skip
    for vector in vectors.values():
        vector.reset(seed=config.seed)

    def single(turn: int) -> None:
        for action in actions[turn].tolist():
            _, _, hit, fallen, _ = env.step(action)
            if hit or fallen:
                env.reset()

    contenders: dict[str, _Work] = {
        "one": lambda _: [next(bare_one) for _ in range(ROBOTS)], "single": single, "many": lambda _: next(bare_many),
        "twin": lambda turn: twins.step(actions[turn]),
        "vector": lambda turn: vectors[1].step(actions[turn]), "vector, 2": lambda turn: vectors[2].step(actions[turn]),
    }  # fmt: skip
    return contenders, lambda: _require_same(many, each, *(vector.fleet for vector in vectors.values()))


def _brains(config: RunConfig) -> tuple[dict[str, _Work], Callable[[], None]]:
    """Return the contenders with brains, and a check of where their robots end."""
    world, steps = World(check(config).grid(), check(config).clock), check(config).clock.physics_steps_per_control
    seeds = [config.seed + robot for robot in range(ROBOTS)]
    configs = [dataclasses.replace(config, seed=seed) for seed in seeds]
    recorded = [record(one) for one in configs]
    stages = _stages(world, ROBOTS)
    physics = _bare(stages, recorded, steps)
    kernels = [replay_network(fresh_network(one), done) for one, done in zip(configs, recorded, strict=True)]
    fleets = {threads: simulate_fleet(config, seeds, threads=threads) for threads in (1, 2)}
    contenders: dict[str, _Work] = {
        "physics": lambda _: next(physics), "kernel": lambda _: [next(kernel, None) for kernel in kernels],
        "fleet": lambda _: fleets[1].step(), "fleet, 2": lambda _: fleets[2].step(),
    }  # fmt: skip
    return contenders, lambda: _require_same(stages, recorded, *(fleet.fleet for fleet in fleets.values()))


def _driven(config: RunConfig, robot: int, actions: Any) -> Recorded:
    """Return what the physics of a robot are fed that takes these actions."""
    task, recorder = build_task(dataclasses.replace(config, seed=config.seed + robot)), Recorder()
    for action in actions.tolist():
        recorder.begin(task.world)
        cell = task.percept.cell
        came = task.act(ACTIONS[action])
        recorder.add(came.driven, cell, came.move, ended=came.feedback.hit or came.move.fallen)
    return recorder.recorded


def _stages(world: World, robots: int) -> list[Stage]:
    return [Stage(world.model, mujoco.MjData(world.model)) for _ in range(robots)]


def _bare(stages: list[Stage], recorded: list[Recorded], steps: int) -> Iterator[None]:
    """Step the bare physics of robots; yields after a decision of every one."""
    each = [replay_physics(stage, done, steps) for stage, done in zip(stages, recorded, strict=True)]
    for _ in zip(*each, strict=True):
        yield


def _require_same(stages: list[Stage], recorded: list[Recorded], *fleets: Fleet) -> None:
    for robot, (stage, done) in enumerate(zip(stages, recorded, strict=True)):
        for fleet in fleets:
            if not done.ended and not np.array_equal(stage.data.qpos, fleet.qpos(robot)):
                raise SclaError(f"robot {robot} ends elsewhere than under bare mj_step; the bench is void")


def _in_turn(contenders: Mapping[str, _Work], turns: int) -> dict[str, list[Took]]:
    took: dict[str, list[Took]] = {name: [] for name in contenders}
    for turn in range(turns):
        for name, work in contenders.items():
            before = _waited_s(), time.perf_counter(), time.process_time()
            work(turn)
            cpu_s, wall_s = time.process_time() - before[2], time.perf_counter() - before[1]
            if turn >= WARM_UP:
                took[name].append(Took(cpu_s, wall_s, _waited_s() - before[0]))
    return took


def _waited_s() -> float:
    """Return how long this process's threads have waited for a core; NaN where the system does not tell."""
    try:
        each = [file.read_text(encoding="ascii").split()[1] for file in Path("/proc/self/task").glob("*/schedstat")]
    except (OSError, IndexError):
        return float("nan")
    return sum(map(int, each)) / 1e9 if each else float("nan")


def cost_sheet(took: Mapping[str, list[Took]], memory: Mapping[str, float]) -> Sheet:
    """Return the table of CPU time on one core, and of memory, MB per robot: "robot", and "brain" with its brain."""
    ms = {name: 1000.0 * statistics.median(turn.cpu_s for turn in took[name]) / ROBOTS for name in _WHAT}
    ratios = {name: ms[name] / sum(ms[part] for part in parts) for name, parts in _OVER.items()}
    rows = [
        (what, f"{ms[name]:.3g}", *((f"{ratios[name]:.2f}", against(ratios[name], _TARGETS[name]))
                                    if name in ratios else ("", "")))
        for name, what in _WHAT.items()
    ]  # fmt: skip
    rows.append(("memory of a robot", f"{memory['robot']:.2f} MB", "", against(memory["robot"], _MEMORY_MB)))
    rows.append(("memory of a robot with its brain", f"{memory['brain']:.2f} MB", "", ""))
    values = {f"{name}_ms": value for name, value in ms.items()} | {f"{name}_ratio": r for name, r in ratios.items()}
    values |= {f"{name}_mb": value for name, value in memory.items()}
    table = Sheet(
        "fleets",
        "CPU time per decision, one thread, lean model",
        ("what", "ms", "over bare parts", "target"),
        tuple(rows),
        f"Medians over {len(took['one'])} turns of {ROBOTS} decisions. The bare parts replay what the robots are fed; "
        "all end in the same state, bit for bit. Without brains the robots take the same random moves.",
        values,
    )
    return doubted(table, BOUND_ABOVE) if min(ratios.values()) < 1.0 else table


def cores_sheet(took: Mapping[str, list[Took]]) -> Sheet:
    """Return the table of wall-clock time on two threads over one, from the turns in which the cores were free."""
    rows, values, notes = [], dict[str, float](), [f"{os.cpu_count()} cores."]
    for name in ("vector", "fleet"):
        pairs = list(zip(took[name], took[f"{name}, 2"], strict=True))
        free = [(one, two) for one, two in pairs if all(not t.waited_s > _QUIET * t.cpu_s for t in (one, two))]
        row = [_WHAT[name], "", "", "", f"≥ {_SPEED_UP:g} ?"]
        if len(free) >= 3 and (os.cpu_count() or 1) > 1:
            one_ms, two_ms = (1000.0 * statistics.median(t.wall_s for t in turns) / ROBOTS
                              for turns in zip(*free, strict=True))  # fmt: skip
            speed = statistics.median(one.wall_s / two.wall_s for one, two in free)
            verdict = against(speed, _SPEED_UP, at_least=True)
            row[1:] = [f"{one_ms:.3f}", f"{two_ms:.3f}", f"{speed:.2f}", verdict]
            values[f"{name}_speed_up"] = speed
        rows.append(tuple(row))
        notes.append(f"{name}: {len(free)} of {len(pairs)} turns found both free.")
    return Sheet(
        "cores",
        "Wall-clock time per decision on two threads",
        ("what", "one thread, ms", "two threads, ms", "speed-up", "target"),
        tuple(rows),
        f"{' '.join(notes)} A turn counts if its threads waited for a core for at most {_QUIET:.0%} of their time; "
        "fewer than three give no figure.",
        values,
    )
