"""What the Gymnasium environments share: seeds, pictures and a window."""

from __future__ import annotations

from typing import Any, Final

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from scla_mj.envs.episodes import Episodes
from scla_mj.errors import SclaError
from scla_mj.loop.task import Task
from scla_mj.randomness import MOST_SEED, require_seed
from scla_mj.world import names

CAMERAS: Final = (names.ANGLED_CAMERA, names.TOP_CAMERA)


class TaskEnv(gym.Env[Any, Any]):
    """An environment around the episodes of one task, which it seeds and draws.

    Args:
        episodes: the task in episodes.
        render_mode: None, "rgb_array" or "human".
        camera: "angled" or "top".
        width, height: of a picture, in pixels; at most 1920 x 1440.
    """

    metadata = {"render_modes": ["rgb_array", "human"], "render_fps": 1}  # noqa: RUF012 (as in Gymnasium)

    def __init__(self, episodes: Episodes, *, render_mode: str | None, camera: str, width: int, height: int) -> None:
        modes = self.metadata["render_modes"]
        if render_mode is not None and render_mode not in modes:
            raise SclaError(f"render_mode is {render_mode!r}: it must be {' or '.join(['None', *map(repr, modes)])}")
        if camera not in CAMERAS:
            raise SclaError(f"camera is {camera!r}: it must be {' or '.join(CAMERAS)}")
        self.render_mode = render_mode
        self._episodes, self._is_seeded = episodes, False
        self._picture = camera, width, height
        self._screen: Any = None
        if render_mode == "human":
            from scla_mj.envs.screen import Window

            self._screen = Window(self.task.world, camera, episodes.checked.clock.control_period_s)

    @property
    def task(self) -> Task:
        """The robot in its arena."""
        return self._episodes.task

    def start(self, seed: int | None) -> dict[str, float | int]:
        """Start an episode and return its info; a first one without a seed draws one, as no two shall be alike by
        accident.

        Raises:
            SclaError: `seed` is not one that a run can have.
        """
        seed = None if seed is None else require_seed(seed)
        super().reset(seed=seed)
        if seed is None and not self._is_seeded:
            seed = int(self.np_random.integers(MOST_SEED))
        self._episodes.start(seed)
        self._is_seeded = True
        self.show()
        return {"time_s": self.task.time_s}

    def render(self) -> NDArray[np.uint8] | None:  # type: ignore[override]
        """Return the arena as it stands, (height, width, 3), with render mode "rgb_array"; otherwise None."""
        if self.render_mode != "rgb_array":
            return None
        if self._screen is None:
            from scla_mj.world.picture import Renderer

            self._screen = Renderer(self.task.world)
        picture: NDArray[np.uint8] = self._screen.render(*self._picture)
        return picture

    def show(self, rows: NDArray[np.float64] | None = None) -> None:
        """With render mode "human", show the arena as it stands, or the rows of a trajectory one after another."""
        if self.render_mode == "human":
            self._screen.show(rows)

    def close(self) -> None:
        """Close the window, or free what draws the pictures."""
        if self._screen is not None:
            self._screen.close()
            self._screen = None
