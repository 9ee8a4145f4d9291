"""Make the pictures of README and docs again, all from one run: `python scripts/pictures.py`.

Needs what `scla-mj render` and scripts/screenshot.py need: OpenGL without a display, and a Vulkan driver.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, Literal, get_args

import tyro

from scla_mj.errors import SclaError

ROOT: Final = Path(__file__).resolve().parents[1]
Name = Literal[
    "arena.png", "clip.gif", "dashboard.png", "dashboard-learning.png", "dashboard-brain.png", "learning.png"
]
_RUN: Final = ("rollout", "{run}", "--epochs", "3", "--seed", "0")
_COMMANDS: Final[dict[Name, tuple[str, ...]]] = {
    "arena.png": ("render", "{run}", "{file}", "--from", "411", "--to", "422", "--size", "1200", "800", "--no-overlay"),
    "clip.gif": ("render", "{run}", "{file}", "--from", "411", "--to", "430", "--size", "400", "300", "--fps", "10"),
    "dashboard.png": ("{run}", "{file}", "--sim-time-s", "400"),
    "dashboard-learning.png": ("{run}", "{file}", "--decision", "400", "--tab", "Learning"),
    "dashboard-brain.png": ("{run}", "{file}", "--decision", "400", "--tab", "Brain", "--theme", "light"),
    "learning.png": ("figures", "{run}", "--out", "{folder}", "--formats", "png"),
}
"""Words of `scla-mj`, or of scripts/screenshot.py for the dashboard."""


@dataclass(frozen=True)
class Pictures:
    """Make the pictures of README and docs again."""

    names: Annotated[tuple[Name, ...], tyro.conf.Positional] = get_args(Name)
    """Which; all of them if none is named."""
    folder: Path = ROOT / "docs/pictures"
    """Where they go; those that are there are replaced."""


def make(options: Pictures) -> list[Path]:
    """Run the robot, make the pictures of its run, and move them into place once all are made.

    Raises:
        SclaError: a command failed; it has said why.
    """
    with tempfile.TemporaryDirectory() as scratch:
        places = {"run": f"{scratch}/run", "folder": f"{scratch}/figures"}
        _call(_RUN, places)
        made = {}
        for name in options.names:
            file = Path(scratch, "figures" if name == "learning.png" else "", name)
            _call(_COMMANDS[name], {**places, "file": str(file)})
            made[name] = file.read_bytes()
    options.folder.mkdir(parents=True, exist_ok=True)
    for name, content in made.items():
        (options.folder / name).write_bytes(content)
    return [options.folder / name for name in made]


def _call(words: tuple[str, ...], places: dict[str, str]) -> None:
    program = ["-m", "scla_mj"] if words[0] != "{run}" else [str(ROOT / "scripts/screenshot.py")]
    done = subprocess.run([sys.executable, *program, *(word.format(**places) for word in words)], check=False)
    if done.returncode:
        raise SclaError(f"scla-mj {' '.join(words)} ended with exit code {done.returncode}")


if __name__ == "__main__":
    try:
        for picture in make(tyro.cli(Pictures)):
            print(f"Written:  {picture}")
    except SclaError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
