"""The task as a `dm_control.rl.control.Environment`, loaded by name as dm_control's suite has it."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from scla_mj.envs.episodes import MOVES, OF_DECISIONS, PERIODS
from scla_mj.envs.options import checked_options
from scla_mj.errors import SclaError
from scla_mj.extras import need
from scla_mj.randomness import MOST_SEED

_DISTURBED: Final = {"disturb": ("all",)}
TASKS: Final[dict[tuple[str, str], dict[str, Any]]] = {
    ("grid_move", "any_start"): {},
    ("grid_move", "sensed_start"): {"protocol": "sensed-start"},
    ("grid_move", "disturbed"): _DISTURBED,
    ("wheels", "reach"): {},
    ("wheels", "reach_disturbed"): _DISTURBED,
}
"""Domains and tasks, each with its settings."""
_MOVE_S: Final = 1.0
"""What dm_control takes a whole move to last; it takes about as long."""


def load(
    domain_name: str,
    task_name: str,
    task_kwargs: dict[str, Any] | None = None,
    environment_kwargs: dict[str, Any] | None = None,
) -> Any:
    """Return a `dm_control.rl.control.Environment`, as `dm_control.suite.load` does.

    | domain | tasks | action | observation |
    |---|---|---|---|
    | grid_move | any_start, sensed_start, disturbed | 0 to 3: a whole move | `cell` (2,), `sensed` (5,): one-hot |
    | wheels | reach, reach_disturbed | two speeds, -1 to 1 | `pose`, `speeds`, `target`, `bumpers`, `rays` |

    They are `GridMoveEnv` and `WheelsEnv`: the same physics, rewards and ends, to the bit. A hit, and a fall of a robot
    whose wheels are driven, end an episode with discount 0; a fall on a whole move, 200 moves or 20 s with discount 1.

    Args:
        domain_name, task_name: see the table.
        task_kwargs: `random`, the seed, None for any; and the settings of `GridMoveEnv` or `WheelsEnv`.
        environment_kwargs: of `control.Environment`: `time_limit` (whole moves count a second each),
            `flat_observation`.

    Raises:
        SclaError: there is no such task, a setting cannot be taken, or dm_control is not installed.
    """
    if (domain_name, task_name) not in TASKS:
        known = ", ".join(f"{domain}/{task}" for domain, task in TASKS)
        raise SclaError(f"{domain_name}/{task_name} is no task: choose from {known}")
    need("dm_control", "scla_mj.load")
    from scla_mj.envs import control

    options = TASKS[domain_name, task_name] | (task_kwargs or {})
    seed, config = options.pop("random", None), options.pop("config", None)
    if seed is None:
        seed = int(np.random.SeedSequence().generate_state(1, np.uint64)[0] & MOST_SEED)
    task: Any
    if domain_name == "wheels":
        own = {name: options.pop(name) for name in ("frame_skip", "rays") if name in options}
        task = control.Wheels(checked_options(config, options, without=OF_DECISIONS), seed, **own)
        limits = {"time_limit": PERIODS * task.period_s, "control_timestep": task.period_s}
    else:
        task = control.GridMove(checked_options(config, options), seed)
        limits = {"time_limit": MOVES * _MOVE_S, "control_timestep": _MOVE_S}
    return control.environment(task, **limits | (environment_kwargs or {}))
