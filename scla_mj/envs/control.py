"""The task in dm_control's classes: the one module that imports it."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from typing import Any, Final

import mujoco
import numpy as np

from scla_mj.checked import CheckedConfig
from scla_mj.environment import has_display, with_or_without
from scla_mj.envs.episodes import BUMPERS, POSE, RAYS, SPEEDS, TARGET, MoveEpisodes, WheelEpisodes
from scla_mj.errors import SclaError
from scla_mj.grid import ACTIONS
from scla_mj.world.opengl import VARIABLE, without_display


@contextlib.contextmanager
def _opengl_without_display() -> Iterator[None]:
    """While dm_control is imported, point it to what draws without a display, unless there is one or the user chose.

    It would take glfw, which warns and cannot draw.
    """
    if has_display() or VARIABLE in os.environ:
        yield
        return
    os.environ[VARIABLE] = next(without_display(), "disable")
    try:
        yield
    finally:
        del os.environ[VARIABLE]


def _imported() -> Any:
    with _opengl_without_display():
        from dm_control import mujoco as wrapped

    return wrapped


def _forget_what_mujoco_dropped() -> None:
    """Take from dm_control's table of array sizes the names that this MuJoCo has no more: it reads them all."""
    from dm_control.mujoco.wrapper.mjbindings import sizes

    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    for struct, holder in (("mjmodel", model), ("mjdata", mujoco.MjData(model))):
        names = sizes.array_sizes[struct]
        for name in [name for name in names if not hasattr(holder, name)]:
            del names[name]


_mujoco: Final = with_or_without(VARIABLE, _imported)  # before the rest of it: this chooses what it draws with
_forget_what_mujoco_dropped()

from dm_control.rl import control  # noqa: E402
from dm_env import specs  # noqa: E402


def make_physics(data: Any) -> Any:
    """Return a `dm_control.mujoco.Physics` of these data and of their model."""
    return _mujoco.Physics(_mujoco.wrapper.MjData(data))


def environment(task: Any, **options: Any) -> Any:
    """Return a task's `control.Environment`."""
    physics = _TasksPhysics(_mujoco.wrapper.MjData(task.episodes.task.world.data))
    return control.Environment(physics, task, **options)


class _TasksPhysics(_mujoco.Physics):  # type: ignore[misc, name-defined]
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


class GridMove(_Task):
    """Whole moves."""

    def __init__(self, checked: CheckedConfig, seed: int) -> None:
        super().__init__(MoveEpisodes(checked, lean=False), seed)

    def action_spec(self, physics: Any) -> Any:
        """Return that of up, down, left, right."""
        return specs.DiscreteArray(len(ACTIONS), name="move")

    def before_step(self, action: Any, physics: Any) -> None:
        """Carry out the whole move."""
        if np.size(action) != 1 or np.ravel(action)[0] not in range(len(ACTIONS)):
            raise SclaError(f"the action is {action!r}: it must be 0 to {len(ACTIONS) - 1}")
        came = self.episodes.act(int(np.ravel(action)[0]))
        self._reward = float(came.feedback.hit)
        self._discount = 0.0 if came.feedback.hit else 1.0 if came.move.fallen else None

    def get_observation(self, physics: Any) -> dict[str, Any]:
        """Return column and row, from 0, and one-hot the sensed direction, the last for none."""
        column, row, sensed = self.episodes.seen
        return {"cell": np.array([column, row]), "sensed": np.eye(len(ACTIONS) + 1)[sensed]}


class Wheels(_Task):
    """Wheel speeds."""

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
