"""Hits per 1000 decisions, the quantity of this project's results, of whatever learns in an environment."""

from __future__ import annotations

from typing import Any, SupportsFloat

import gymnasium as gym
import numpy as np


class HitRecorder(gym.Wrapper[Any, Any, Any, Any]):
    """Remembers of every decision whether it hit: whether its reward was positive and ended the episode.

    Attributes:
        hits: for each decision so far.
    """

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        super().__init__(env)
        self.hits = list[bool]()

    def step(self, action: Any) -> tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]:
        """Step the environment."""
        came = self.env.step(action)
        self.hits.append(came[2] and float(came[1]) > 0.0)
        return came

    def per_1000(self) -> list[int]:
        """Return the hits of every whole thousand of decisions."""
        whole = len(self.hits) // 1000 * 1000
        counts: list[int] = np.reshape(self.hits[:whole], (-1, 1000)).sum(axis=1).tolist()
        return counts
