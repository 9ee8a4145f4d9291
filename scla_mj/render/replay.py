"""A stored run in MuJoCo's own viewer, which can be turned, zoomed and looked into while the robot drives."""

from __future__ import annotations

import itertools
import time
from typing import Final

import mujoco

from scla_mj.engine.interrupts import held_back
from scla_mj.engine.stored_run import StoredRun
from scla_mj.environment import require_display
from scla_mj.render.film import Film, drawn_model, frame_times, grid_at
from scla_mj.render.poses import stored_poses
from scla_mj.world import names
from scla_mj.world.arena import place_targets
from scla_mj.world.window import open_window

_FPS: Final = 30
_NEEDS: Final = ("MuJoCo's viewer", "`scla-mj render` needs none")


def replay(run: StoredRun, decisions: range, *, speed: float, stay: bool) -> None:
    """Show some decisions at so many simulated seconds per second, until the window is closed; unless it is to `stay`,
    it is closed after the last pose.

    Raises:
        SclaError: there is no display, or the run is damaged.
    """
    require_display(*_NEEDS)  # before the run is simulated again
    model = drawn_model(run)
    poses, _ = stored_poses(run, decisions, model)
    times_s = frame_times(run, decisions, poses, Film(names.ANGLED_CAMERA, fps=_FPS, speed=speed))
    data = mujoco.MjData(model)
    with held_back() as let_through:  # while the window opens, nothing could close it
        window, close = open_window(model, data, *_NEEDS)
        try:
            begun_s = time.monotonic()
            for number in itertools.count():
                let_through()
                if not window.is_running() or (number == len(times_s) and not stay):
                    break
                if number < len(times_s):
                    place_targets(model, grid_at(run, poses, times_s[number]))
                    data.qpos[:] = poses.at(times_s[number])
                    mujoco.mj_forward(model, data)
                window.sync()
                time.sleep(max(0.0, begun_s + number / _FPS - time.monotonic()))
        finally:
            close()
