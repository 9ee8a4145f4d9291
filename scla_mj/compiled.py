"""numba for loops over arrays that they are given, with a cache of compiled code where one can be kept."""

from __future__ import annotations

import functools
import hashlib
import logging
import secrets
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import numba
import numpy as np
from numba import njit
from numba.core.bytecode import FunctionIdentity
from numba.core.caching import FunctionCache, IndexDataCacheFile

from scla_mj.errors import SclaError

if numba.config.DISABLE_JIT:
    raise SclaError("NUMBA_DISABLE_JIT is set: the loops of scla_mj run only as compiled code; unset it")

_LOG: Final = logging.getLogger(__name__)
FunctionIdentity._unique_ids = iter(lambda: secrets.randbits(62), None)
"""numba tells functions of one name, and records, apart by numbers that every process counts from 1. Two functions that
two processes have compiled could have one name, and a third process, with both from the cache, run one for both."""
_NAMING: Final = "random"
"""What was kept under other names is not read."""
_DIGEST_BYTES: Final = 32

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
    *sources: ModuleType, makes_arrays: bool = False, code: str = "", **options: Any
) -> Callable[[Callable[..., Any]], Any]:
    """Return `numba.njit(**options)` with a cache like that of `cache=True`, which harm to its files cannot break.

    Unless the function `makes_arrays` it must be like `leaf_njit`'s.

    numba keeps compiled code next to the source, or in the user's cache folder where the package is read-only, or where
    NUMBA_CACHE_DIR says. Where none of them can be written it would refuse the function; this compiles it in every
    process instead, some seconds each time. That a function is compiled is logged; that a file is damaged, as a
    warning.

    numba checks the date of the function's own file alone: it would run old code of what the function calls, and cannot
    read a cache that names a type which is gone. So the digest of that file, and of `sources`, the modules of what it
    calls, becomes part of the name under which the code is kept; and so does that of `code`, which must tell functions
    apart that a function holds in its closure.
    """

    settings = options if makes_arrays else _BORROWING | options

    def decorate(function: Callable[..., Any]) -> Any:
        files = [function.__code__.co_filename, *(str(module.__file__) for module in sources)]
        function.__qualname__ += f"-{_digest(files, code)}"
        compiled = njit(**settings)(function)
        compiled._cache = _SoundCache(function)
        return compiled

    return decorate


class _SoundCache:
    """numba's cache of a function, where what cannot be read is compiled anew and what cannot be kept is not."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._kept: _NamedByDigest | None
        try:
            self._kept = _NamedByDigest(function)
        except Exception as error:  # numba finds no folder, or the environment asks for an odd one
            _LOG.debug("no cache: %s", error)
            self._kept = None
        else:
            old = self._kept._cache_file
            self._kept._cache_file = _DigestedFiles(old._cache_path, self._kept._impl.filename_base, old._source_stamp)

    @property
    def cache_path(self) -> str | None:
        """The folder; None where there is none to be had."""
        return None if self._kept is None else str(self._kept.cache_path)

    def load_overload(self, signature: Any, context: Any) -> Any:
        """Return the compiled function if it is kept and sound; numba compiles it otherwise."""
        found = None
        if self._kept is not None:
            try:
                found = self._kept.load_overload(signature, context)
            except Exception as error:  # whatever the bytes of another library's version may lead to
                _warn(f"{self.cache_path} holds compiled code that cannot be used ({type(error).__name__})")
        if found is None:
            _announce(kept=self._kept is not None)
        return found

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Keep a function that numba compiled, if the folder can still be written to."""
        if self._kept is not None:
            try:
                self._kept.save_overload(signature, compiled)
            except Exception as error:
                _warn(f"compiled code cannot be kept in {self.cache_path} ({error}): every start will compile it")


class _NamedByDigest(FunctionCache):  # type: ignore[misc]
    """numba's, but the name alone tells code apart: numba's own key of a closure differs from process to process."""

    def _index_key(self, signature: Any, codegen: Any) -> Any:
        return signature, codegen.magic_tuple()


class _DigestedFiles(IndexDataCacheFile):  # type: ignore[misc]
    """A file for each signature and processor, which ends with the SHA-256 of itself and of what it is.

    numba's own index of such files can be damaged, and can name the wrong one after two processes have written it.
    """

    def load(self, key: Any) -> Any:
        """Return what `save` kept under the key, or None."""
        path = Path(self._data_path(self._name(key)))
        try:
            content = path.read_bytes()
        except FileNotFoundError:
            return None
        if content[-_DIGEST_BYTES:] != _sha256(path.name.encode(), content[:-_DIGEST_BYTES]):
            _warn(f"{path} is damaged: it is compiled anew")
            return None
        return self._load_data(path.name)  # the pickle within ends before the digest

    def save(self, key: Any, data: Any) -> None:
        """Keep `data` under the key, whole or not at all."""
        name = self._name(key)
        content = self._dump(data)
        with self._open_for_write(self._data_path(name)) as file:
            file.write(content + _sha256(name.encode(), content))

    def _name(self, key: Any) -> str:
        config = numba.config
        made_by = (_NAMING, numba.__version__, np.__version__, config.OPT, config.BOUNDSCHECK, config.DEBUGINFO_DEFAULT)
        text = repr((self._source_stamp, made_by, key))
        return str(self._data_name(int.from_bytes(_sha256(text.encode())[:8])))


def _sha256(*parts: bytes) -> bytes:
    return hashlib.sha256(b"".join(parts)).digest()


@functools.cache
def _warn(sentence: str) -> None:
    _LOG.warning("%s", sentence)


@functools.cache
def _announce(*, kept: bool) -> None:
    """Say that compiling begins, once."""
    how_often = "for this machine, once" if kept else "as at every start, since no cache folder can be written to"
    _LOG.info("compiling %s, which takes up to a minute", how_often)


def _digest(files: list[str], code: str) -> str:
    return _sha256(*(Path(file).read_bytes() for file in files), code.encode()).hex()[:16]
