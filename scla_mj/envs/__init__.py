"""The task as Gymnasium and dm_env environments, and our brains in other environments (docs/environments.md).

`gymnasium.make("scla_mj.envs:scla_mj/GridMove-v0")` imports this module, which registers them; neither MuJoCo nor numba
is imported before an environment is made.
"""

from __future__ import annotations

import importlib
import importlib.util
from typing import Any, Final

from scla_mj.extras import need

_PLACES: Final = {
    "GridMoveEnv": "scla_mj.envs.grid_move",
    "GridTwinEnv": "scla_mj.envs.grid_move",
    "WheelsEnv": "scla_mj.envs.wheels",
    "GridMoveVectorEnv": "scla_mj.envs.vector",
    "GridTwinVectorEnv": "scla_mj.envs.vector",
    "HitRecorder": "scla_mj.envs.hits",
    "BrainAgent": "scla_mj.envs.agents",
    "play": "scla_mj.envs.agents",
}
__all__ = list(_PLACES)


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name not in ("BrainAgent", "play"):
        need("gymnasium", name)
    return getattr(importlib.import_module(_PLACES[name]), name)


def _register() -> None:
    from gymnasium.envs.registration import register

    for name, steps, vector in (
        ("GridMove", 200, True),
        ("GridTwin", 200, True),
        ("Wheels", 2000, False),
    ):
        register(
            id=f"scla_mj/{name}-v0",
            entry_point=f"{_PLACES[f'{name}Env']}:{name}Env",
            vector_entry_point=f"scla_mj.envs.vector:{name}VectorEnv" if vector else None,
            max_episode_steps=steps,
        )


if importlib.util.find_spec("gymnasium") is not None:
    _register()
