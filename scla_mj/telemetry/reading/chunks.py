"""A `.rrd` file's chunks as numpy arrays, whole, cut short or damaged; every fault becomes one sentence."""

from __future__ import annotations

import contextlib
import functools
import os
import shutil
import tempfile
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import pyarrow as pa
import rerun as rr
from numpy.typing import NDArray

from scla_mj.errors import SclaError
from scla_mj.telemetry import names
from scla_mj.telemetry.reading.frames import whole_bytes
from scla_mj.telemetry.reading.probe import survives_decoding

_MAGIC: Final = b"RRF2"
_FOOTER_MAGIC: Final = b"FOOT"
_FOOTER_BYTES: Final = 8


class Chunk(NamedTuple):
    """Rows of one entity; `rows` is the Arrow batch, `decision` and `epoch` are empty for static rows."""

    entity: str
    rows: pa.RecordBatch

    @property
    def decision(self) -> NDArray[np.int64]:
        """The decision of every row, counted over the run from 1."""
        return np.asarray(self.rows.column(names.DECISION).to_numpy())

    @property
    def epoch(self) -> NDArray[np.int64]:
        """The epoch of every row."""
        return np.asarray(self.rows.column(names.EPOCH).to_numpy())

    @property
    def time_s(self) -> NDArray[np.float64]:
        """The simulated time of every row."""
        return np.asarray(self.rows.column(names.SIM_TIME).cast(pa.int64()).to_numpy()) / 1e9

    def before(self, decision: int | None) -> Chunk:
        """Return the rows of the decisions before that one; all of them if there is none, or they are static."""
        if decision is None or not self.has(names.DECISION):
            return self
        kept = self.decision < decision
        return self if kept.all() else self._replace(rows=self.rows.filter(pa.array(kept)))

    def has(self, component: str) -> bool:
        """Return whether the rows carry a component, such as "Scalars:scalars"."""
        return component in self.rows.schema.names

    def lengths(self, component: str) -> NDArray[np.int64]:
        """Return how many instances each row holds."""
        offsets = np.asarray(self.rows.column(component).offsets.to_numpy(), np.int64)
        return offsets[1:] - offsets[:-1]

    def values(self, component: str) -> NDArray[Any]:
        """Return all instances of all rows: (n,) for numbers, (n, k) for vectors."""
        flat = self.rows.column(component).flatten()
        if not pa.types.is_fixed_size_list(flat.type):
            return np.asarray(flat.to_numpy(zero_copy_only=False))
        return np.asarray(flat.flatten().to_numpy(zero_copy_only=False)).reshape(-1, flat.type.list_size)

    def last_tensor(self) -> NDArray[Any]:
        """Return the last row's tensor, to the bit."""
        tensor = self.rows.column("Tensor:data")[-1].values[0]
        shape = tensor["shape"].as_py()
        return np.asarray(tensor["buffer"].value.values.to_numpy()).reshape(shape)


class Rows(NamedTuple):
    """Rows of one entity over a whole recording, by decision: (n,) each, `values` (n, k) for vectors."""

    decision: NDArray[np.int64]
    epoch: NDArray[np.int64]
    time_s: NDArray[np.float64]
    values: NDArray[np.float64]


def join(chunks: Sequence[Chunk], component: str) -> Rows:
    """Return the rows of chunks that each hold one value of a component per row."""
    if not chunks:
        return Rows(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0), np.zeros(0))
    rows = [(chunk.decision, chunk.epoch, chunk.time_s, chunk.values(component).astype(float)) for chunk in chunks]
    decision, epoch, time_s, values = (np.concatenate(column) for column in zip(*rows, strict=True))
    order = np.argsort(decision, kind="stable")
    return Rows(decision[order], epoch[order], time_s[order], values[order])


class EmptyRecordingError(SclaError):
    """A run was stopped before it had written the first words of this recording, or of this part of one."""


@contextlib.contextmanager
def open_recording(path: Path, *, untrusted: bool = True) -> Iterator[RecordingFile]:
    """Open a recording of ours; one that a killed run left is read up to its last whole chunk.

    An untrusted file is first decoded in a process of its own, once, which takes about half a second.

    Raises:
        SclaError: the file is missing, empty, no Rerun recording, not ours, or damaged.
    """
    finished = _check_header(path)
    with contextlib.ExitStack() as stack:
        readable = path if finished else stack.enter_context(_without_the_cut(path))
        status = readable.stat()
        if untrusted and not _is_decodable(readable, status.st_ino, status.st_size, status.st_mtime_ns):
            raise SclaError(f"the recording {path} is damaged: its data cannot be decoded")
        with faults_named(path):
            reader = _quietly(rr.chunk.RrdReader, readable)
            stores = _quietly(reader.recordings)
        if not stores:
            raise EmptyRecordingError(
                f"the recording {path} holds nothing yet: the run was stopped before it wrote anything"
            )
        if stores[0].application_id != names.APPLICATION:
            raise SclaError(f"{path} was recorded by {stores[0].application_id!r}, not by scla-mj")
        yield RecordingFile(path, reader, finished, stores[0].recording_id)


@functools.lru_cache
def _is_decodable(path: Path, *_: int) -> bool:
    """Try it once for as long as the file stays the same."""
    return survives_decoding(path)


class RecordingFile:
    """An open recording. `finished`: whether it was closed; a killed run's was not. `run_id` is its identity."""

    def __init__(self, path: Path, reader: rr.chunk.RrdReader, finished: bool, run_id: str) -> None:
        self.path, self.finished, self.run_id = path, finished, run_id
        self._reader = reader

    def chunks(self, content: list[str] | None = None) -> Iterator[Chunk]:
        """Yield the chunks of the entities that match, in the order of the file, one in memory at a time.

        Raises:
            SclaError: the file is damaged.
        """
        with faults_named(self.path):
            stream = _quietly(self._reader.stream)
            for chunk in stream.filter(content=content) if content else stream:
                rows = chunk.to_record_batch()
                rows.validate(full=True)
                yield Chunk(chunk.entity_path.lstrip("/"), rows)


def _check_header(path: Path) -> bool:
    """Return whether the file ends as a closed recording does; refuse what cannot be one."""
    if not path.is_file():
        raise SclaError(f"there is no recording {path}: give a run that was recorded with --telemetry light or full")
    try:
        with path.open("rb") as file:
            magic = file.read(len(_MAGIC))
            file.seek(0, 2)
            size = file.tell()
            file.seek(max(0, size - _FOOTER_BYTES))
            tail = file.read()
    except OSError as error:
        raise SclaError(f"the recording {path} cannot be read: {error.strerror}") from error
    if size == 0:
        raise EmptyRecordingError(f"the recording {path} is empty: the run was stopped before it wrote anything")
    if magic != _MAGIC:
        raise SclaError(f"{path} is not a Rerun recording: choose the recording.rrd of a run")
    return tail.startswith(_FOOTER_MAGIC)


@contextlib.contextmanager
def _without_the_cut(path: Path) -> Iterator[Path]:
    """Give a file that ends with a whole frame: of one cut within, which Rerun refuses, a copy without the rest."""
    with path.open("rb") as file:
        whole = whole_bytes(file)
    if whole == path.stat().st_size:
        yield path
        return
    with contextlib.ExitStack() as stack:
        try:
            copy = Path(stack.enter_context(tempfile.TemporaryDirectory())) / path.name
            shutil.copyfile(path, copy)
            os.truncate(copy, whole)
        except OSError as error:
            raise SclaError(
                f"the recording {path} was cut short, and cannot be copied to be read: {error.strerror}; "
                "name a folder with room for it in TMPDIR"
            ) from error
        yield copy


def _quietly(call: Any, *arguments: Any) -> Any:
    """Call without Rerun's warning about a missing footer: that a run was killed is said elsewhere."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return call(*arguments)


@contextlib.contextmanager
def faults_named(path: Path) -> Iterator[None]:
    """Turn whatever the decoders raise on bad bytes into one sentence (Rust panics are no `Exception`)."""
    try:
        yield
    except (SclaError, KeyboardInterrupt, SystemExit, GeneratorExit):
        raise
    except BaseException as error:
        reason = (str(error) or type(error).__name__).splitlines()[0].rpartition(f"{path}: ")[2]
        raise SclaError(f"the recording {path} is damaged: {reason}") from error
