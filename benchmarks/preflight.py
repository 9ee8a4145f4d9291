"""Whether what a bench is to write can be written, asked before minutes are spent on measuring it."""

from __future__ import annotations

import ctypes
import importlib
import logging
import os
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path

from benchmarks.table import require_places
from scla_mj.anatomy import NEURON_COUNT
from scla_mj.checked import is_papers
from scla_mj.config import RunConfig
from scla_mj.errors import SclaError
from scla_mj.extras import need


def require_gpu(option: str) -> None:
    """Refuse to go on without a GPU.

    Raises:
        SclaError: mujoco_warp is not installed or not of MuJoCo's version, or there is no CUDA device.
    """
    need("mujoco_warp", option)
    ours, its = (metadata.version(name).rpartition(".")[0] for name in ("mujoco", "mujoco-warp"))
    if its != ours:
        raise SclaError(f"{option} needs mujoco-warp of MuJoCo's own version: run pip install 'mujoco-warp=={ours}.*'")
    try:
        ctypes.CDLL("nvcuda.dll" if os.name == "nt" else "libcuda.so.1")  # without it Warp would say so in its own way
        warp = importlib.import_module("warp")
        warp.config.log_level = logging.WARNING  # a line for each module that it compiles
        found = warp.is_cuda_available()
    except OSError:
        found = False
    if not found:
        raise SclaError(f"{option} needs an NVIDIA GPU and its driver: there is no CUDA device here")


def require_printed(option: str, config: RunConfig) -> None:
    """Refuse a network that is not the printed one in its size and number format.

    Raises:
        SclaError: the configuration has another.
    """
    network = config.network
    printed = network.precision == "float32" and network.neurons == NEURON_COUNT and network.runs_while_driving
    if not (printed and is_papers(network, config.plasticity)):
        raise SclaError(f"{option} has the printed network alone: of --network, give weights, drive and noise only")


def require_new_file(option: str, file: Path) -> None:
    """Refuse a file that exists or whose folder cannot take it.

    Raises:
        SclaError: `option`, by which the file was named, cannot be written.
    """
    if file == Path():
        raise SclaError(f"{option} is empty or the folder .: name a file")
    if file.exists():
        raise SclaError(f"{file} exists already: choose another file")
    if not file.parent.is_dir():
        raise SclaError(f"{option} {file} cannot be written: {file.parent} is not a folder; make it first")
    _require_writable(option, file.parent)


def require_folder(option: str, folder: Path) -> None:
    """Refuse a folder that cannot be written to, or made where it is wanted.

    Raises:
        SclaError: it is a file, lies below one, or may not be written to.
    """
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not there.is_dir():
        raise SclaError(f"{option} {folder}: {there} is a file: choose a folder")
    _require_writable(option, there)


def require_page(option: str, page: Path, keys: Sequence[str]) -> None:
    """Refuse a page that cannot take the tables of these keys.

    Raises:
        SclaError: it is no text file that may be written, or has no place for one of the tables.
    """
    if not page.is_file():
        raise SclaError(
            f"{option} is empty: name a Markdown page"
            if page == Path()
            else f"{option} {page} is not a file: name a Markdown page"
        )
    _require_writable(option, page)
    try:
        require_places(page.read_text(encoding="utf-8"), keys)
    except UnicodeDecodeError:
        raise SclaError(f"{option} {page} is no text in UTF-8: name a Markdown page") from None
    except SclaError as error:
        raise SclaError(f"{option} {page}: {error}") from None


def _require_writable(option: str, place: Path) -> None:
    if not os.access(place, os.W_OK):
        raise SclaError(f"{option}: {place} may not be written to: choose another place")
