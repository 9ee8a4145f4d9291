"""An Arrow stream that is written batch by batch and stays readable up to its last whole batch, whatever ends it.

Each batch carries its own SHA-256. The stream has no end marker: what follows the last whole batch was being written.
"""

from __future__ import annotations

import base64
import hashlib
import os
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

import pyarrow as pa
import pyarrow.parquet as pq

_PREFIX: Final = struct.Struct("<4si")
"""A stream begins with a mark and the number of bytes of its schema."""
_CONTINUES: Final = b"\xff\xff\xff\xff"
_LEAST_HEADER: Final = 256
"""That of fewer columns than any of our tables has."""
_DIGEST: Final = b"sha256"
"""The key of a batch's digest in its custom metadata."""
_SECTOR_BYTES: Final = 512


def header(schema: pa.Schema) -> bytes:
    """Return the bytes that a stream of this schema begins with."""
    content: bytes = schema.serialize().to_pybytes()
    return content


def message(batch: pa.RecordBatch) -> bytes:
    """Return the bytes of a batch in its stream, its digest included."""
    sink = pa.BufferOutputStream()
    pa.ipc.new_stream(sink, batch.schema).write_batch(batch, custom_metadata={_DIGEST: _digest(batch)})
    return bytes(memoryview(sink.getvalue())[len(header(batch.schema)) :])


def columns_of(path: Path) -> pa.Schema | None:
    """Return the columns of a stream; None where a kill cut its header short.

    Raises:
        OSError: the file cannot be read.
        pyarrow.ArrowInvalid: it is no stream.
    """
    with path.open("rb") as file:
        if _is_cut_header(file.read(_PREFIX.size), path.stat().st_size):
            return None
        file.seek(0)
        return pa.ipc.open_stream(file).schema


def whole_batches(path: Path, is_ours: Callable[[pa.Schema], bool]) -> Iterator[pa.RecordBatch]:
    """Yield the batches of a stream with columns that `is_ours` knows; one that a kill cut short ends it.

    Raises:
        OSError: the file cannot be read.
        pyarrow.ArrowInvalid: it holds other columns, or is damaged before its end.
    """
    if columns_of(path) is None:
        return
    with path.open("rb") as file:
        stream = pa.ipc.open_stream(file)
        if not is_ours(stream.schema):
            raise pa.ArrowInvalid("it holds other columns")
        while True:
            start = file.tell()
            try:
                batch, metadata = stream.read_next_batch_with_custom_metadata()
            except (StopIteration, pa.ArrowInvalid, OSError):
                break
            if metadata is None or metadata.get(_DIGEST) != _digest(batch):
                if _ends_in_zeros(path):
                    return
                raise pa.ArrowInvalid("a batch does not fit its SHA-256")
            yield batch
        file.seek(start)
        if file.read().count(_DIGEST) > 1:
            raise pa.ArrowInvalid("it breaks off before its end")  # a kill leaves at most one batch behind


def check_footer(path: Path) -> None:
    """Refuse a Parquet file whose footer, which no checksum covers, names its columns in two ways.

    Raises:
        pyarrow.ArrowInvalid: it does.
    """
    footer = pq.read_metadata(path)
    stored = pa.ipc.read_schema(pa.py_buffer(base64.b64decode(footer.metadata[b"ARROW:schema"])))
    if stored.names != footer.schema.names:
        raise pa.ArrowInvalid("its footer names other columns than its pages")


def _ends_in_zeros(path: Path) -> bool:
    """Return whether the file's last sector is empty, as a power cut leaves it: its length was on disk, its end not."""
    with path.open("rb") as file:
        file.seek(-min(_SECTOR_BYTES, path.stat().st_size), os.SEEK_END)
        return not any(file.read())


def _is_cut_header(start: bytes, size_bytes: int) -> bool:
    """Return whether a run was killed before even the stream's header was on disk."""
    if len(start) < _PREFIX.size:
        return _CONTINUES.startswith(start[:4])
    mark, header_bytes = _PREFIX.unpack(start)
    return bool(mark == _CONTINUES and header_bytes >= _LEAST_HEADER and size_bytes < _PREFIX.size + header_bytes)


def _digest(batch: pa.RecordBatch) -> bytes:
    """Return the digest of a batch and of its columns' names: those of spikes are the brain's own."""
    found = hashlib.sha256(header(batch.schema))
    found.update(batch.serialize())
    return found.hexdigest().encode()
