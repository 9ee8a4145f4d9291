"""A stored run in MuJoCo's own viewer, which can be turned, zoomed and looked into while the robot drives."""

from __future__ import annotations

import time
from typing import Final

import mujoco

from scla_mj.engine.stored_run import StoredRun
from scla_mj.environment import require_display
from scla_mj.render.film import Film, drawn_model, frame_times, grid_at
from scla_mj.render.poses import stored_poses
from scla_mj.world import names
from scla_mj.world.arena import place_targets

_FPS: Final = 30


def replay(run: StoredRun, decisions: range, *, speed: float) -> None:
    """Show some decisions at so many simulated seconds per second, until they are over or the window is closed.

    Raises:
        SclaError: there is no display, or the run is damaged.
    """
    require_display("MuJoCo's viewer", "`scla-mj render` needs none")  # without one it would end the process
    from mujoco import viewer

    model = drawn_model(run)
    poses, _ = stored_poses(run, decisions, model)
    times_s = frame_times(run, decisions, poses, Film(names.ANGLED_CAMERA, fps=_FPS, speed=speed))
    data = mujoco.MjData(model)
    with viewer.launch_passive(model, data, show_left_ui=False, show_right_ui=False) as window:
        begun_s = time.monotonic()
        for number, time_s in enumerate(times_s.tolist()):
            if not window.is_running():
                break
            place_targets(model, grid_at(run, poses, time_s))
            data.qpos[:] = poses.at(time_s)
            mujoco.mj_forward(model, data)
            window.sync()
            time.sleep(max(0.0, begun_s + number / _FPS - time.monotonic()))
