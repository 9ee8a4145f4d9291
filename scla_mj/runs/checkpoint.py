"""`checkpoint.npz`: everything that a run needs to resume bit-identically (docs/checkpoint.md).

A zip file of numpy arrays and of `state.json`, which holds the rest and says where each array belongs. The SHA-256 of
everything before it ends the file, as the end of the zip's comment. Nothing is pickled.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import re
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from scla_mj.errors import SclaError
from scla_mj.paths import CHECKPOINT_NPZ
from scla_mj.runs.atomic import reading, replacing

FORMAT: Final = 2

_MOST_BYTES: Final = 4e9
"""Far above the state of the largest network; anything larger is not ours, and would fill the memory."""
_STATE: Final = "state.json"
_ARRAY: Final = "$array"
"""In `state.json` an array is an object with this one key, which names the archive's member."""
_KEY: Final = re.compile(r"[\w.-]+")
_ARRAY_KINDS: Final = "biufU"
_COMMENT: Final = b"scla-mj checkpoint, sha256 "
_DIGEST_BYTES: Final = 64
START_AGAIN: Final = "remove it and the run starts again from its beginning, to the same bits"


def write_checkpoint(folder: Path, state: dict[str, Any]) -> None:
    """Replace a run's checkpoint by `state`; the one before stays until the new one is safe on the disk.

    `state` nests dicts, with words as keys, and lists; its leaves are numpy arrays of numbers or texts, int, float,
    str, bool and None.

    Raises:
        SclaError: the folder cannot be written to, or `state` holds something else.
    """
    arrays: dict[str, NDArray[Any]] = {}
    text = json.dumps({"format": FORMAT, "state": _packed(state, "", arrays)})
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **arrays)
    with zipfile.ZipFile(buffer, "a") as archive:
        archive.writestr(zipfile.ZipInfo(_STATE), text)
        archive.comment = _COMMENT + bytes(_DIGEST_BYTES)
    content = buffer.getbuffer()[:-_DIGEST_BYTES]
    with replacing(Path(folder) / CHECKPOINT_NPZ) as scratch, scratch.open("wb") as file:
        file.write(content)
        file.write(_digest(content))


def read_checkpoint(folder: Path) -> dict[str, Any] | None:
    """Return the state of a run's checkpoint, or None if there is not a checkpoint.

    Raises:
        SclaError: the file cannot be read, is damaged, or is of another format.
    """
    path = Path(folder) / CHECKPOINT_NPZ
    if not os.path.lexists(path):
        return None
    with reading(path, "a checkpoint", most_bytes=_MOST_BYTES):
        content = path.read_bytes()
    body = memoryview(content)[:-_DIGEST_BYTES]
    if _digest(body) != content[-_DIGEST_BYTES:]:
        raise SclaError(f"{path} is damaged: it does not fit its own SHA-256; {START_AGAIN}")
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            if any(entry.compress_type != zipfile.ZIP_STORED for entry in archive.zip.infolist()):
                raise ValueError("it is compressed")
            top = _unpacked(json.loads(archive[_STATE]), archive)
        found, state = top["format"], top["state"]
    except Exception as error:  # a file with a sound digest that we did not write
        raise SclaError(f"{path} is not a checkpoint of scla-mj ({type(error).__name__}); {START_AGAIN}") from error
    if found != FORMAT or not isinstance(state, dict):
        raise SclaError(f"{path} has format {found!r}: this scla-mj reads format {FORMAT}; {START_AGAIN}")
    return state


def check_state(state: Any) -> None:
    """Refuse a state that a checkpoint cannot hold.

    Raises:
        SclaError: the sentence names the place and what may stand there.
    """
    if not isinstance(state, dict):
        raise SclaError(f"a state is a dict, not {type(state).__name__}")
    arrays: dict[str, NDArray[Any]] = {}
    json.dumps(_packed(state, "", arrays))
    size = sum(array.nbytes for array in arrays.values())
    if size > _MOST_BYTES / 2:
        raise SclaError(f"its arrays have {size} bytes: a state has at most {_MOST_BYTES / 2:.0f}")


def _packed(value: Any, where: str, arrays: dict[str, NDArray[Any]]) -> Any:
    """Return what JSON can hold, and collect the arrays by their place."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.bool_ | np.integer | np.floating) and isinstance(value.item(), bool | int | float):
        return value.item()  # to the bit, as a plain number
    if isinstance(value, np.ndarray) and not isinstance(value, np.ma.MaskedArray) and value.dtype.kind in _ARRAY_KINDS:
        arrays[where] = value
        return {_ARRAY: where}
    if isinstance(value, list):
        return [_packed(item, f"{where}/{number}", arrays) for number, item in enumerate(value)]
    if isinstance(value, dict):
        for key in value:
            if not (isinstance(key, str) and _KEY.fullmatch(key)):
                raise SclaError(f"{where or 'the state'} has the key {key!r}: a key is a word")
        return {key: _packed(item, f"{where}/{key}".lstrip("/"), arrays) for key, item in value.items()}
    kinds = "numpy arrays of numbers, int, float, str, bool, None, and dicts and lists of these"
    raise SclaError(f"{where} is {type(value).__name__}: a state holds {kinds}")


def _unpacked(value: Any, arrays: Mapping[str, NDArray[Any]]) -> Any:
    if isinstance(value, list):
        return [_unpacked(item, arrays) for item in value]
    if not isinstance(value, dict):
        return value
    if _ARRAY in value:
        return arrays[value[_ARRAY]]
    return {key: _unpacked(item, arrays) for key, item in value.items()}


def _digest(content: memoryview | bytes) -> bytes:
    return hashlib.sha256(content).hexdigest().encode()
