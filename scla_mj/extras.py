"""Libraries that a plain installation lacks: an extra of pyproject.toml brings each, and refusals show the line."""

import importlib
import sys
from types import ModuleType
from typing import Final

from scla_mj.errors import SclaError

EXTRA_OF: Final = {
    "av": "video",
    "distributed": "sweep",
    "dm_control": "dm",
    "gymnasium": "gym",
    "mujoco_warp": "warp",
    "pandas": "analysis",
    "pynwb": "export",
    "stable_baselines3": "sb3",
    "xarray": "analysis",
}
"""By the name that is imported."""
_BESIDE_LABMAZE: Final = {"dm": "pip install --no-deps dm-control==1.0.50"}
"""dm_control requires labmaze, which it needs for mazes only, and which has no wheels from Python 3.13 on."""


def need(library: str, what: str) -> ModuleType:
    """Import and return a library of an extra, which `what` needs.

    Raises:
        SclaError: it cannot be imported; the sentence names the command that installs it.
    """
    extra = EXTRA_OF[library]
    try:
        return importlib.import_module(library)
    except ImportError as error:
        why = f"{what} needs {library}, which cannot be imported ({error})"
        raise SclaError(f"{why}: run {install_line(extra)}") from error


def install_line(extra: str) -> str:
    """Return the command that installs an extra on this Python."""
    line = f"pip install 'scla-mj[{extra}]'"
    return f"{line} && {_BESIDE_LABMAZE[extra]}" if extra in _BESIDE_LABMAZE and sys.version_info >= (3, 13) else line
