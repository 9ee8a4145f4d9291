"""Pictures of the world, off screen. Only this wants OpenGL, and takes what dm_control finds: glfw, EGL or OSMesa."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from scla_mj.world import names

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from scla_mj.world.world import World

_VISUAL_GROUPS: Final = [names.WALL_GROUP, names.VISUAL_GROUP]


def render(world: World, camera: str, width: int, height: int) -> NDArray[np.uint8]:
    """Return what a camera (names.ANGLED_CAMERA or names.TOP_CAMERA) sees of the world as it stands.

    Returns:
        The picture's colours, shape (height, width, 3); at most 1920 x 1440.
    """
    physics = world.physics
    from dm_control.mujoco import wrapper

    options = wrapper.MjvOption()
    options.geomgroup[:] = 0
    options.geomgroup[_VISUAL_GROUPS] = 1
    picture: NDArray[np.uint8] = physics.render(height, width, camera_id=camera, scene_option=options)
    return picture
