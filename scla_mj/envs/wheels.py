"""`scla_mj/Wheels-v0`: an action is the speeds of both wheels for a control period."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from scla_mj.config import RunConfig
from scla_mj.envs.base import TaskEnv
from scla_mj.envs.episodes import OF_DECISIONS, WheelEpisodes
from scla_mj.envs.options import checked_options


class WheelsEnv(TaskEnv):
    """Drive the robot to the target by the speeds of its two wheels.

    Action: `Box(-1, 1, (2,))`: speeds of the left and the right wheel, as fractions of `max_speed_m_s` at the rim, held
    for `frame_skip` control periods (10 ms each by default).

    Observation: `Box`, float32, (10 + rays,), clipped to its bounds: the position of the axle's midpoint, x and y in
        metres from the arena's centre; cosine and sine of the heading; the speed, m/s, forwards positive, and the
        turn rate, rad/s, to the left positive; the target's centre as the robot sees it, metres ahead and to the
        left; 1 where the front bumper touched during this action, 1 where the rear one did; and the distances to the
        walls along `rays` rays, evenly around the robot from straight ahead to the left, at most 4 m. Rays and
        bumpers read the truth; with `localisation="odometry"` or `"sensors"` position and heading are those that the
        robot believes in ("sensors" corrects them by eight rays of its own after every action).

    Reward: by how much the distance to the target's centre has shrunk, in cells; 1 more for a hit; -1 for a fall.

    Termination: a hit, the axle's midpoint in the target's cell; a fall. Truncation: after 2000 actions (a
        `TimeLimit`), 20 s with `frame_skip=1`.

    Reset: as in `GridMoveEnv`; `reset(seed=s)` puts the robot where the run of that seed starts. The physics, its steps
    and its disturbances are those of a rollout: a move's commands, replayed, end in the same state to the bit.

    Info: `time_s`, the run's time; after a step also `hit` and `fallen`, 0 or 1.

    Args:
        frame_skip: control periods for which an action is held.
        rays: how many range rays the observation has, 0 to 360.
        render_mode, camera, width, height, config, options: as in `GridMoveEnv`, without what speaks of decisions.

    Raises:
        SclaError: an argument cannot be taken.

    Version history:
        v0: the first.
    """

    def __init__(
        self,
        *,
        frame_skip: int = 1,
        rays: int = 0,
        render_mode: str | None = None,
        camera: str = "angled",
        width: int = 480,
        height: int = 360,
        config: RunConfig | None = None,
        **options: Any,
    ) -> None:
        checked = checked_options(config, options, without=OF_DECISIONS)
        self._wheels = wheels = WheelEpisodes(checked, frame_skip=frame_skip, rays=rays)
        super().__init__(wheels, render_mode=render_mode, camera=camera, width=width, height=height)
        self.metadata = {**self.metadata, "render_fps": round(1.0 / wheels.period_s)}
        self.observation_space = spaces.Box(wheels.low, wheels.high, dtype=np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, float | int]]:
        """Put the robot into a start cell; with a seed, start a run of that seed. `options` are not read."""
        info = self.start(seed)
        return self._wheels.seen, info

    def step(self, action: Any) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, float | int]]:
        """Hold wheel speeds for `frame_skip` control periods; return observation, reward, terminated, truncated, info.

        Raises:
            SclaError: the action is not two numbers from -1 to 1; or the physics has gone wrong.
        """
        reward, hit, fallen = self._wheels.command(action)
        self.show()
        info = {"time_s": self.task.time_s, "hit": int(hit), "fallen": int(fallen)}
        return self._wheels.seen, reward, hit or fallen, False, info
