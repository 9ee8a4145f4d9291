"""Which code made a report: the commit of the checkout that it runs from, and the digest of the model's bits."""

from __future__ import annotations

import hashlib
import json
import platform
import subprocess
from pathlib import Path
from typing import Any, Final, NamedTuple

import scla_mj

ROOT: Final = Path(scla_mj.__file__).resolve().parents[1]
UNKNOWN: Final = "unknown"
_CODE: Final = ("scla_mj", "assets")


class Origin(NamedTuple):
    """What `made-by.json` says of the code."""

    commit: str
    """The checkout's commit, or "unknown" outside of one."""
    changed: bool
    """Whether package or assets differed from that commit."""
    platform: str
    bits: str
    """SHA-256 of the digests of short runs that the checkout has for this platform, or "unknown"."""


def origin(root: Path = ROOT) -> Origin:
    """Return what the code in a folder is; an installed package is no checkout, whatever folder it lies in."""
    where = f"{platform.system()} {platform.machine()}"
    if not (root / ".git").exists():
        return Origin(UNKNOWN, False, where, UNKNOWN)
    commit = _git(root, "rev-parse", "HEAD") or UNKNOWN
    return Origin(commit, bool(_git(root, "status", "--porcelain", "--", *_CODE)), where, bits_digest(root, where))


def bits_digest(root: Path, where: str) -> str:
    """Return the digest of the short runs' digests that `tests/bits.json` has for a platform, or "unknown"."""
    file = root / "tests" / "bits.json"
    entries: dict[str, Any] = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    if where not in entries:
        return UNKNOWN
    return hashlib.sha256(json.dumps(entries[where]["runs"], sort_keys=True).encode()).hexdigest()


def _git(root: Path, *words: str) -> str:
    try:
        done = subprocess.run(["git", "-C", str(root), *words], capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return ""
    return done.stdout.strip()
