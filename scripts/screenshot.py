"""Take a picture of a run's recording as the Rerun viewer shows it, on a machine without a screen.

Needs a Vulkan driver; without a graphics card a software one does (Debian: mesa-vulkan-drivers libvulkan1). The light
theme needs Xvfb too (Debian: xvfb): without a window the viewer has its dark theme only.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import rerun
import tyro

from scla_mj.errors import SclaError
from scla_mj.paths import RECORDING_RRD
from scla_mj.telemetry import names

_START_S: Final = 60.0
"""Longest that the viewer may take to start and to load the recording."""
_DRAW_S: Final = 120.0
"""Longest that it may take to draw: a software renderer is slow."""
_END_S: Final = 2.0
"""How long a program may take to end by itself."""
_MENU_PX: Final = 36
"""Height of the viewer's menu bar at scale 1."""

Theme = Literal["dark", "light"]


@dataclass(frozen=True)
class Screenshot:
    """Take a picture of a run's recording."""

    run: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """A run folder, or a .rrd file."""
    output: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="PNG")]
    """The picture to write."""
    sim_time_s: float | None = None
    """Where the time cursor stands; the run's middle if neither this nor --decision is given."""
    decision: int | None = None
    """The decision where it stands, on the timeline that counts decisions."""
    tab: str = "Now"
    """The dashboard's tab."""
    theme: Theme = "dark"
    """The viewer's theme."""
    size: tuple[int, int] = (1800, 1050)
    """Width and height of the window."""
    menu: bool = False
    """Keep the viewer's menu bar, which warns of software renderers."""


def take(options: Screenshot) -> None:
    """Start a viewer without a screen, show the recording, and write the picture once it no longer changes.

    Raises:
        SclaError: the recording is unreadable or has no such moment or tab, no viewer, Vulkan driver or virtual display
            is there, or a view reports an error.
    """
    recording = options.run / RECORDING_RRD if options.run.is_dir() else options.run
    timeline, moment = _moment(options, recording)
    with open_viewer(recording, options.size, options.theme) as viewer:
        _show_tab(viewer, options.tab)
        viewer.set_time(timeline, **moment, play_state="paused")
        picture = _settled_picture(viewer, max(options.size))
        reports = [report for view in viewer.get_state().views for report in view.reports]
    if reports:
        raise SclaError(f"a view of the recording reports: {reports[0]}")
    options.output.write_bytes(picture if options.menu else _without_menu(picture))


def _moment(options: Screenshot, recording: Path) -> tuple[str, dict[str, Any]]:
    """Return the timeline and the place on it."""
    from scla_mj.telemetry.reading.reader import inspect_recording

    seen = inspect_recording(recording)
    if options.decision is not None:
        if options.sim_time_s is not None:
            raise SclaError("--decision and --sim-time-s are two moments: give one of them")
        if not 0 <= options.decision <= seen.decisions:
            raise SclaError(f"--decision is {options.decision}: the recording has 0 to {seen.decisions}")
        return names.DECISION, {"sequence": options.decision}
    when_s = seen.simulated_s / 2 if options.sim_time_s is None else options.sim_time_s
    if not 0.0 <= when_s <= seen.simulated_s:
        raise SclaError(f"--sim-time-s is {when_s:g}: the recording has 0 to {seen.simulated_s:.2f} s")
    return names.SIM_TIME, {"duration": when_s}


def _show_tab(viewer: Any, tab: str) -> None:
    """Bring a tab to the front, in the blueprint that the viewer shows."""
    blueprint = viewer.get_blueprint("recording").blueprint
    containers = {path.strip("/"): parts.get("ContainerBlueprint", {}) for path, parts in blueprint.items()}
    root = containers[f"container/{blueprint['/viewport']['ViewportBlueprint']['root_container']}"]
    tabs = {containers.get(place, {}).get("display_name"): place for place in root["contents"]}
    if tab not in tabs:
        raise SclaError(f"--tab is {tab!r}: the recording has {', '.join(name for name in tabs if name)}")
    if root.get("active_tab") != tabs[tab]:
        root["active_tab"] = tabs[tab]
        viewer.set_blueprint(blueprint, "recording")


@contextlib.contextmanager
def open_viewer(recording: Path, size: tuple[int, int], theme: Theme = "dark") -> Iterator[Any]:
    """Run the viewer that came with rerun-sdk on loopback, until the recording's views are there."""
    port = _free_port()
    command = [
        sys.executable, "-m", "rerun", "--window-size", f"{size[0]}x{size[1]}", "--hide-welcome-screen",
        "--bind", "127.0.0.1", "--port", str(port), str(recording.resolve()),
    ]  # fmt: skip
    with contextlib.ExitStack() as stack:
        home = stack.enter_context(tempfile.TemporaryDirectory())
        environment = os.environ | {"XDG_RUNTIME_DIR": home, "XDG_DATA_HOME": home}
        if theme == "light":
            _prefer_light(Path(home))
            environment["DISPLAY"] = stack.enter_context(_virtual_display(size))
        else:
            command.append("--headless")
        yield _connected(stack.enter_context(_group_of(command, environment)), port)


def _prefer_light(data_home: Path) -> None:
    """Store theme, and no notices, where a viewer with a window finds its settings; they must be of its version."""
    settings = {
        "rerun.version": rerun.__version__,
        "egui": "(options:(theme_preference:Light))",
        "app": "(app_options:(show_notification_toasts:false))",
    }
    file = data_home / "rerun" / "app.ron"
    file.parent.mkdir()
    file.write_text(json.dumps(settings))


@contextlib.contextmanager
def _virtual_display(size: tuple[int, int]) -> Iterator[str]:
    """Run an X server without a screen, and give its address.

    It is twice as wide: the pointer starts in the middle, where it would hover over a view.
    """
    if shutil.which("Xvfb") is None:
        raise SclaError("the light theme needs a virtual display: Xvfb is not installed (Debian: apt-get install xvfb)")
    reading, writing = os.pipe()
    screen = f"{2 * size[0] + 2}x{size[1]}x24"
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", screen, "-nolisten", "tcp"]
    with os.fdopen(reading) as told, _group_of(command, dict(os.environ), pass_fds=(writing,)):
        os.close(writing)
        yield f":{told.readline().strip()}"


@contextlib.contextmanager
def _group_of(
    command: list[str], environment: dict[str, str], pass_fds: tuple[int, ...] = ()
) -> Iterator[subprocess.Popen[bytes]]:
    """Run a command in a session of its own, and end all of it: what it started too, and if it ended itself too."""
    process = subprocess.Popen(
        command,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=environment,
        start_new_session=True,
        pass_fds=pass_fds,
    )
    try:
        yield process
    finally:
        for number in (signal.SIGTERM, signal.SIGKILL):  # none may outlive its parent
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, number)
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(_END_S)


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
