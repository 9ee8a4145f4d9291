"""A window of MuJoCo's own viewer, which follows a world without touching it."""

from __future__ import annotations

import threading
import time
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from scla_mj.environment import require_display
from scla_mj.world.arena import place_targets
from scla_mj.world.world import World

_FRAME_S: Final = 0.04
_PATIENCE_S: Final = 10.0
_STATE: Final = mujoco.mjtState.mjSTATE_FULLPHYSICS


class Window:
    """Shows a world in data of its own, at the pace of its control periods.

    Raises:
        SclaError: there is no display.
    """

    def __init__(self, world: World, camera: str, period_s: float) -> None:
        # MuJoCo's viewer would end the process without one.
        require_display('render_mode "human"', 'choose "rgb_array"')
        from mujoco import viewer

        self._stride = max(1, round(_FRAME_S / period_s))
        self._world, self._period_s = world, period_s
        self._model = world.drawable_model()
        self._data = mujoco.MjData(self._model)
        before = set(threading.enumerate())
        self._viewer: Any = viewer.launch_passive(self._model, self._data, show_left_ui=False, show_right_ui=False)
        self._threads = set(threading.enumerate()) - before
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

    def close(self) -> None:
        """Close the window, and wait for its thread: one that still draws as Python ends would end it with a crash."""
        self._viewer.close()
        for thread in self._threads:
            thread.join(_PATIENCE_S)
