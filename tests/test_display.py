"""What needs a display, under a virtual one: MuJoCo's window and dm_control's viewer show robots that move, and end."""

import os
import shutil
import subprocess
import sys

import pytest

HUMAN = """
import gymnasium as gym

for name, action in (("GridMove", 0), ("Wheels", [0.5, 0.5])):
    env = gym.make(f"scla_mj.envs:scla_mj/{name}-v0", render_mode="human")
    env.reset(seed=1)
    env.step(action)
    assert env.unwrapped._screen._viewer.is_running()
    env.close()
print("shown")
"""
VIEWER = """
import glfw
import numpy as np
from dm_control import viewer
from dm_control.viewer import application

import scla_mj

apps, places = [], []


class Running(application.Application):
    def __init__(self, **options):
        super().__init__(**options)
        self._pause_subject.value = False  # as by the space key
        apps.append(self)


def policy(step):
    places.append(step.observation["pose"])
    if len(places) == 20:
        glfw.set_window_should_close(apps[0]._window._context.window, True)
    return np.array([0.5, 0.5])


application.Application = Running
viewer.launch(scla_mj.load("wheels", "reach", {"random": 1}), policy, width=160, height=120)
assert np.abs(places[-1] - places[0]).max() > 0.001
print("shown")
"""

REPLAY = """
import os
import signal
import sys
import threading

from scla_mj.cli.main import main

assert main(["rollout", "RUN", "--brain", "random", "--epochs", "1", "--decisions", "2", "--telemetry", "off"]) == 0
replay = ["view", "RUN", "--mujoco", "--speed", "1000"]
assert main([*replay, "--no-stay"]) == 0
for number in (signal.SIGINT, signal.SIGTERM):
    threading.Timer(2.0, os.kill, (os.getpid(), number)).start()
    assert main(replay) == 128 + number  # nothing else ends what stays at its last pose
print("shown")
"""


@pytest.mark.skipif(shutil.which("xvfb-run") is None, reason="no virtual display: xvfb-run is not installed")
@pytest.mark.parametrize("program", [HUMAN, VIEWER, REPLAY], ids=["human", "dm_control.viewer", "replay"])
def test_under_a_virtual_display_the_windows_open_show_the_robot_and_close(program, tmp_path):
    # Not its viewer, whose OpenGL would be that of all pictures to come in this process.
    pytest.importorskip({HUMAN: "gymnasium", VIEWER: "dm_control", REPLAY: "mujoco"}[program])
    command = ["xvfb-run", "-a", sys.executable, "-c", program]
    ours = {name: value for name, value in os.environ.items() if name not in ("MUJOCO_GL", "PYOPENGL_PLATFORM")}
    done = subprocess.run(command, env=ours, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)
    assert (done.returncode, done.stdout.split()[-1:]) == (0, ["shown"]), done.stderr[-2000:]
