"""Pictures of the world, off screen. Only this wants OpenGL, and takes what dm_control finds: glfw, EGL or OSMesa."""

from __future__ import annotations

from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from scla_mj.world import names
from scla_mj.world.opengl import make_physics
from scla_mj.world.world import World

_VISUAL_GROUPS: Final = [names.WALL_GROUP, names.VISUAL_GROUP]
_STATE: Final = mujoco.mjtState.mjSTATE_FULLPHYSICS


class Renderer:
    """Draws a world as it stands, in a model of its own that has what the world's lacks: looks, lights and cameras."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._grid, self._physics = world.grid, _drawable(world)

    def render(self, camera: str, width: int, height: int) -> NDArray[np.uint8]:
        """Return what a camera (names.ANGLED_CAMERA or names.TOP_CAMERA) sees of the world now.

        Returns:
            The picture's colours, shape (height, width, 3); at most 1920 x 1440.
        """
        from dm_control.mujoco import wrapper

        world = self._world
        if world.grid != self._grid:  # the target has jumped
            self._physics.free()
            self._grid, self._physics = world.grid, _drawable(world)
        state = np.empty(mujoco.mj_stateSize(world.model, _STATE))
        mujoco.mj_getState(world.model, world.data, state, _STATE)
        model, data = self._physics.model.ptr, self._physics.data.ptr
        mujoco.mj_setState(model, data, state, _STATE)
        mujoco.mj_forward(model, data)
        options = wrapper.MjvOption()
        options.geomgroup[:] = 0
        options.geomgroup[_VISUAL_GROUPS] = 1
        picture: NDArray[np.uint8] = self._physics.render(height, width, camera_id=camera, scene_option=options)
        return picture

    def close(self) -> None:
        """Free what was drawn with; it draws no more."""
        self._physics.free()


def _drawable(world: World) -> Any:
    return make_physics(mujoco.MjData(world.drawable_model()))
