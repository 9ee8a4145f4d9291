"""`scla_mj/GridMove-v0` and `scla_mj/GridTwin-v0`: an action is a whole move, driven, or as the grid has it."""

from __future__ import annotations

from typing import Any, ClassVar, Literal, get_args

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from scla_mj.config import RunConfig
from scla_mj.envs.base import TaskEnv
from scla_mj.envs.episodes import NOT_SENSED, OUTCOMES, MoveEpisodes
from scla_mj.envs.options import checked_options
from scla_mj.errors import SclaError
from scla_mj.grid import ACTIONS

Observed = Literal["sensing", "cell", "index"]


def space_of(observation: Observed, cells: tuple[int, int]) -> spaces.Space[Any]:
    """Return the space of observations.

    Raises:
        SclaError: there is no such kind of observation.
    """
    if observation not in get_args(Observed):
        raise SclaError(f"observation is {observation!r}: it must be {', '.join(get_args(Observed))}")
    if observation == "index":
        return spaces.Discrete(cells[0] * cells[1] * (NOT_SENSED + 1))
    return spaces.MultiDiscrete([*cells, NOT_SENSED + 1] if observation == "sensing" else list(cells))


def observe(
    observation: Observed, cells: tuple[int, int], seen: NDArray[np.int64] | tuple[int, int, int]
) -> NDArray[np.int64] | np.int64:
    """Return what is observed of column and row, from 0, and sensed direction; in arrays these are the last axis."""
    whole = np.array(seen, np.int64)
    if observation == "index":
        index: NDArray[np.int64] = (whole[..., 0] * cells[1] + whole[..., 1]) * (NOT_SENSED + 1) + whole[..., 2]
        return index
    return whole if observation == "sensing" else whole[..., :2]


class GridMoveEnv(TaskEnv):
    """The paper's task: one action is one whole move of the robot, driven on real wheels.

    Action: `Discrete(4)`: up, down, left, right (`scla_mj.Action`). The robot stands through a decision window, turns,
    drives to the next cell's centre, or into a wall and back. That takes about a second of simulated time.

    Observation (`observation=`):

    - `"sensing"`: `MultiDiscrete([W, H, 5])`: column and row of the cell, from 0, and the direction of a target in a
      neighbouring cell, 4 where there is none;
    - `"cell"`: `MultiDiscrete([W, H])`: column and row only;
    - `"index"`: `Discrete(W * H * 5)`: the same as `"sensing"` in one number, (column * H + row) * 5 + direction.

    A robot that localises itself (`localisation="odometry"`, `"sensors"`) observes the cell that it believes to be in.

    Reward: 1 for a hit, otherwise 0. A return of at most 1; fewer moves show in the discount or in the episode's
        length.

    Termination: a hit, the robot in the target's cell. Truncation: the robot has fallen, or has failed three times in a
    row; and after 200 moves (a `TimeLimit`: `max_episode_steps=-1` takes it off).

    Reset: in a start cell of the protocol, facing one of four directions. `reset(seed=s)` starts a run of that seed at
    time 0, with the same bits as `scla-mj rollout --seed s`; `reset()` continues as a rollout after a hit.

    Info, numbers only: `time_s`, the run's time. After a step also `duration_s` of the drive, `crossed_s`, when the
    axle crossed into the next cell (0 where it did not), `position_error_m` (NaN after a fall), `executed`, the
    direction that the robot reports to have driven in (action noise), and `outcome`: 0 moved, 1 blocked, 2 failed.

    Args:
        observation: see above.
        render_mode: None; "rgb_array", a picture of the arena where the move has ended; "human", every move in real
            time, in MuJoCo's viewer.
        camera, width, height: of pictures; "angled" or "top".
        config: where the settings start from, such as `scla_mj.load_run(...).config`; brains' settings are not read.
        options: settings of `RunConfig` without their section, with the same names, ranges and errors: `protocol`,
            `cells`, `target`, `closed_cells`, `action_noise`, `jump_epoch`, `jump_target`, `crossed_epoch`,
            `localisation`, `max_speed_m_s` and so on; `disturb=["friction", "pushes"]` names sets of disturbances.
            Epochs are `decisions` actions long, counted from the last seed: the target jumps between two actions.

    Raises:
        SclaError: an argument cannot be taken.

    Version history:
        v0: the first.
    """

    has_body: ClassVar[bool] = True

    def __init__(
        self,
        *,
        observation: Observed = "sensing",
        render_mode: str | None = None,
        camera: str = "angled",
        width: int = 480,
        height: int = 360,
        config: RunConfig | None = None,
        **options: Any,
    ) -> None:
        self._moves = MoveEpisodes(checked_options(config, options), body=self.has_body)
        super().__init__(self._moves, render_mode=render_mode, camera=camera, width=width, height=height)
        self._observation, self._cells = observation, self.task.grid.cells
        self.observation_space = space_of(observation, self._cells)
        self.action_space = spaces.Discrete(len(ACTIONS))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, float | int]]:
        """Put the robot into a start cell; with a seed, start a run of that seed. `options` are not read."""
        info = self.start(seed)
        return observe(self._observation, self._cells, self._moves.seen), info

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, float | int]]:
        """Carry out one move; return observation, reward, terminated, truncated and info.

        Raises:
            SclaError: the action is not 0 to 3; or the physics has gone wrong.
        """
        if not (type(action) is int and 0 <= action < len(ACTIONS)) and not self.action_space.contains(action):
            raise SclaError(f"the action is {action!r}: it must be 0 to {len(ACTIONS) - 1}")
        came = self._moves.act(action, observe=self.render_mode == "human")
        feedback, move = came.feedback, came.move
        self.show(move.trajectory)
        info = {
            "time_s": self.task.time_s,
            "duration_s": move.duration_s,
            "crossed_s": feedback.crossed_s or 0.0,
            "position_error_m": move.position_error_m,
            "executed": int(feedback.executed),
            "outcome": OUTCOMES.index(feedback.outcome),
        }
        seen = observe(self._observation, self._cells, self._moves.seen)
        return seen, float(feedback.hit), feedback.hit, move.fallen, info


class GridTwinEnv(GridMoveEnv):
    """The discrete twin of `GridMoveEnv`: the same spaces, seeds, starts, rewards, cells and hits without physics.

    Where nothing disturbs the robot, an episode is that of `GridMoveEnv` with the same seed and actions, some
    fifty times as fast. `duration_s` and `crossed_s` are what a driven move takes on average, `position_error_m` is
    0. What a body makes of its world cannot be had: `disturb`, the settings of disturbances, `localisation` and
    pictures.

    Version history:
        v0: the first.
    """

    metadata = {"render_modes": [], "render_fps": 1}  # noqa: RUF012 (as in Gymnasium)
    has_body = False
