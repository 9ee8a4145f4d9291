"""The run folder itself: made once, never over another run; opened again only if it holds one."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import platform
import uuid
from collections.abc import Iterator, Mapping
from importlib import metadata
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, NamedTuple

from scla_mj import __version__, paths
from scla_mj.anatomy import Anatomy, read_anatomy
from scla_mj.checked import check
from scla_mj.checked_path import checked_path
from scla_mj.config import RunConfig
from scla_mj.errors import SclaError
from scla_mj.runs.atomic import read_json, spelling, write_json, writing
from scla_mj.validation import validated

RUN_FILES: Final = (
    paths.CONFIG_JSON,
    paths.DECISIONS_PARQUET,
    paths.DECISIONS_PARTIAL,
    paths.SUMMARY_JSON,
    paths.BRAIN_NPZ,
    paths.CHECKPOINT_NPZ,
    paths.LEARNING_PNG,
    paths.WEIGHTS_PNG,
    paths.POLICY_PNG,
    paths.RECORDING_RRD,
    paths.SEAL_JSON,
)
PACKAGES: Final = ("mujoco", "numpy", "numba", "rerun-sdk", "pyarrow")
MAKERS: Final = ("scla-mj", *PACKAGES)
"""A run's bits depend on the versions of these; the others are recorded for information."""

_VERSIONS: Final = "versions"
_RUN_ID: Final = "run_id"
_ANATOMY: Final = "anatomy"
_BRAIN_SHA256: Final = "brain_sha256"
_OF_THE_RUN: Final = (_VERSIONS, _RUN_ID, _ANATOMY, _BRAIN_SHA256)
"""What `config.json` holds besides the settings."""


class Run(NamedTuple):
    """A run folder, the configuration that made it, and `content`, all that its `config.json` holds."""

    path: Path
    config: RunConfig
    content: dict[str, Any]

    @property
    def run_id(self) -> str:
        """The identity of the run and of its recording."""
        run_id = self.content.get(_RUN_ID)
        if not (isinstance(run_id, str) and run_id):
            raise SclaError(f"{self.file(paths.CONFIG_JSON)} names no run_id: no scla-mj wrote it; start a new run")
        return run_id

    @property
    def versions(self) -> dict[str, str]:
        """The versions that the run began with (see `package_versions`)."""
        versions = self.content.get(_VERSIONS)
        return versions if isinstance(versions, dict) else {}

    @property
    def anatomy(self) -> Anatomy | None:
        """The populations and projections of its brain; None for a brain without neurons."""
        return read_anatomy(self.content.get(_ANATOMY))

    @property
    def brain_sha256(self) -> str | None:
        """The SHA-256 of the file that a brain of the user's own is in."""
        return self.content.get(_BRAIN_SHA256)

    def file(self, name: str) -> Path:
        """Return the path of one of the run's files (see `scla_mj.paths`)."""
        return self.path / name


def is_run_file(name: str) -> bool:
    """Return whether a file of this name, directly in a run folder, is the run's own."""
    return name in RUN_FILES or paths.part_number(name) is not None


@contextlib.contextmanager
def made(path: Path | str) -> Iterator[Path]:
    """Yield the folder that the user named RUN, made with its parents if need be, and taken away again if it stays
    empty.

    Raises:
        SclaError: the path is odd, is not a folder, or cannot be written to.
    """
    path = checked_path(path, "RUN")
    new = not path.exists()
    with writing(path, refusal=f"{path} is a file, not a folder: choose another RUN"):
        path.mkdir(parents=True, exist_ok=True)
    try:
        yield path
    finally:
        if new:
            with contextlib.suppress(OSError):  # it is not empty
                path.rmdir()


def refuse_run(path: Path) -> None:
    """Refuse a folder that holds a run already, or a part of one.

    Raises:
        SclaError: the sentence names a file.
    """
    with writing(path):
        present = sorted(entry.name for entry in path.iterdir() if is_run_file(entry.name))
    if present:
        raise SclaError(f"{path} already holds a run ({present[0]} is there): choose another RUN or move that one away")


def create(
    path: Path,
    config: RunConfig,
    anatomy: Anatomy | None = None,
    *,
    brain_sha256: str | None = None,
    brain_versions: Mapping[str, str] = MappingProxyType({}),
) -> Run:
    """Begin a run in a folder by writing its `config.json`, whole or not at all.

    `anatomy` is its brain's. Of a brain of the user's own: the digest of its file, and the packages that it imports.

    Raises:
        SclaError: the folder holds a run already, or cannot be written to.
    """
    refuse_run(path)
    content = {
        **dataclasses.asdict(config),
        _ANATOMY: None if anatomy is None else anatomy.content(),
        _BRAIN_SHA256: brain_sha256,
        _VERSIONS: package_versions() | dict(brain_versions),
        _RUN_ID: uuid.uuid4().hex,
    }
    write_json(path / paths.CONFIG_JSON, content, taken=f"{path} is in use by another run: choose another RUN")
    return Run(path, config, json.loads(json.dumps(content)))


def discard(run: Run) -> None:
    """Remove what a run has put into its folder: as if it had not been."""
    with contextlib.suppress(OSError):
        for file in list(run.path.iterdir()):
            if is_run_file(file.name):
                file.unlink()


def open_run(path: Path | str) -> Run:
    """Return the run that a folder holds, its configuration checked like one from the command line.

    Raises:
        SclaError: there is no such folder, or its `config.json` is missing or damaged, or a key or value in it is not
            possible; the sentence names it.
    """
    path = checked_path(path, "RUN")
    if not path.is_dir():
        raise SclaError(f"{path} is not a run folder: choose one that `scla-mj rollout` wrote")
    file = path / paths.CONFIG_JSON
    content = read_json(file)
    config = validated(RunConfig, _settings(content), spell=spelling(file), complete=True)
    try:
        run = Run(path, check(config).config, content)
        _ = run.anatomy
        return run
    except SclaError as error:
        raise SclaError(f"{file}: {error}") from error


def read_settings(path: Path) -> RunConfig:
    """Return settings to start a run from: those of a run folder, or of a JSON file such as its `config.json`.

    What a file that was written by hand leaves out takes its default.

    Raises:
        SclaError: the file is missing or damaged, or a key or value is not possible; the sentence names it.
    """
    if path.is_dir():
        return open_run(path).config
    return validated(RunConfig, _settings(read_json(path, by_hand=True)), spell=spelling(path))


def _settings(content: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in content.items() if key not in _OF_THE_RUN}


def package_versions() -> dict[str, str]:
    """Return the versions of whatever can change a run's bits, the interpreter and the platform included."""
    versions = {name: metadata.version(name) for name in PACKAGES}
    return {"scla-mj": __version__, **versions, "python": platform.python_version(), "platform": platform.platform()}
