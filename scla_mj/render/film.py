"""A stretch of a stored run as a video, an animation or a picture."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.engine.stored_run import StoredRun
from scla_mj.errors import SclaError
from scla_mj.grid import Grid
from scla_mj.palette import HIT_COLOUR, OUTCOME_COLOURS, RGB, TRAIL_HEIGHT_M, TRAIL_S
from scla_mj.render.overlay import WINDOWS, Overlay
from scla_mj.render.poses import Poses, stored_poses
from scla_mj.render.video import require_encoder, write_frames
from scla_mj.runs.atomic import replacing, writing
from scla_mj.signals import Outcome
from scla_mj.world.arena import compose, place_targets
from scla_mj.world.picture import Scene
from scla_mj.world.robot import robot_of

_SHADOW_PIXELS: Final = 1024
"""MuJoCo's 4096 cost twice the time, and no one sees them in a video."""
SHOWN_BY_DEFAULT: Final = 20
"""Decisions, each about a second."""


class Film(NamedTuple):
    """How a run is shown; the frames are `size` pixels wide and high, `speed` is simulated seconds per second."""

    camera: str
    size: tuple[int, int] = (640, 480)
    fps: int = 30
    speed: float = 1.0
    overlay: bool = True
    draft: bool = False


def span_of(run: StoredRun, first: int | None, last: int | None, epoch: int | None) -> range:
    """Return the decisions to show, counted over the run from 1: of an epoch, or from a first to a last one.

    Raises:
        SclaError: the run has not made them.
    """
    made, length = run.decisions.num_rows, run.config.decisions
    if not made:
        raise SclaError(f"{run.path} has made no decision yet")
    if epoch is not None and first is not None:
        raise SclaError("--epoch and --from are both given: leave one out")
    for option, given, most, what in (
        ("--epoch", epoch, -(-made // length), "epochs"),
        ("--from", first, made, "decisions"),
        ("--to", last, made, "decisions"),
    ):
        if given is not None and not 1 <= given <= most:
            raise SclaError(f"{option} is {given}: {run.path} has made {what} 1 to {most}")
    start = (first or 1) if epoch is None else (epoch - 1) * length + 1
    stop = min(start + SHOWN_BY_DEFAULT - 1, made) if last is None else last
    if stop < start:
        raise SclaError(
            f"--to {last} is before decision {start}, the first to show: give a later one, or an earlier --from"
        )
    return range(start, stop + 1)


def make_film(
    run: StoredRun, decisions: range, file: Path, film: Film, *, overwrite: bool, show: Callable[[int, int], None]
) -> int:
    """Write a film of some decisions, call `show` with the frames so far and all of them, and return their number.

    Raises:
        SclaError: the file is there and not to be overwritten, nothing here can draw or encode it, or the run is
            damaged.
    """
    require_encoder(file)
    taken = "" if overwrite else f"{file} is there already: choose another name, or --overwrite"
    if file.exists() and not overwrite:
        raise SclaError(taken)
    with writing(file, folder="FILE"):
        tempfile.TemporaryFile(dir=file.parent).close()  # before minutes of drawing
    model = drawn_model(run)
    known = _with_history(run, decisions)
    poses, spikes = stored_poses(run, known, model)
    last = int(poses.decision[-1])
    if last < decisions.stop - 1 and not run.is_complete:
        raise SclaError(f"{run.path} is unfinished and its recording ends with decision {last}: give --to {last}")
    frames = Frames(run, known, poses, film, model)
    overlay = Overlay(run, known, spikes, film.size) if film.overlay else None
    times_s = frame_times(run, decisions, poses, film)
    if file.suffix.lower() == ".png":
        times_s = times_s[-1:]

    def drawn() -> Iterator[NDArray[np.uint8]]:
        for count, time_s in enumerate(times_s.tolist(), 1):
            frame = frames.draw(time_s)
            yield frame if overlay is None else overlay.draw(frame, time_s)
            show(count, len(times_s))

    try:
        with replacing(file, taken=taken, folder="FILE") as scratch:
            write_frames(scratch, file.suffix.lower(), drawn(), fps=film.fps)
    finally:
        frames.close()
    return len(times_s)


def _with_history(run: StoredRun, decisions: range) -> range:
    """Return some decisions with those before that the trail and the raster of the first frame have to show."""
    times_s = run.decisions["time_s"].to_numpy()
    trail = int(np.searchsorted(times_s, times_s[decisions.start - 1] - TRAIL_S, side="right"))
    return range(max(1, min(trail, decisions.start - WINDOWS)), decisions.stop)


def drawn_model(run: StoredRun) -> Any:
    """Return the compiled model of a run's arena and robot, with all that is for looks."""
    return compose(run.checked.grid(), run.checked.clock, robot_of(run.checked)).compile()


def frame_times(run: StoredRun, decisions: range, poses: Poses, film: Film) -> NDArray[np.float64]:
    """Return the run's times at which frames are drawn: from the start of the first decision to the last one's end."""
    start_s, end_s = float(run.decisions["time_s"][decisions.start - 1].as_py()), float(poses.time_s[-1])
    step_s = film.speed / film.fps
    times_s = start_s + step_s * np.arange(int((end_s - start_s) / step_s) + 1)
    return np.append(times_s, end_s).astype(np.float64)  # at last where the last decision ended


def grid_at(run: StoredRun, poses: Poses, time_s: float) -> Grid:
    """Return the arena at a time of a run, with the targets where they are then."""
    decision = int(poses.decision[max(0, poses.made(time_s) - 1)])
    return run.checked.grid((decision - 1) // run.config.decisions + 1)


class Frames:
    """Draws a run at its times, with the trail of the last seconds in the colours of how the moves ended.

    Raises:
        SclaError: there is no OpenGL here.
    """

    def __init__(self, run: StoredRun, decisions: range, poses: Poses, film: Film, model: Any) -> None:
        model.vis.quality.shadowsize = _SHADOW_PIXELS
        self._run, self._poses, self._film, self._jumps = run, poses, film, poses.jumps
        self._scene = Scene(model, draft=film.draft)
        rows = run.decisions.slice(decisions.start - 1, len(decisions))
        outcomes = zip(rows["outcome"].to_pylist(), rows["hit"].to_pylist(), strict=True)
        self._colours: list[RGB] = [HIT_COLOUR if hit else OUTCOME_COLOURS[Outcome(how)] for how, hit in outcomes]
        self._first = decisions.start

    def draw(self, time_s: float) -> NDArray[np.uint8]:
        """Return the frame of one time."""
        film = self._film
        place_targets(self._scene.model, grid_at(self._run, self._poses, time_s))
        self._scene.data.qpos[:] = self._poses.at(time_s)
        return self._scene.draw(film.camera, *film.size, self._trail(time_s))

    def _trail(self, time_s: float) -> Iterator[tuple[NDArray[np.float64], RGB]]:
        poses = self._poses
        begin, made = np.searchsorted(poses.time_s, time_s - TRAIL_S), poses.made(time_s)
        points = poses.qpos[begin:made, :3].copy()
        points[:, 2] = TRAIL_HEIGHT_M
        for number in range(len(points) - 1):
            if not self._jumps[begin + number]:
                yield points[number : number + 2], self._colours[int(poses.decision[begin + number]) - self._first]

    def close(self) -> None:
        """Free what was drawn with."""
        self._scene.free()
