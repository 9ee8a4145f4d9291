"""Pictures of the world, off screen. Only this wants OpenGL."""

from __future__ import annotations

import atexit
import weakref
from collections.abc import Iterable
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from scla_mj.errors import SclaError
from scla_mj.palette import RGB
from scla_mj.world import names
from scla_mj.world.arena import place_targets
from scla_mj.world.opengl import make_contexts
from scla_mj.world.world import World

_VISUAL_GROUPS: Final = [names.WALL_GROUP, names.VISUAL_GROUP]
_STATE: Final = mujoco.mjtState.mjSTATE_FULLPHYSICS
_MOST_GEOMS: Final = 10_000
_LINE_PIXELS: Final = 3.0
_LIT: Final = 0.5
"""Where there are shadows every light adds to a line, which would be white."""


class Renderer:
    """Draws a world as it stands, in a model of its own that has what the world's lacks: looks, lights and cameras.

    Raises:
        SclaError: there is no OpenGL here.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._grid, self._scene = world.grid, Scene(world.drawable_model())
        # Before OpenGL's own clean-up, which is registered as its first context is made.
        atexit.register(_close, weakref.ref(self))

    def render(self, camera: str, width: int, height: int) -> NDArray[np.uint8]:
        """Return what a camera (names.ANGLED_CAMERA or names.TOP_CAMERA) sees of the world now.

        Returns:
            The picture's colours, shape (height, width, 3); at most 1920 x 1440.

        Raises:
            SclaError: it is larger.
        """
        world = self._world
        if world.grid != self._grid:  # the target has jumped
            self._grid = world.grid
            place_targets(self._scene.model, world.grid)
        state = np.empty(mujoco.mj_stateSize(world.model, _STATE))
        mujoco.mj_getState(world.model, world.data, state, _STATE)
        mujoco.mj_setState(self._scene.model, self._scene.data, state, _STATE)
        return self._scene.draw(camera, width, height)

    def close(self) -> None:
        """Free what was drawn with; it draws no more."""
        self._scene.free()


class Scene:
    """A model that is drawn, with the data that it is drawn from, and the OpenGL that draws it.

    Args:
        model: a compiled model with looks, lights and cameras.
        draft: without shadows and smooth edges, which take most of the time.

    Raises:
        SclaError: there is no OpenGL here.
    """

    def __init__(self, model: Any, *, draft: bool = False) -> None:
        self.model = model
        self.data = mujoco.MjData(model)
        if draft:
            model.vis.quality.offsamples = 0
        self._scene = mujoco.MjvScene(model, _MOST_GEOMS)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = not draft
        self._options, self._camera = mujoco.MjvOption(), mujoco.MjvCamera()
        self._options.geomgroup[:] = 0
        self._options.geomgroup[_VISUAL_GROUPS] = 1
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._context: Any
        self._drawing: Any
        self._context, self._drawing = make_contexts(model)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._drawing)

    def draw(
        self, camera: str, width: int, height: int, lines: Iterable[tuple[NDArray[np.float64], RGB]] = ()
    ) -> NDArray[np.uint8]:
        """Return the picture of `data.qpos`, with lines in the scene: each two points, (2, 3), and a colour.

        Raises:
            SclaError: it is too large for the model.
        """
        most = self.model.vis.global_
        if not (0 < width <= most.offwidth and 0 < height <= most.offheight):
            largest = f"{most.offwidth} x {most.offheight}"
            raise SclaError(f"a picture of {width} x {height} pixels cannot be drawn: at most {largest}")
        mujoco.mj_forward(self.model, self.data)
        self._camera.fixedcamid = self.model.camera(camera).id
        self._context.make_current()
        seen = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(self.model, self.data, self._options, None, self._camera, seen, self._scene)
        for points, colour in lines:
            self._add_line(points, colour)
        picture = np.empty((height, width, 3), np.uint8)
        area = mujoco.MjrRect(0, 0, width, height)
        mujoco.mjr_render(area, self._scene, self._drawing)
        mujoco.mjr_readPixels(picture, None, area, self._drawing)
        return np.ascontiguousarray(picture[::-1])  # OpenGL counts rows from below

    def _add_line(self, points: NDArray[np.float64], colour: RGB) -> None:
        if self._scene.ngeom < self._scene.maxgeom:
            geom, line = self._scene.geoms[self._scene.ngeom], mujoco.mjtGeom.mjGEOM_LINE
            lit = _LIT if self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] else 1.0
            rgba = np.append(lit * np.array(colour), 255).astype(np.float32) / 255
            mujoco.mjv_initGeom(geom, line, np.zeros(3), np.zeros(3), np.eye(3).ravel(), rgba)
            mujoco.mjv_connector(geom, line, _LINE_PIXELS, *points)
            self._scene.ngeom += 1

    def free(self) -> None:
        """Free OpenGL's part, once."""
        if self._drawing is not None:
            self._context.make_current()
            self._drawing.free()
            self._context.free()
            self._drawing = None


def _close(renderer: weakref.ref[Renderer]) -> None:
    """Close a renderer that nobody closed."""
    if (left := renderer()) is not None:
        left.close()
