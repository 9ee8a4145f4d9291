"""The parts of one recording: a resumed run continues in a new file, with the same identity."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from scla_mj.anatomy import Anatomy, read_anatomy
from scla_mj.errors import SclaError
from scla_mj.telemetry import names
from scla_mj.telemetry.reading.chunks import Chunk, EmptyRecordingError, RecordingFile, faults_named, open_recording


class Part(NamedTuple):
    """An open file of a recording. `end` is the first decision that a later part made again, or None."""

    file: RecordingFile
    properties: dict[str, Any]
    end: int | None = None

    @property
    def anatomy(self) -> Anatomy | None:
        """The populations and projections that its entities are named after; None for a brain without neurons."""
        return read_anatomy(json.loads(self.properties.get(names.ANATOMY, "null")))

    def chunks(self, content: list[str]) -> Iterator[Chunk]:
        """Yield the chunks of the entities that match, without the decisions that a later part holds."""
        for chunk in self.file.chunks(content):
            rest = chunk.before(self.end)
            if len(rest.rows):
                yield rest


@contextlib.contextmanager
def open_parts(*paths: Path) -> Iterator[list[Part]]:
    """Open a recording's files, in their order; of several, one whose run was stopped at its birth is left out.

    Raises:
        SclaError: a file is missing, empty, no recording of ours, of a newer layout, of another run, or damaged.
    """
    with contextlib.ExitStack() as stack:
        parts: list[Part] = []
        for path in map(Path, paths):
            try:
                file = stack.enter_context(open_recording(path))
                with faults_named(path):
                    parts.append(Part(file, _read_properties(file)))
            except EmptyRecordingError:
                if len(paths) == 1:
                    raise
        if not parts:
            raise EmptyRecordingError(
                f"the recording {paths[0]} holds nothing yet: the run was stopped before it began"
            )
        _check_same(parts)
        starts = [int(part.properties.get(names.FIRST_DECISION, 1)) for part in parts]
        yield [part._replace(end=min(starts[later:], default=None)) for later, part in enumerate(parts, 1)]


def _check_same(parts: list[Part]) -> None:
    first = parts[0]
    for part in parts[1:]:
        if part.file.run_id != first.file.run_id or _of_the_run(part) != _of_the_run(first):
            raise SclaError(f"{part.file.path} is not part of the recording {first.file.path}: move it to its own run")


def _of_the_run(part: Part) -> dict[str, Any]:
    return {name: value for name, value in part.properties.items() if name != names.FIRST_DECISION}


def _read_properties(file: RecordingFile) -> dict[str, Any]:
    for chunk in file.chunks([f"/__properties/{names.PROPERTIES}"]):
        values = {
            name: column[0].as_py() for name, column in zip(chunk.rows.schema.names, chunk.rows.columns, strict=True)
        }
        known = {
            name: value[0] if len(value) == 1 else tuple(value)
            for name, value in values.items()
            if isinstance(value, list)
        }
        if known.get("format") != names.FORMAT:
            raise SclaError(f"{file.path} has layout {known.get('format')}; this scla-mj reads layout {names.FORMAT}")
        return known
    if not file.finished:
        raise EmptyRecordingError(f"the recording {file.path} holds nothing yet: the run was stopped before it began")
    raise SclaError(f"the recording {file.path} is damaged: its properties are missing")
