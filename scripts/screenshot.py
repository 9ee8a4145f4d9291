"""Take a picture of a run's recording as the Rerun viewer shows it, on a machine without a screen.

Needs a Vulkan driver; without a graphics card a software one does (Debian: mesa-vulkan-drivers libvulkan1).
"""

from __future__ import annotations

import contextlib
import io
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import tyro

from scla_mj.errors import SclaError
from scla_mj.paths import RECORDING_RRD
from scla_mj.telemetry import names

_START_S: Final = 60.0
"""Longest that the viewer may take to start and to load the recording."""
_DRAW_S: Final = 120.0
"""Longest that it may take to draw: a software renderer is slow."""
_MENU_PX: Final = 36
"""Height of the viewer's menu bar at scale 1."""


@dataclass(frozen=True)
class Screenshot:
    """Take a picture of a run's recording."""

    run: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """A run folder, or a .rrd file."""
    output: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="PNG")]
    """The picture to write."""
    sim_time_s: float | None = None
    """Where the time cursor stands; the run's middle if not given."""
    size: tuple[int, int] = (1800, 1050)
    """Width and height of the window."""
    menu: bool = False
    """Keep the viewer's menu bar, which warns of software renderers."""


def take(options: Screenshot) -> None:
    """Start a viewer without a window, show the recording, and write the picture once it no longer changes.

    Raises:
        SclaError: the recording is unreadable or has no such time, no viewer or Vulkan driver is there, or a view
            reports an error.
    """
    from scla_mj.telemetry.reading.reader import inspect_recording

    recording = options.run / RECORDING_RRD if options.run.is_dir() else options.run
    seen = inspect_recording(recording)
    when_s = seen.simulated_s / 2 if options.sim_time_s is None else options.sim_time_s
    if not 0.0 <= when_s <= seen.simulated_s:
        raise SclaError(f"--sim-time-s is {when_s:g}: the recording has 0 to {seen.simulated_s:.2f} s")
    with _viewer(recording, options.size) as viewer:
        viewer.set_time(names.SIM_TIME, duration=when_s, play_state="paused")
        picture = _settled_picture(viewer, max(options.size))
        reports = [report for view in viewer.get_state().views for report in view.reports]
    if reports:
        raise SclaError(f"a view of the recording reports: {reports[0]}")
    options.output.write_bytes(picture if options.menu else _without_menu(picture))


@contextlib.contextmanager
def _viewer(recording: Path, size: tuple[int, int]) -> Iterator[Any]:
    """Run the viewer that came with rerun-sdk on loopback, until the recording's views are there."""
    port = _free_port()
    command = [
        sys.executable, "-m", "rerun", "--headless", "--window-size", f"{size[0]}x{size[1]}", "--hide-welcome-screen",
        "--bind", "127.0.0.1", "--port", str(port), str(recording.resolve()),
    ]  # fmt: skip
    environment = {"XDG_RUNTIME_DIR": "/tmp"} | os.environ
    with _group_of(command, environment) as process:
        yield _connected(process, port)


@contextlib.contextmanager
def _group_of(command: list[str], environment: dict[str, str]) -> Iterator[subprocess.Popen[bytes]]:
    """Run a command in a session of its own, and end all of it: what it started too, and if it ended itself too."""
    process = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment, start_new_session=True
    )
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)  # it holds nothing to save, and must not outlive its parent
        process.wait()


def _connected(process: subprocess.Popen[bytes], port: int) -> Any:
    from rerun.experimental import ViewerClient

    deadline = time.monotonic() + _START_S
    while time.monotonic() < deadline:
        if process.poll() is not None:
            break
        with contextlib.suppress(Exception):  # not listening yet
            viewer = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
            if viewer.get_state().views:
                return viewer
        time.sleep(0.5)
    raise SclaError(
        "the Rerun viewer did not start: it needs a Vulkan driver, where there is no graphics card a software one "
        "(Debian: apt-get install mesa-vulkan-drivers libvulkan1)"
    )


def _settled_picture(viewer: Any, max_size: int) -> bytes:
    """Return the picture once two in a row are the same: views load as they are shown."""
    deadline, last = time.monotonic() + _DRAW_S, b""
    while time.monotonic() < deadline:
        picture: bytes = viewer.take_screenshot(max_size=max_size)
        if picture == last:
            return picture
        last = picture
        time.sleep(1.0)
    return last


def _without_menu(picture: bytes) -> bytes:
    from matplotlib import image

    out = io.BytesIO()
    image.imsave(out, image.imread(io.BytesIO(picture), format="png")[_MENU_PX:], format="png")
    return out.getvalue()


def _free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return int(listener.getsockname()[1])


def main() -> int:
    """Return 2, with one sentence, where the user can put something right."""
    try:
        take(tyro.cli(Screenshot, description=__doc__))
    except SclaError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
