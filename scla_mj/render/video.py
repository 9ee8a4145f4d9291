"""Frames into a file: .mp4 through ffmpeg or the library av, .gif and .png through Pillow."""

from __future__ import annotations

import contextlib
import itertools
import shutil
import subprocess
from collections.abc import Iterable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from scla_mj.errors import SclaError
from scla_mj.extras import need

KINDS: Final = (".mp4", ".gif", ".png")
_QUALITY: Final = "20"
"""x264's constant rate factor: a good picture, some 0.5 MB for 20 s."""
_GIF_COLOURS: Final = 128


def require_encoder(file: Path) -> None:
    """Refuse a file that could not be written, before anything is drawn.

    Raises:
        SclaError: the format is none of ours, or nothing here can encode it.
    """
    if file.suffix.lower() not in KINDS:
        raise SclaError(
            f"{file} must end in {', '.join(KINDS[:-1])} or {KINDS[-1]}: its name says which format is wanted"
        )
    if file.suffix.lower() == ".mp4" and shutil.which("ffmpeg") is None:
        need("av", f"{file.name}, without ffmpeg on the path,")


def write_frames(file: Path, kind: str, frames: Iterable[NDArray[np.uint8]], *, fps: int) -> None:
    """Write frames, (height, width, 3) each, at least one; into a .png the only one.

    Raises:
        SclaError: the encoder fails.
    """
    if kind == ".mp4":
        encode = _ffmpeg if shutil.which("ffmpeg") else _av
        encode(file, iter(frames), fps)
        return
    pictures = map(Image.fromarray, frames)
    first = next(pictures)
    if kind == ".png":
        first.save(file, format="PNG", optimize=True)
        return
    first = first.quantize(_GIF_COLOURS, dither=Image.Dither.NONE)
    rest = [
        picture.quantize(palette=first, dither=Image.Dither.NONE) for picture in pictures
    ]  # or still things flicker
    ends = np.round(np.arange(len(rest) + 2) * 100 / fps)  # a GIF counts hundredths of a second
    more = {"save_all": True, "append_images": rest, "loop": 0}
    first.save(file, format="GIF", duration=(10 * np.diff(ends)).tolist(), optimize=False, **more)


def _ffmpeg(file: Path, frames: Iterator[NDArray[np.uint8]], fps: int) -> None:
    first = next(frames)
    height, width, _ = first.shape
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(fps), "-i", "-"]
    encoded = ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", _QUALITY, "-movflags", "+faststart", "-f", "mp4"]
    command = ["ffmpeg", "-y", "-loglevel", "error", *raw, *encoded, str(file)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # it says why
            for frame in itertools.chain([first], frames):
                process.stdin.write(frame.tobytes())
        _, complaint = process.communicate()
    if process.returncode:
        last = (complaint.decode(errors="replace").splitlines() or ["without a word"])[-1]
        raise SclaError(f"ffmpeg cannot write the video: {last}")


def _av(file: Path, frames: Iterator[NDArray[np.uint8]], fps: int) -> None:
    import av

    first = next(frames)
    with av.open(str(file), "w", format="mp4", options={"movflags": "+faststart"}) as container:
        stream: Any = container.add_stream("libx264", rate=Fraction(fps), options={"crf": _QUALITY})
        stream.pix_fmt, (stream.height, stream.width, _) = "yuv420p", first.shape
        for frame in itertools.chain([first], frames):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="rgb24")))
        container.mux(stream.encode())
