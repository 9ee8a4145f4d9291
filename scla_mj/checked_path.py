"""Paths that a user names: what no file can be called is refused before anything runs."""

import os
import stat
import unicodedata
from pathlib import Path
from typing import Final

from scla_mj.errors import SclaError

_NAME_BYTES: Final = 255
_PATH_BYTES: Final = 3840
"""Linux takes 4096, and the longest name below OUT or RUN wants its share."""
_NO_NAME: Final = {"Cc": "holds a control character", "Cs": "is not UTF-8", "Zl": "holds a line", "Zp": "holds a line"}
"""Categories of Unicode that no name of a file should hold, and what to say of them."""


def checked_path(path: str | os.PathLike[str], name: str) -> Path:
    """Return the path that the user gave as `name`, such as RUN, with `~` expanded.

    Raises:
        SclaError: it is empty, odd, too long, in nobody's home folder, below a file, or cannot be looked at.
    """
    try:
        text = os.fsdecode(path)
    except TypeError as error:
        raise SclaError(f"{name} is {path!r}: it must be the path of a folder") from error
    if not text.strip():
        raise SclaError(f"{name} is empty: name a folder")
    odd = [_NO_NAME[kind] for kind in map(unicodedata.category, text) if kind in _NO_NAME]
    if odd:
        raise SclaError(f"{name} {text!r} {odd[0]}: choose another name")
    try:
        expanded = Path(text).expanduser()
    except RuntimeError as error:
        raise SclaError(f"{name} {text} is in nobody's home folder: write the whole path") from error
    _check_length(expanded, name)
    for place in (expanded, *expanded.absolute().parents):
        try:
            mode = place.stat().st_mode
        except (FileNotFoundError, NotADirectoryError):
            continue
        except OSError as error:
            raise SclaError(
                f"{name} {expanded} cannot be looked at: {error.strerror}; choose another {name}"
            ) from error
        if place != expanded and not stat.S_ISDIR(mode):
            raise SclaError(f"{name} {expanded} cannot be: {place} is a file, not a folder; choose another {name}")
        break
    return expanded


def _check_length(path: Path, name: str) -> None:
    whole = len(os.fsencode(path.absolute()))
    longest = max(map(os.fsencode, path.parts), key=len, default=b"")
    if whole > _PATH_BYTES:
        raise SclaError(f"{name} is too long, {whole} bytes: choose a path of at most {_PATH_BYTES}")
    if len(longest) > _NAME_BYTES:
        shown = os.fsdecode(longest[:20])
        raise SclaError(f"{name} is too long: {shown}... has {len(longest)} bytes, a name at most {_NAME_BYTES}")
