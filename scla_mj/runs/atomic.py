"""Files that are either whole or absent: written next to their place, synced, then moved onto it."""

from __future__ import annotations

import glob
import hashlib
import json
import math
import os
import stat
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from scla_mj.errors import SclaError, remedy

_MOST_JSON_BYTES: Final = 1e9
"""The summary of two million epochs; anything larger is not ours, and would fill the memory."""


DIGEST: Final = "digest"
"""The key under which a JSON file of ours carries the SHA-256 of the rest."""

_SCRATCH: Final = ".{}.{}.tmp"
"""What is written before it is moved into place: the file's name, and the numbers of the process and its thread."""


@contextmanager
def replacing(path: Path, *, taken: str = "", folder: str = "RUN") -> Iterator[Path]:
    """Yield a temporary path next to `path`; what was written there becomes `path` if the block succeeds.

    `folder` as in `writing`.

    Raises:
        SclaError: the folder cannot be written to, or the disk is full; `taken` if that is given and `path` is there:
            of two processes that write it at once one is refused.
    """
    scratch = path.with_name(_SCRATCH.format(path.name, f"{os.getpid()}-{threading.get_ident()}"))
    try:
        with writing(path, folder=folder, refusal=taken):
            yield scratch
            _sync(scratch)
            _move(scratch, path, over=not taken)
            _sync_folder(path.parent)
    finally:
        scratch.unlink(missing_ok=True)


def _move(scratch: Path, path: Path, *, over: bool) -> None:
    if not over:
        try:
            path.hardlink_to(scratch)  # unlike a move it fails if `path` is there
        except FileExistsError:
            raise
        except OSError:  # a file system without hard links
            if os.path.lexists(path):
                raise FileExistsError from None
        else:
            return
    scratch.replace(path)


def is_still(path: Path, status: os.stat_result) -> bool:
    """Return whether the file or folder of this `status` is what lies at `path` now."""
    try:
        return os.path.samestat(status, path.stat())
    except OSError:
        return False


def remove_scratch(path: Path) -> None:
    """Remove what killed processes were about to write to `path`.

    Raises:
        SclaError: it cannot be removed.
    """
    remove(*path.parent.glob(_SCRATCH.format(glob.escape(path.name), "*")))


def remove(*paths: Path) -> None:
    """Remove files, those that there are.

    Raises:
        SclaError: one cannot be removed.
    """
    for path in paths:
        with writing(path):
            path.unlink(missing_ok=True)


@contextmanager
def writing(path: Path, *, folder: str = "RUN", refusal: str = "") -> Iterator[None]:
    """Turn what the system raises in this block into the one sentence for a file that cannot be written.

    `folder` is what the command line calls the folder that the user chose, RUN or OUT.

    Raises:
        SclaError: the folder cannot be written to, or the disk is full; `refusal` where `path` may not exist but does.
    """
    try:
        yield
    except OSError as error:
        if refusal and isinstance(error, FileExistsError):
            raise SclaError(refusal) from error
        reason = os.strerror(error.errno) if error.errno else error  # a library may put more than one line into its own
        raise SclaError(f"cannot write {path}: {reason}; {remedy(error, folder=folder)}") from error


@contextmanager
def reading(path: Path, content: str, *, most_bytes: float = math.inf, fault: str = "is damaged") -> Iterator[None]:
    """Turn what is raised in this block, in which `path` is read, into one sentence; it must hold `content`.

    What is there but no regular file is refused first, since a pipe may never end, and a file that is too long to be
    ours.

    Raises:
        SclaError: the file is missing, unreadable, longer than `most_bytes`, or damaged.
    """
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise SclaError(f"{path} is damaged: it must be a file, not a folder, a pipe or a device")
        if status.st_size > most_bytes:
            raise SclaError(
                f"{path} is damaged: it holds {status.st_size} bytes, a file of ours at most {most_bytes:g}"
            )
        yield
    except SclaError:
        raise
    except FileNotFoundError as error:
        raise SclaError(f"{path} does not exist: choose a folder that `scla-mj rollout` wrote") from error
    except Exception as error:  # zipfile, zlib, numpy and pyarrow raise a dozen kinds on damaged bytes
        if isinstance(error, OSError) and error.errno:
            raise SclaError(f"cannot read {path}: {error.strerror}; choose a readable run folder") from error
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise SclaError(f"{path} {fault}: it must hold {content} ({reason})") from error


def write_json(path: Path, content: dict[str, Any], *, taken: str = "") -> None:
    """Write `content` as indented JSON, whole or not at all, with a digest of itself.

    Raises:
        SclaError: the file cannot be written; `taken` if that is given and the file is there.
        ValueError: a number is not finite, which JSON cannot say.
    """
    sealed = {**content, DIGEST: _digest(content)}
    text = json.dumps(sealed, indent=2, ensure_ascii=False, allow_nan=False)
    with replacing(path, taken=taken) as scratch:
        scratch.write_text(text + "\n", encoding="utf-8")


def read_json(path: Path, *, by_hand: bool = False) -> dict[str, Any]:
    """Return the JSON object that a file of ours holds, without the digest that it is checked against.

    One that was written `by_hand` may have none.

    Raises:
        SclaError: the file is missing, unreadable, no JSON object, or not what was written.
    """
    fault = "is not a file of settings" if by_hand else "is damaged"
    with reading(path, "JSON", most_bytes=_MOST_JSON_BYTES, fault=fault):
        # Windows' editors begin a file with a mark of its encoding.
        content = json.loads(path.read_text(encoding="utf-8-sig"), object_pairs_hook=_without_doubles)
    if not isinstance(content, dict):
        raise SclaError(f"{path} {fault}: it must hold a JSON object, not {type(content).__name__}")
    if by_hand and DIGEST not in content:
        return content
    if content.pop(DIGEST, None) != _digest(content):
        remedy = ", or take the digest out of a file that you changed" if by_hand else ""
        raise SclaError(f"{path} is damaged: it does not fit its own digest; fetch a sound copy{remedy}")
    return content


def _without_doubles(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Refuse a key that is given twice: JSON's readers keep the last without a word."""
    content = dict(pairs)
    if len(content) < len(pairs):
        keys = [key for key, _ in pairs]
        raise ValueError(f"{next(key for key in keys if keys.count(key) > 1)!r} is given twice in one object")
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
