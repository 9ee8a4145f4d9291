"""numba with a cache of compiled code where one can be kept, and without one where nothing is writable."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit


def cached_njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return `numba.njit(cache=True, **options)`, or the same without a cache where there is no place for one.

    numba keeps compiled code beside the source, or in the user's cache folder where the package is read-only, or where
    NUMBA_CACHE_DIR says. Where none of them can be written it would refuse the function; this compiles it in every
    process instead, some seconds each time.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        try:
            return njit(cache=True, **options)(function)
        except RuntimeError:  # "cannot cache function ...: no locator available"
            return njit(**options)(function)

    return decorate
