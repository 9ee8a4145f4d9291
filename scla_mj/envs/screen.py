"""A window of MuJoCo's own viewer, which follows a world without touching it."""

from __future__ import annotations

import time
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from scla_mj.world.arena import place_targets
from scla_mj.world.window import open_window
from scla_mj.world.world import World

_FRAME_S: Final = 0.04
_STATE: Final = mujoco.mjtState.mjSTATE_FULLPHYSICS


class Window:
    """Shows a world in data of its own, at the pace of its control periods, until its `close` is called.

    Raises:
        SclaError: there is no display.
    """

    def __init__(self, world: World, camera: str, period_s: float) -> None:
        self._stride = max(1, round(_FRAME_S / period_s))
        self._world, self._period_s = world, period_s
        self._model = world.drawable_model()
        self._data = mujoco.MjData(self._model)
        what, instead = 'render_mode "human"', 'choose "rgb_array"'
        self._viewer, self.close = open_window(self._model, self._data, what, instead)
        with self._viewer.lock():
            self._viewer.cam.type = mujoco.mjtCamera.mjCAMERA_FIXED
            self._viewer.cam.fixedcamid = self._model.camera(camera).id
        self.show()

    def show(self, rows: NDArray[np.float64] | None = None) -> None:
        """Show the world as it is now, or first a move's trajectory, in real time."""
        at, root, grid = self._world.at, self._world.at.root_qpos, self._world.grid
        place_targets(self._model, grid)
        for row in () if rows is None else rows[:: self._stride]:
            self._data.qpos[root : root + 7] = row[1:8]
            self._data.qpos[[at.left_qpos, at.right_qpos]] = row[8:10]
            self._draw(self._stride * self._period_s)
        if rows is None:
            state = np.empty(mujoco.mj_stateSize(self._world.model, _STATE))
            mujoco.mj_getState(self._world.model, self._world.data, state, _STATE)
            mujoco.mj_setState(self._model, self._data, state, _STATE)
            self._draw(self._period_s)

    def _draw(self, pause_s: float) -> None:
        if self._viewer.is_running():
            mujoco.mj_forward(self._model, self._data)
            self._viewer.sync()
            time.sleep(pause_s)
