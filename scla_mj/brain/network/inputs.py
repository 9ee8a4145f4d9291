"""What a caller hands to the network, made into arrays of the kernel's own type or refused in a sentence.

numba compiles once per type of array, 20 s each: a read-only array, or another number format, would be another type.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scla_mj.errors import SclaError
from scla_mj.validation import shown

MOST_STEPS: Final = 2**31 - 1
"""Steps of one window: the steps of its spikes are 32-bit numbers."""
MOST_CURRENT: Final = 1e6
MOST_DOPAMINE: Final = 1000.0
"""A hundred times the largest release of a run: what eligibility times dopamine makes of it still fits into float32."""


def count(name: str, value: int, *, most: int = MOST_STEPS) -> int:
    """Return a whole number from 0 to `most`."""
    if (type(value) is not int and not isinstance(value, np.integer)) or not 0 <= value <= most:
        raise SclaError(f"{name} is {shown(value)}: it must be a whole number, 0 to {most}")
    return int(value)


def fill(name: str, array: NDArray[Any], values: ArrayLike) -> NDArray[Any]:
    """Write `values` into an array of ours; return that array."""
    if type(values) is np.ndarray and values.dtype == array.dtype and values.shape == array.shape:
        array[:] = values
        return array
    with np.errstate(over="ignore"):  # the caller refuses the infinity that becomes of it
        array[:] = _numbers(name, values, array.shape)
    return array


def current(drive: NDArray[Any]) -> NDArray[Any]:
    """Return the currents unless one is not a number, or so large that the network would not recover from it."""
    if not np.vdot(drive, drive) <= len(drive) * MOST_CURRENT**2:  # of an overflow `dot` would warn
        raise SclaError(
            f"drive goes from {drive.min():g} to {drive.max():g}: every current must be a number within 1e6"
        )
    return drive


def _numbers(name: str, values: ArrayLike, wanted: tuple[int, ...]) -> NDArray[Any]:
    try:
        array = np.asarray(values)
    except Exception as error:  # ragged, or whatever an object of the caller's raises
        raise SclaError(f"{name} is {shown(values)}: it must be an array of numbers, {wanted}") from error
    if array.dtype.kind not in "iuf" or np.ma.is_masked(values):
        kind = "masked" if np.ma.is_masked(values) else array.dtype
        raise SclaError(f"{name} is an array of {kind} values: it must be one of integers or floats, {wanted}")
    if array.shape != wanted:
        raise SclaError(f"{name} has the shape {array.shape}: it must be {wanted}")
    return array
