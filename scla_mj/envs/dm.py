"""The task as a `dm_control.rl.control.Environment`, loaded by name as dm_control's suite has it."""

from __future__ import annotations

from typing import Any, Final

import mujoco
import numpy as np

from scla_mj.checked import CheckedConfig
from scla_mj.envs.episodes import (
    BUMPERS,
    MOVES,
    OF_DECISIONS,
    PERIODS,
    POSE,
    RAYS,
    SPEEDS,
    TARGET,
    MoveEpisodes,
    WheelEpisodes,
)
from scla_mj.envs.options import checked_options
from scla_mj.errors import SclaError
from scla_mj.grid import ACTIONS
from scla_mj.randomness import MOST_SEED
from scla_mj.world.opengl import dm_control

_dm_mujoco: Final = dm_control()  # before anything else of it is imported: this chooses what it draws with

from dm_control.rl import control  # noqa: E402
from dm_env import specs  # noqa: E402

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
        SclaError: there is no such task, or a setting cannot be taken.
    """
    if (domain_name, task_name) not in TASKS:
        known = ", ".join(f"{domain}/{task}" for domain, task in TASKS)
        raise SclaError(f"{domain_name}/{task_name} is no task: choose from {known}")
    options = TASKS[domain_name, task_name] | (task_kwargs or {})
    seed, config = options.pop("random", None), options.pop("config", None)
    if seed is None:
        seed = int(np.random.SeedSequence().generate_state(1, np.uint64)[0] & MOST_SEED)
    task: Any
    if domain_name == "wheels":
        own = {name: options.pop(name) for name in ("frame_skip", "rays") if name in options}
        task = _Wheels(checked_options(config, options, without=OF_DECISIONS), seed, **own)
        limits = {"time_limit": PERIODS * task.period_s, "control_timestep": task.period_s}
    else:
        task = _GridMove(checked_options(config, options), seed)
        limits = {"time_limit": MOVES * _MOVE_S, "control_timestep": _MOVE_S}
    physics = _Physics(_dm_mujoco.wrapper.MjData(task.episodes.task.world.data))
    return control.Environment(physics, task, **limits | (environment_kwargs or {}))


class _Physics(_dm_mujoco.Physics):  # type: ignore[misc, name-defined]
    """Physics that the task steps and resets: dm_control must not."""

    def reset(self, keyframe_id: int | None = None) -> None:
        """Leave it to the task's spawn."""

    def after_reset(self) -> None:
        """Derive what is drawn and named, but leave the solver's warm start as the spawn set it."""
        model, data, kind = self.model.ptr, self.data.ptr, mujoco.mjtState.mjSTATE_INTEGRATION
        state = np.empty(mujoco.mj_stateSize(model, kind))
        mujoco.mj_getState(model, data, state, kind)
        super().after_reset()
        mujoco.mj_setState(model, data, state, kind)

    def step(self, nstep: int = 1) -> None:
        """Bring what is drawn and named up to date; this touches nothing that is integrated."""
        model, data = self.model.ptr, self.data.ptr
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_camlight(model, data)


class _Task(control.Task):  # type: ignore[misc]
    """A task in episodes; `seed` is that of the first one."""

    def __init__(self, episodes: Any, seed: int) -> None:
        self.episodes = episodes
        self._seed: int | None = seed
        self._reward = 0.0
        self._discount: float | None = None
        episodes.start(seed)

    def initialize_episode(self, physics: Any) -> None:
        """Spawn the robot; the first time, where the seed's run starts."""
        self.episodes.start(self._seed)
        self._seed, self._discount = None, None

    def after_step(self, physics: Any) -> None:
        """Do nothing."""

    def get_reward(self, physics: Any) -> float:
        """Return the last action's reward."""
        return self._reward

    def get_termination(self, physics: Any) -> float | None:
        """Return the discount if the last action ended the episode."""
        return self._discount


class _GridMove(_Task):
    def __init__(self, checked: CheckedConfig, seed: int) -> None:
        super().__init__(MoveEpisodes(checked, lean=False), seed)

    def action_spec(self, physics: Any) -> Any:
        """Return that of up, down, left, right."""
        return specs.DiscreteArray(len(ACTIONS), name="move")

    def before_step(self, action: Any, physics: Any) -> None:
        """Carry out the whole move."""
        came = self.episodes.act(int(action))
        self._reward = float(came.feedback.hit)
        self._discount = 0.0 if came.feedback.hit else 1.0 if came.move.fallen else None

    def get_observation(self, physics: Any) -> dict[str, Any]:
        """Return column and row, from 0, and one-hot the sensed direction, the last for none."""
        column, row, sensed = self.episodes.seen
        return {"cell": np.array([column, row]), "sensed": np.eye(len(ACTIONS) + 1)[sensed]}


class _Wheels(_Task):
    def __init__(self, checked: CheckedConfig, seed: int, **own: int) -> None:
        super().__init__(WheelEpisodes(checked, lean=False, **own), seed)
        self.period_s = self.episodes.period_s

    def action_spec(self, physics: Any) -> Any:
        """Return that of two wheel speeds."""
        return specs.BoundedArray((2,), np.float64, -1.0, 1.0, name="left\tright")

    def before_step(self, action: Any, physics: Any) -> None:
        """Hold the speeds."""
        self._reward, hit, fallen = self.episodes.command(action)
        self._discount = 0.0 if hit or fallen else None

    def get_observation(self, physics: Any) -> dict[str, Any]:
        """Return the parts of what `WheelsEnv` observes."""
        seen = self.episodes.seen
        parts = {"pose": POSE, "speeds": SPEEDS, "target": TARGET, "bumpers": BUMPERS, "rays": RAYS}
        return {name: seen[part] for name, part in parts.items() if len(seen[part])}
