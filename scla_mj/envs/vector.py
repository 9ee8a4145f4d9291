"""Vector environments: many robots, driven in one compiled call on all cores, or as the grid has it."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from gymnasium.spaces import Discrete
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from scla_mj.config import MOST_COUNT, RunConfig
from scla_mj.envs.episodes import MOVES
from scla_mj.envs.grid_move import Observed, observe, space_of
from scla_mj.envs.options import checked_options
from scla_mj.errors import SclaError
from scla_mj.grid import ACTIONS
from scla_mj.loop.fleet import Fleet
from scla_mj.randomness import MOST_SEED, require_seed
from scla_mj.validation import shown, whole_number


class GridMoveVectorEnv(VectorEnv[Any, Any, Any]):
    """`GridMoveEnv` for many robots: `gymnasium.make_vec("scla_mj.envs:scla_mj/GridMove-v0", num_envs=64)`.

    Every robot is one `GridMoveEnv` to the bit: observations, rewards, ends and infos are those of a `SyncVectorEnv`
    with `AutoresetMode.SAME_STEP` and the same seeds, which is also what this one does at an episode's end. All
    robots share one model, are driven by compiled code that does not hold the interpreter's lock, and take half a
    megabyte each.

    `reset(seed=s)` seeds robot i with s + i; a list has a seed or None for each.

    Args:
        num_envs: how many robots.
        observation, config, options: as in `GridMoveEnv`; without disturbances and with `localisation="truth"`.
        max_episode_steps: moves after which an episode is truncated, None or -1 for never.
        threads: how many threads drive them; None for one per core.

    Raises:
        SclaError: an argument cannot be taken.
    """

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.SAME_STEP}  # noqa: RUF012 (as in Gymnasium)
    has_body: ClassVar[bool] = True

    def __init__(
        self,
        num_envs: int = 1,
        *,
        observation: Observed = "sensing",
        max_episode_steps: int | None = MOVES,
        threads: int | None = None,
        config: RunConfig | None = None,
        **options: Any,
    ) -> None:
        checked = checked_options(config, options)
        self.fleet = Fleet(checked, num_envs, threads=threads, body=self.has_body)
        self.num_envs = num_envs = len(self.fleet.cells)
        self._observation, self._cells = observation, checked.config.grid.cells
        never = max_episode_steps is None or max_episode_steps == -1
        self._most_steps = np.inf if never else whole_number(max_episode_steps, "max_episode_steps", 1, MOST_COUNT)
        self.single_observation_space = space_of(observation, self._cells)
        self.single_action_space = Discrete(len(ACTIONS))
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._steps = np.zeros(num_envs, np.int64)
        self._is_seeded = np.zeros(num_envs, bool)

    def reset(  # type: ignore[override]
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.int64], dict[str, Any]]:
        """Put every robot into a start cell; with seeds, start runs of these. `options` are not read.

        Raises:
            SclaError: there is not one seed for each robot, or one is not a seed that a run can have.
        """
        seeds: list[int | None] = [None] * self.num_envs
        if seed is not None:
            given: Any = seed
            if not isinstance(seed, list) and np.ndim(seed) == 0:
                given = range(require_seed(seed), require_seed(seed) + self.num_envs)
            seeds = [None if one is None else require_seed(one) for one in given]
        if len(seeds) != self.num_envs:
            raise SclaError(f"there are {len(seeds)} seeds: {self.num_envs} robots need as many")
        for robot, one in enumerate(seeds):
            if one is not None or not self._is_seeded[robot]:
                self.fleet.reseed(robot, int(self.np_random.integers(MOST_SEED)) if one is None else one)
            else:
                self.fleet.respawn(robot)
        self._is_seeded[:] = True
        self._steps[:] = 0
        everywhere = np.ones(self.num_envs, bool)
        return self._observed(), {"time_s": self.fleet.time_s, "_time_s": everywhere}

    def step(
        self, actions: Any
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Carry out one move of every robot, and reset those whose episode has ended.

        Returns:
            Observations, those of new episodes included; rewards; terminated; truncated; infos, of which `final_obs`
            and `final_info` have what the ended episodes came to.

        Raises:
            SclaError: the actions are not N numbers from 0 to 3; or the physics has gone wrong.
        """
        taken = np.asarray(actions)
        if taken.shape != (self.num_envs,) or not np.issubdtype(taken.dtype, np.integer) or (taken >> 2).any():
            wanted = f"{self.num_envs} numbers, 0 to {len(ACTIONS) - 1}"
            raise SclaError(f"the actions are {shown(actions)}: they must be {wanted}")
        came = self.fleet.act(taken.astype(np.int64))
        self._steps += 1
        over, late = came.hit | came.fallen, self._steps >= self._most_steps
        ended, final = over | late, self._observed()
        step_info = {
            "time_s": self.fleet.time_s, "duration_s": came.duration_s, "crossed_s": came.crossed_s,
            "position_error_m": came.position_error_m, "executed": came.executed, "outcome": came.outcome,
        }  # fmt: skip
        for robot in np.flatnonzero(over).tolist():
            self.fleet.respawn(robot)
        self.fleet.begin_decisions()
        for robot in np.flatnonzero(late & ~over).tolist():
            self.fleet.respawn(robot)
        self._steps[ended] = 0
        infos: dict[str, Any] = {}
        if ended.any():
            observations = np.full(self.num_envs, None, object)
            for robot in np.flatnonzero(ended).tolist():
                observations[robot] = final[robot]
            infos |= {"final_obs": observations, "_final_obs": ended.copy()}
            infos |= {"final_info": _masked(step_info, ended), "_final_info": ended.copy()}
        infos |= _masked(step_info, ~ended)
        infos["time_s"], infos["_time_s"] = self.fleet.time_s, np.ones(self.num_envs, bool)
        return self._observed(), came.hit.astype(np.float64), came.hit, came.fallen | late, infos

    def _observed(self) -> NDArray[np.int64]:
        seen = np.column_stack([self.fleet.cells - 1, self.fleet.sensed])
        observed: Any = observe(self._observation, self._cells, seen)
        return np.array(observed, np.int64)

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads."""
        self.fleet.close()


class GridTwinVectorEnv(GridMoveVectorEnv):
    """`GridTwinEnv` for many robots: the discrete twin, at about a hundredth of the cost of driven moves."""

    has_body = False


def _masked(info: dict[str, NDArray[Any]], where: NDArray[np.bool_]) -> dict[str, NDArray[Any]]:
    """Return the entries of some robots, 0 for the others, each with its mask, as Gymnasium has them."""
    masked: dict[str, NDArray[Any]] = {}
    if where.any():
        for name, values in info.items():
            masked[name], masked[f"_{name}"] = np.where(where, values, 0), where.copy()
    return masked
