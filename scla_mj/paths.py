"""Where files live: the MJCF assets that ship with the package, and the names inside a run folder."""

import re
from pathlib import Path
from typing import Final

from scla_mj.errors import SclaError

SCENE_XML: Final = "scene.xml"

CONFIG_JSON: Final = "config.json"
DECISIONS_PARQUET: Final = "decisions.parquet"
DECISIONS_PARTIAL: Final = "decisions.partial.arrows"
SUMMARY_JSON: Final = "summary.json"
BRAIN_NPZ: Final = "brain.npz"
CHECKPOINT_NPZ: Final = "checkpoint.npz"
LEARNING_PNG: Final = "learning.png"
WEIGHTS_PNG: Final = "weights.png"
POLICY_PNG: Final = "policy.png"
FIGURES: Final = (LEARNING_PNG, WEIGHTS_PNG, POLICY_PNG)
RECORDING_RRD: Final = "recording.rrd"
SEAL_JSON: Final = "seal.json"
LOCK: Final = ".lock"
WATCHED: Final = ".watched"
"""Touched by a viewer that follows the run."""

_SHIPPED_PATTERN: Final = re.compile(r"[a-z]+")
_PART_PATTERN: Final = re.compile(r"recording(?:-([1-9]\d*))?\.rrd")


def recording_part(number: int) -> str:
    """Return the name of a recording's part: the first is `recording.rrd`, a resumed run adds `recording-2.rrd`."""
    return RECORDING_RRD if number == 1 else f"recording-{number}.rrd"


def part_number(name: str) -> int | None:
    """Return which part of a recording a file of this name is, or None if it is none."""
    found = _PART_PATTERN.fullmatch(name)
    return int(found[1] or 1) if found and found[1] != "1" else None


def recordings(folder: Path) -> list[Path]:
    """Return a run's recording: its parts in their order, none if nothing was recorded."""
    parts = {number: path for path in folder.iterdir() if (number := part_number(path.name)) is not None}
    return [parts[number] for number in sorted(parts)]


def assets_folder() -> Path:
    """Return the folder that holds the MJCF files, in an installed wheel or in a checkout.

    Raises:
        SclaError: neither place holds the arena's file.
    """
    package = Path(__file__).resolve().parent
    candidates = (package / "assets", package.parent / "assets")
    for folder in candidates:
        if (folder / SCENE_XML).is_file():
            return folder
    raise SclaError(
        f"the arena's file {SCENE_XML} is in neither {candidates[0]} nor {candidates[1]}; reinstall scla-mj"
    )


def shipped_file(name: str, suffix: str) -> Path:
    """Return a robot's or a floor's file: one that ships with the package, by its name, or a path."""
    shipped = assets_folder() / f"{name}{suffix}"
    return shipped if _SHIPPED_PATTERN.fullmatch(name) and shipped.is_file() else Path(name).expanduser()
