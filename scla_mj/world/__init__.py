"""The physical world: arena and robot as one MuJoCo model, its spawns, its poses and its faults. No neurons here."""

from typing import Any

from scla_mj.environment import with_or_without


def _mujoco() -> Any:
    import mujoco

    return mujoco


with_or_without("MUJOCO_GL", _mujoco)  # only a picture needs the OpenGL that the variable names
