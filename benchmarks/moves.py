"""The move compared with bare `mj_step`, and the same robot under the same commands in other hands."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator
from typing import Any, Final

import mujoco
import numpy as np

from benchmarks.replay import Recorded, record, replay_moves, replay_physics, set_physics_state
from benchmarks.table import BOUND_ABOVE, Sheet, against, doubted
from benchmarks.timing import Contender, Watch, median_cpu_s, nothing, turns
from scla_mj.checked import check
from scla_mj.config import RunConfig
from scla_mj.engine.build import simulate
from scla_mj.errors import SclaError
from scla_mj.extras import need
from scla_mj.loop.drive import Driver
from scla_mj.world.world import World

_MOVE_TARGET: Final = 1.10
_WHAT: Final = {
    "bare": "bare mj_step, from C",
    "moves": "our moves, controller and all",
    "python": "mj_step, from a Python loop",
    "dm_control": "dm_control Environment",
}


def measure(config: RunConfig, *, repetitions: int, watch: Watch) -> Sheet:
    """Time the physics of one rollout in every hand; all must leave the robot in the same place to the last bit.

    Raises:
        SclaError: they do not.
    """
    recorded = record(config)
    clock = check(config).clock
    worlds = {name: simulate(config).world for name in _WHAT}
    driver = Driver(worlds["moves"], clock, config.controller)
    steps = clock.physics_steps_per_control
    environment = _environment(worlds["dm_control"], steps, clock.control_period_s)
    contenders = {
        "bare": Contender(nothing, lambda _: turns(replay_physics(worlds["bare"], recorded, steps))),
        "moves": Contender(
            nothing, lambda _: turns(replay_moves(worlds["moves"], driver, recorded, clock.thinking_controls))
        ),
        "python": Contender(nothing, lambda _: turns(_step_in_python(worlds["python"], recorded, steps))),
        "dm_control": Contender(
            nothing, lambda _: turns(_step_environment(worlds["dm_control"], environment, recorded))
        ),
    }
    seconds = median_cpu_s(contenders, repetitions=repetitions, watch=watch)
    for name, world in worlds.items():
        if not np.array_equal(world.data.qpos, worlds["bare"].data.qpos):
            raise SclaError(f"{_WHAT[name]}: the robot ends elsewhere than under bare mj_step; the bench is void")
    return _sheet(seconds, recorded, decisions=config.epochs * config.decisions)


def _sheet(seconds: dict[str, float], recorded: Recorded, *, decisions: int) -> Sheet:
    rows, values = [], {}
    for name, what in _WHAT.items():
        ratio = seconds[name] / seconds["bare"]
        target = against(ratio, _MOVE_TARGET) if name == "moves" else ""
        per_period = 1e6 * seconds[name] / recorded.periods
        rows.append((what, f"{1000 * seconds[name] / decisions:.3f}", f"{per_period:.2f}", f"{ratio:.2f}", target))
        values[f"{name}_us_per_period"], values[f"{name}_ratio"] = per_period, ratio
    table = Sheet(
        "move",
        "CPU time of a move",
        ("what", "ms", "µs per period", "over bare", "target"),
        tuple(rows),
        "The physics of a decision, decision window and drive, in control periods under the same commands. The loop "
        "and the environment read the pose and set the commands in each period. All end in the same state, "
        "bit for bit.",
        values,
    )
    return doubted(table, BOUND_ABOVE) if values["moves_ratio"] < 1 else table


def _step_in_python(world: World, recorded: Recorded, steps: int) -> Iterator[None]:
    model, data = world.model, world.data
    for state, attempts in recorded.episodes:
        set_physics_state(world, state)
        for attempt in attempts:
            for command in attempt.commands:
                _ = data.qpos.copy(), data.qvel.copy()
                data.ctrl[:] = command
                mujoco.mj_step(model, data, nstep=steps)
            yield


def _environment(world: World, steps: int, period_s: float) -> Any:
    """The world as a dm_control environment whose episodes never end by themselves."""
    need("dm_control", "the bench")
    # isort: off
    from scla_mj.envs.control import make_physics  # before dm_control: it chooses what that draws with
    from dm_control.rl import control
    from dm_env import specs
    # isort: on

    class Replay(control.Task):  # type: ignore[misc]  # dm_control has no types
        """Sets the commands it is given, and observes pose and speeds."""

        def initialize_episode(self, physics: Any) -> None:
            """Leave the state as it is: the replay sets it."""

        def before_step(self, action: Any, physics: Any) -> None:
            """Set the wheel commands."""
            physics.set_control(action)

        def action_spec(self, physics: Any) -> Any:
            """Describe the two commands."""
            return specs.Array((physics.model.nu,), np.float64)

        def get_observation(self, physics: Any) -> Any:
            """Return pose and speeds."""
            return OrderedDict(position=physics.data.qpos.copy(), velocity=physics.data.qvel.copy())

        def get_reward(self, physics: Any) -> float:
            """Return nothing: what is timed is the stepping."""
            return 0.0

    environment = control.Environment(
        make_physics(world.data), Replay(), control_timestep=period_s, n_sub_steps=None, legacy_step=False
    )
    assert environment._n_sub_steps == steps
    environment.reset()
    return environment


def _step_environment(world: World, environment: Any, recorded: Recorded) -> Iterator[None]:
    for state, attempts in recorded.episodes:
        set_physics_state(world, state)
        for attempt in attempts:
            for command in attempt.commands:
                environment.step(command)
            yield
