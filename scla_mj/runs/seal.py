"""`seal.json`: the SHA-256 of every file that a run left, so that later corruption is detected.

It is written last and carries a digest of itself. A run that is still running, or was killed, has none. The names in
it are checked against the run folder's own: no seal leads out of its folder.
"""

from __future__ import annotations

import hashlib
import os
import re
import shlex
from pathlib import Path
from typing import Any, Final

from scla_mj.errors import SclaError
from scla_mj.paths import CONFIG_JSON, FIGURES, SEAL_JSON
from scla_mj.runs.atomic import read_json, reading, write_json
from scla_mj.runs.folder import is_run_file

FORMAT: Final = 1

_SHA256: Final = re.compile("[0-9a-f]{64}")


def write_seal(folder: Path) -> None:
    """Write `seal.json` over the run's files as they are now; files that are not a run's are left out.

    Raises:
        SclaError: a file cannot be read or the seal cannot be written.
    """
    path = Path(folder) / SEAL_JSON
    names = sorted(file.name for file in Path(folder).iterdir() if is_run_file(file.name) and file.is_file())
    content = {"format": FORMAT, "files": {name: _digest(path.with_name(name)) for name in names if name != SEAL_JSON}}
    write_json(path, content)


def is_sealed(folder: Path) -> bool:
    """Return whether the run ended in order: a killed one has no seal."""
    return (Path(folder) / SEAL_JSON).exists()


def missing_files(folder: Path) -> list[str]:
    """Return the names of the files that a run's seal lists and that are not there; an unsealed run lacks the seal.

    Raises:
        SclaError: the seal is damaged.
    """
    folder = Path(folder)
    names = _read_seal(folder / SEAL_JSON) if is_sealed(folder) else [SEAL_JSON]
    return [name for name in names if not (folder / name).exists()]


def broken_files(folder: Path, *names: str) -> dict[str, str]:
    """Return a sentence for every file of a sealed run, or of those `names`, that is not as the run left it, by name.

    An unsealed run has none.

    Raises:
        SclaError: the seal itself is damaged.
    """
    folder = Path(folder)
    if not is_sealed(folder):
        return {}
    sealed = _read_seal(folder / SEAL_JSON)
    present = {file.name for file in folder.iterdir() if is_run_file(file.name)} - {SEAL_JSON}
    return {
        name: fault
        for name in names or sorted(present | sealed.keys())
        if (fault := _fault(folder / name, sealed.get(name))) is not None
    }


def check_seal(folder: Path, *names: str) -> None:
    """Refuse a sealed run if one of these files is not as the run left it; an unsealed run passes.

    Raises:
        SclaError: a file has changed, was added or is missing, or the seal is damaged; the sentence names it.
    """
    for fault in broken_files(folder, *names).values():
        raise SclaError(fault)


def _fault(path: Path, digest: str | None) -> str | None:
    if digest is None and not os.path.lexists(path):
        return None
    if not path.is_file():
        if digest is None:
            return f"{path} is not a file of this run: remove it"
        return f"{path} is missing: {SEAL_JSON} lists it; {_remedy(path)}"
    if digest is None:
        return f"{path} is not in {SEAL_JSON}: it was added after the run, remove it"
    if _digest(path) != digest:
        return f"{path} is damaged: its bytes are not those that the run wrote ({SEAL_JSON}); {_remedy(path)}"
    return None


def _remedy(path: Path) -> str:
    if path.name in FIGURES:
        return f"`scla-mj figures {shlex.quote(str(path.parent))}` draws it again"
    if path.name == CONFIG_JSON:
        return "fetch a sound copy"
    return f"`scla-mj rollout NEW --config {shlex.quote(str(path.with_name(CONFIG_JSON)))}` makes the run again"


def _read_seal(path: Path) -> dict[str, str]:
    """Return the digest of each sealed file by its name."""
    content: dict[str, Any] = read_json(path)
    files = content.get("files")
    if content.get("format") != FORMAT:
        raise SclaError(f"{path} has format {content.get('format')!r}: this scla-mj reads format {FORMAT}")
    if not isinstance(files, dict) or not all(_is_entry(name, digest) for name, digest in files.items()):
        raise SclaError(f"{path} is damaged: it must give the SHA-256 of files of this run")
    return files


def _is_entry(name: str, digest: Any) -> bool:
    return is_run_file(name) and name != SEAL_JSON and isinstance(digest, str) and bool(_SHA256.fullmatch(digest))


def _digest(path: Path) -> str:
    with reading(path, "bytes"), path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
