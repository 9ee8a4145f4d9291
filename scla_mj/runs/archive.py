"""Numpy arrays as members of a zip file, whose bytes depend on the arrays alone; nothing is pickled."""

from __future__ import annotations

import zipfile
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

_ZIP_EPOCH: Final = (1980, 1, 1, 0, 0, 0)
_UNIX: Final = 3


def member(name: str) -> zipfile.ZipInfo:
    """Return a member's header under a fixed date and system."""
    info = zipfile.ZipInfo(name, date_time=_ZIP_EPOCH)
    info.create_system = _UNIX
    return info


def add_array(archive: zipfile.ZipFile, name: str, array: NDArray[Any]) -> None:
    """Add an array as `name`.npy, in C order."""
    with archive.open(member(f"{name}.npy"), "w", force_zip64=True) as stream:
        np.lib.format.write_array(stream, np.asarray(array, order="C"), allow_pickle=False)
