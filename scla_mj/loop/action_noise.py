"""Action noise: the executed direction differs at random from the chosen one (the paper's non-deterministic
environment)."""

from __future__ import annotations

from typing import Any

import numpy as np

from scla_mj.grid import Action


class ActionNoise:
    """With a given probability the executed direction is one of the three others, with equal chances."""

    def __init__(self, probability: float, *, rng: np.random.Generator) -> None:
        self._probability = probability
        self._rng = rng

    def execute(self, action: Action) -> Action:
        """Return the direction to execute."""
        if self._probability == 0.0 or self._rng.random() >= self._probability:
            return action
        others = [other for other in Action if other != action]
        return others[self._rng.integers(len(others))]

    def state(self) -> dict[str, Any]:
        """Return the generator."""
        return {"rng": self._rng.bit_generator.state}

    def restore(self, state: dict[str, Any]) -> None:
        """Resume from a `state`."""
        self._rng.bit_generator.state = state["rng"]
