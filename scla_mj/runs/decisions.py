"""`decisions.parquet`, one row per decision, written as the run goes.

Rows go in whole batches into an Arrow stream, `decisions.partial.arrows`, which stays readable up to its last batch
whatever kills the run; each batch carries its own SHA-256. Closing the log turns the stream, batch by batch, into the
Parquet file. The same rows give the same bytes.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import nullcontext, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Final

import pyarrow as pa
import pyarrow.parquet as pq

from scla_mj.errors import SclaError
from scla_mj.grid import Action
from scla_mj.paths import DECISIONS_PARQUET, DECISIONS_PARTIAL
from scla_mj.runs.atomic import is_still, reading, remove, replacing, writing
from scla_mj.runs.stream import check_footer, columns_of, header, message, whole_batches
from scla_mj.signals import DecisionRecord, Outcome

BATCH_ROWS: Final = 250
"""Decisions that a kill can lose at most: some seconds of a run, and a batch small enough to cost nothing."""
ROW_GROUP_ROWS: Final = 16_384
"""Rows of a Parquet row group: a few hundred kilobytes of memory when a log is closed."""

_CONTENT: Final = "the decisions of a run"
NONE: Final = "none"
SPIKES: Final = "spikes_"
"""Begins the name of the column that counts a motor population's spikes."""
DIRECTIONS: Final = frozenset(action.label for action in Action)


def schema(motors: Sequence[str] = ()) -> pa.Schema:
    """Return the columns as `docs` names them; a brain with such motor populations has their spikes, or nulls."""
    fields = [
        *(pa.field(name, pa.int32(), nullable=False) for name in ("epoch", "decision")),
        pa.field("time_s", pa.float64(), nullable=False),
        *(pa.field(name, pa.int32(), nullable=False) for name in ("x", "y")),
        *(pa.field(name, pa.string(), nullable=False) for name in ("sensed", "advised", "action")),
        *(pa.field(name, pa.int32(), nullable=False) for name in ("to_x", "to_y")),
        pa.field("outcome", pa.string(), nullable=False),
        pa.field("hit", pa.bool_(), nullable=False),
        *(
            pa.field(name, pa.float64(), nullable=False)
            for name in ("duration_s", "position_error_m", "heading_error_rad")
        ),
        *(pa.field(SPIKES + name, pa.int32()) for name in motors),
        pa.field("executed", pa.string(), nullable=False),
    ]
    return pa.schema(fields)


_LABELS: Final = {
    "sensed": DIRECTIONS | {NONE},
    "advised": DIRECTIONS | {NONE},
    "action": DIRECTIONS,
    "executed": DIRECTIONS,
    "outcome": frozenset(outcome.value for outcome in Outcome),
}


def row(record: DecisionRecord, motors: int = 0) -> tuple[Any, ...]:
    """Return one decision as a row of the `schema` of so many motor populations."""
    before, chosen, move = record.percept.cell, record.chosen, record.move
    return (
        record.epoch,
        record.decision,
        record.time_s,
        *before,
        _label(record.percept.sensed),
        _label(chosen.advised),
        chosen.action.label,
        *move.after,
        move.outcome.value,
        record.hit,
        move.duration_s,
        move.position_error_m,
        move.heading_error_rad,
        *(chosen.motor_spikes or (None,) * motors),
        record.executed.label,
    )


class DecisionLog:
    """Writes every decision of a run into its folder; a context manager that closes itself.

    Args:
        folder: the run's folder.
        motors: the names of the brain's motor populations, each of which has a column of spikes.
        resumed: continue the stream that `take_back` left there, instead of beginning one.

    Raises:
        SclaError: the folder already has a log, or cannot be written to.
    """

    def __init__(self, folder: Path, motors: Sequence[str] = (), *, resumed: bool = False) -> None:
        self._folder, self._motors, self._schema = Path(folder), len(motors), schema(motors)
        self._rows: list[tuple[Any, ...]] = []
        self._broken = False
        self._partial = self._folder / DECISIONS_PARTIAL
        if (self._folder / DECISIONS_PARQUET).exists():
            raise SclaError(f"{self._folder} already holds the decisions of a run: choose another RUN")
        with writing(self._partial, refusal=f"{self._folder} is in use by another run: choose another RUN"):
            self._stream = self._partial.open("ab" if resumed else "xb")
            if not resumed:
                self._stream.write(header(self._schema))
                self._stream.flush()

    def write(self, record: DecisionRecord) -> None:
        """Add one decision; it is on disk within `BATCH_ROWS` decisions, or when the next epoch begins.

        Raises:
            SclaError: the disk is full or the folder has gone.
        """
        if self._rows and record.epoch != self._rows[-1][0]:
            self.flush()
        self._rows.append(row(record, self._motors))
        if len(self._rows) >= BATCH_ROWS:
            self.flush()

    def flush(self) -> None:
        """Put the decisions so far on disk, whatever their number.

        Raises:
            SclaError: the disk is full or the folder has gone.
        """
        if not self._rows:
            return
        columns = [
            pa.array(column, field.type)
            for column, field in zip(zip(*self._rows, strict=True), self._schema, strict=True)
        ]
        self._broken = True  # until it is whole: half a batch may lie at the stream's end, and nothing may follow it
        with writing(self._partial):
            self._stream.write(message(pa.record_batch(columns, schema=self._schema)))
            self._stream.flush()
        self._broken = False
        self._rows.clear()

    def sync(self) -> None:
        """Put the decisions so far on disk, safe from a power cut.

        Raises:
            SclaError: the disk is full or the folder has gone.
        """
        self.flush()
        with writing(self._partial):
            os.fsync(self._stream.fileno())

    def close(self) -> None:
        """Write `decisions.parquet` and remove the partial stream; closing twice is harmless.

        After a failed write the partial stream is left as it is, readable up to its last whole batch.

        Raises:
            SclaError: the disk is full or the folder has gone; the partial stream then stays.
        """
        if self._stream.closed:
            return
        try:
            if not self._broken:
                self.flush()
            if not is_still(self._partial, os.fstat(self._stream.fileno())):
                self._broken = True
                raise SclaError(f"{self._folder} was moved or removed during its run")
        finally:
            with suppress(OSError):
                self._stream.close()
        if self._broken:
            return
        finish_log(self._folder)

    def __enter__(self) -> DecisionLog:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        # Report the original error, not what follows from it.
        with suppress(SclaError) if kind else nullcontext():
            self.close()


def finish_log(folder: Path) -> None:
    """Turn a run's stream into `decisions.parquet`, and remove it.

    Raises:
        SclaError: the stream is damaged, the disk is full or the folder has gone; the stream then stays.
    """
    partial = Path(folder) / DECISIONS_PARTIAL
    with reading(partial, _CONTENT):
        columns = columns_of(partial) or schema()
    with replacing(partial.with_name(DECISIONS_PARQUET)) as scratch:
        _write_parquet(scratch, columns, _batches(partial))
    remove(partial)


def rows_in_stream(folder: Path) -> int:
    """Return how many decisions are in a run's stream; 0 if it has none.

    Raises:
        SclaError: it is damaged.
    """
    partial = Path(folder) / DECISIONS_PARTIAL
    return sum(map(len, _batches(partial))) if partial.exists() else 0


def take_back(folder: Path, decisions: int, motors: Sequence[str] = ()) -> None:
    """Turn a run's log, closed or not, into an open stream of its first `decisions` rows, for a `DecisionLog`.

    Later rows are given up: the run makes them again. `motors` are the names of the brain's motor populations.

    Raises:
        SclaError: the log is damaged or shorter than that, or the folder cannot be written to.
    """
    parquet, partial = Path(folder) / DECISIONS_PARQUET, Path(folder) / DECISIONS_PARTIAL
    source, wanted = parquet if parquet.exists() else partial, decisions
    with replacing(partial) as scratch, scratch.open("wb") as file:
        file.write(header(schema(motors)))
        for batch in _batches(source) if wanted else ():
            kept = batch.slice(0, wanted)
            file.write(message(kept))
            wanted -= len(kept)
            if not wanted:
                break
        if wanted:
            raise SclaError(f"{source} is damaged: it holds {decisions - wanted} of {decisions} decisions")
    remove(parquet)


def read_decisions(folder: Path) -> pa.Table:
    """Return a run's decisions: all of them, or for a killed run those up to its last whole batch.

    Raises:
        SclaError: the folder has no decisions, or the file is damaged or foreign.
    """
    parquet = Path(folder) / DECISIONS_PARQUET
    partial = Path(folder) / DECISIONS_PARTIAL
    path = partial if partial.exists() and not parquet.exists() else parquet
    if not path.exists():
        raise SclaError(f"{path} is missing, and so is {DECISIONS_PARTIAL}: fetch a sound copy of the run")
    with reading(path, _CONTENT):
        if path == parquet:
            check_footer(path)
            table = pq.read_table(path, page_checksum_verification=True)  # refuses more than `_batches` can see
        else:
            table = pa.Table.from_batches(_batches(path), columns_of(path) or schema())
        _check_columns(path, table.schema)
        table.validate(full=True)
    for name, allowed in _LABELS.items():
        foreign = sorted(set(table[name].unique().to_pylist()) - allowed)
        if foreign:
            raise SclaError(
                f"{path} is damaged: {name} is {foreign[0]!r}, it must be one of {', '.join(sorted(allowed))}"
            )
    return table


def _check_columns(path: Path, found: pa.Schema) -> None:
    if not _is_ours(found):
        names = ", ".join(schema(["NAME"]).names)
        raise SclaError(f"{path} is not a table of decisions: its columns must be {names} for each motor population")


def _is_ours(found: pa.Schema) -> bool:
    return bool(found.equals(schema([name.removeprefix(SPIKES) for name in found.names if name.startswith(SPIKES)])))


def _write_parquet(path: Path, columns: pa.Schema, batches: Iterator[pa.RecordBatch]) -> None:
    """Write row groups of `ROW_GROUP_ROWS`, so that the bytes do not depend on how the rows came in batches."""
    waiting = columns.empty_table()
    with pq.ParquetWriter(path, columns, compression="zstd", write_page_checksum=True) as writer:
        for batch in batches:
            waiting = pa.concat_tables([waiting, pa.Table.from_batches([batch])])
            if waiting.num_rows >= ROW_GROUP_ROWS:
                writer.write_table(waiting.slice(0, ROW_GROUP_ROWS).combine_chunks())
                waiting = waiting.slice(ROW_GROUP_ROWS)
        if waiting.num_rows:
            writer.write_table(waiting.combine_chunks())


def _batches(path: Path) -> Iterator[pa.RecordBatch]:
    """Yield a log's rows from either file."""
    with reading(path, _CONTENT):
        if path.name == DECISIONS_PARTIAL:
            yield from whole_batches(path, _is_ours)
            return
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            _check_columns(path, file.schema_arrow)
            yield from file.iter_batches()


def _label(action: Action | None) -> str:
    return NONE if action is None else action.label
