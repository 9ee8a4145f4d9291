"""Folders on the command line: `~` is the home folder, and an empty word is no folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tyro.constructors import PrimitiveConstructorSpec

from scla_mj.errors import SclaError


def folder(metavar: str) -> PrimitiveConstructorSpec[Any]:
    """Return how an option that names a folder is read.

    Raises:
        SclaError: (when it reads) the word is empty, or its `~name` is nobody's.
    """

    def read(words: list[str]) -> Path:
        if not words[0].strip():
            raise SclaError(f"{metavar} is empty: name a folder")
        try:
            return Path(words[0]).expanduser()
        except RuntimeError as error:
            raise SclaError(f"{metavar} {words[0]} is in nobody's home folder: write the whole path") from error

    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=metavar,
        instance_from_str=read,
        is_instance=lambda value: isinstance(value, Path),
        str_from_instance=lambda value: [str(value)],
    )
