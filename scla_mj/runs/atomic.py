"""Files that are either whole or absent: written next to their place, synced, then moved onto it."""

from __future__ import annotations

import glob
import hashlib
import json
import math
import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from scla_mj.errors import SclaError, remedy

_MOST_JSON_BYTES: Final = 1e9
"""The summary of two million epochs; more is no file of ours, and would fill the memory."""


DIGEST: Final = "digest"
"""The key under which a JSON file of ours carries the SHA-256 of the rest."""

_SCRATCH: Final = ".{}.{}.tmp"
"""What is written before it is moved into place: the file's name, and the number of the process."""


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path next to `path`; what was written there becomes `path` if the block succeeds.

    Raises:
        SclaError: the folder cannot be written to, or the disk is full.
    """
    scratch = path.with_name(_SCRATCH.format(path.name, os.getpid()))
    try:
        yield scratch
        _sync(scratch)
        scratch.replace(path)
        _sync_folder(path.parent)
    except OSError as error:
        raise cannot_write(path, error) from error
    finally:
        scratch.unlink(missing_ok=True)


def remove_scratch(path: Path) -> None:
    """Remove what killed processes were about to write to `path`.

    Raises:
        SclaError: it cannot be removed.
    """
    try:
        for scratch in path.parent.glob(_SCRATCH.format(glob.escape(path.name), "*")):
            scratch.unlink()
    except OSError as error:
        raise cannot_write(path, error) from error


def cannot_write(path: Path, error: OSError) -> SclaError:
    """Return the one sentence for a file that cannot be written."""
    reason = os.strerror(error.errno) if error.errno else error  # a library may put more than one line into its own
    return SclaError(f"cannot write {path}: {reason}; {remedy(error, folder='RUN')}")


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write `content` as indented JSON, whole or not at all, with a digest of itself.

    Raises:
        SclaError: the file cannot be written.
        ValueError: a number is not finite, which JSON cannot say.
    """
    sealed = {**content, DIGEST: _digest(content)}
    text = json.dumps(sealed, indent=2, ensure_ascii=False, allow_nan=False)
    with replacing(path) as scratch:
        scratch.write_text(text + "\n", encoding="utf-8")


def read_json(path: Path, *, by_hand: bool = False) -> dict[str, Any]:
    """Return the JSON object that a file of ours holds, without the digest that it is checked against.

    One that was written `by_hand` may have none.

    Raises:
        SclaError: the file is missing, unreadable, no JSON object, or not what was written.
    """
    check_regular(path, most_bytes=_MOST_JSON_BYTES)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise cannot_read(path, error) from error
    except (ValueError, RecursionError) as error:
        raise SclaError(f"{path} is damaged: it must hold JSON ({error})") from error
    if not isinstance(content, dict):
        raise SclaError(f"{path} is damaged: it must hold a JSON object, not {type(content).__name__}")
    if by_hand and DIGEST not in content:
        return content
    if content.pop(DIGEST, None) != _digest(content):
        remedy = ", or take the digest out of a file that you changed" if by_hand else ""
        raise SclaError(f"{path} is damaged: it does not fit its own digest; fetch a sound copy{remedy}")
    return content


def spelling(path: Path) -> Callable[[tuple[str | int, ...]], str]:
    """Return how a sentence names a value in a JSON file, such as `config.json: grid.target[0]`."""

    def spell(keys: tuple[str | int, ...]) -> str:
        names = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys)
        return f"{path}: {names.removeprefix('.')}" if keys else str(path)

    return spell


def _digest(content: dict[str, Any]) -> str:
    """Return the SHA-256 of what the content means: neither the order of its keys nor its spaces count."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def check_regular(path: Path, *, most_bytes: float = math.inf) -> None:
    """Refuse what is there but no regular file, since a pipe may never end, and a file that is too long to be ours.

    Raises:
        SclaError: it is another thing, or longer than `most_bytes`.
    """
    try:
        status = path.stat()
    except FileNotFoundError:
        return  # whoever opens it says so in its own words
    except OSError as error:
        raise cannot_read(path, error) from error
    if not stat.S_ISREG(status.st_mode):
        raise SclaError(f"{path} is damaged: it must be a file, not a folder, a pipe or a device")
    if status.st_size > most_bytes:
        raise SclaError(f"{path} is damaged: it holds {status.st_size} bytes, a file of ours at most {most_bytes:g}")


def cannot_read(path: Path, error: OSError) -> SclaError:
    """Return the one sentence for a file that is missing or cannot be read."""
    if isinstance(error, FileNotFoundError):
        return SclaError(f"{path} does not exist: choose a folder that `scla-mj rollout` wrote")
    return SclaError(f"cannot read {path}: {error.strerror or error}; choose a readable run folder")


def _sync_folder(path: Path) -> None:
    """Force the folder's own entries to the disk; where a folder cannot be opened (Windows) the system does that."""
    if os.name == "posix":
        handle = os.open(path, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _sync(path: Path) -> None:
    """Force the content to the disk, so that a power cut after the move cannot leave an empty file under the name."""
    with path.open("rb+") as stream:
        os.fsync(stream.fileno())
