"""A state that is handed back: one that is not of its owner's kind is refused, and then nothing is changed."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Collection
from typing import Any

import numpy as np

from scla_mj.errors import SclaError
from scla_mj.validation import shown


def restore_whole(
    state: Any, own: dict[str, Any], put: Callable[[Any], None], *, name: str, free: Collection[str] = ()
) -> None:
    """Call `put(state)`; if the state does not fit, everything is as before.

    Args:
        state: what to restore.
        own: the owner's state now, which shows how one looks.
        put: restores a state.
        name: how a sentence names the state.
        free: names of what may be of any kind, or of arrays that may be longer or shorter than the owner's.

    Raises:
        SclaError: it lacks something, or holds what does not belong there.
    """
    _check(state, own, name, free)
    try:
        put(state)
    except Exception as error:
        with contextlib.suppress(Exception):  # of a brain that cannot be restored at all
            put(own)
        if isinstance(error, SclaError):
            raise
        message = " ".join(str(error).split())
        raise SclaError(f"{name} cannot be restored: {type(error).__name__}: {message}") from error


def _check(found: Any, own: Any, name: str, free: Collection[str]) -> None:
    part = name.rpartition(".")[2]
    if own is None or (part in free and not isinstance(own, np.ndarray)):
        return
    if isinstance(own, dict) and isinstance(found, dict) and found.keys() == own.keys():
        for key, value in own.items():
            _check(found[key], value, f"{name}.{key}", free)
        return
    if isinstance(own, dict):
        raise SclaError(f"{name} is {shown(found)}: it must be a dict of {', '.join(own)}, as state() returns it")
    if isinstance(own, np.ndarray):
        _check_array(found, own, name, part in free)
    elif type(found) is not type(own) or _is_odd(found):
        wanted = "a list" if isinstance(own, list) else f"{type(own).__name__} such as {shown(own)}"
        raise SclaError(f"{name} is {shown(found)}: it must be {wanted}, as state() returns it")


def _is_odd(number: Any) -> bool:
    return (isinstance(number, int) and number < 0) or (isinstance(number, float) and not math.isfinite(number))


def _check_array(found: Any, own: np.ndarray[Any, Any], name: str, free: bool) -> None:
    if not isinstance(found, np.ndarray) or found.dtype != own.dtype or found.shape[free:] != own.shape[free:]:
        kind = f"{found.dtype} {found.shape}" if isinstance(found, np.ndarray) else shown(found)
        raise SclaError(f"{name} is {kind}: it must be an array of {own.dtype} {own.shape}, as state() returns it")
    if not np.isfinite(found).all():
        raise SclaError(f"{name} holds what is not a number: every value must be finite")
