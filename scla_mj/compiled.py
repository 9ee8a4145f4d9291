"""numba for loops over arrays that they are given, with a cache of compiled code where one can be kept."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from numba import njit

_BORROWING: Final = {"_nrt": False}
"""Arrays belong to the caller: counting references to every view of one would take most of a spike's time."""


_UNWRAPPED: Final = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""A way in from Python takes longer to compile than most of the functions."""


def leaf_njit(*, from_python: bool = False, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return `numba.njit` for a part of a compiled loop, which neither makes an array nor returns one.

    Unless it is inlined, only `from_python` makes a function that Python can call too.
    """
    wrapping = {} if from_python or "inline" in options else _UNWRAPPED
    decorator: Callable[[Callable[..., Any]], Any] = njit(**_BORROWING, **wrapping, **options)
    return decorator


def cached_njit(
    *sources: ModuleType, makes_arrays: bool = False, **options: Any
) -> Callable[[Callable[..., Any]], Any]:
    """Return `numba.njit(cache=True, **options)`, or the same without a cache where there is no place for one.

    Unless the function `makes_arrays` it must be like `leaf_njit`'s.

    numba keeps compiled code next to the source, or in the user's cache folder where the package is read-only, or where
    NUMBA_CACHE_DIR says. Where none of them can be written it would refuse the function; this compiles it in every
    process instead, some seconds each time.

    numba checks the date of the function's own file alone: it would run old code of what the function calls, and cannot
    read a cache that names a type which is gone. So the digest of that file, and of `sources`, the modules of what it
    calls, becomes part of the name under which the code is kept.
    """

    settings = options if makes_arrays else _BORROWING | options

    def decorate(function: Callable[..., Any]) -> Any:
        files = [function.__code__.co_filename, *(str(module.__file__) for module in sources)]
        function.__qualname__ += f"-{_digest(files)}"
        try:
            return njit(cache=True, **settings)(function)
        except RuntimeError:  # "cannot cache function ...: no locator available"
            return njit(**settings)(function)

    return decorate


def _digest(files: list[str]) -> str:
    texts = (Path(file).read_bytes() for file in files)
    return hashlib.sha256(b"".join(texts)).hexdigest()[:16]
