"""`scla-mj export RUN --parquet FOLDER`: spikes, poses and weights as plain tables (docs/export.md)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from scla_mj.engine.stored_run import StoredRun
from scla_mj.errors import SclaError
from scla_mj.runs.atomic import replacing, writing


def make_empty_folder(folder: Path) -> None:
    """Make the folder unless it is there.

    Raises:
        SclaError: it holds something already or cannot be made.
    """
    with writing(folder, folder="FOLDER", refusal=f"{folder} is a file, not a folder: choose another FOLDER"):
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise SclaError(f"{folder} is not empty: choose another FOLDER, nothing is overwritten")


def write_parquet(run: StoredRun, folder: Path) -> list[Path]:
    """Write a table for each kind of data into a new folder; return their paths.

    Raises:
        SclaError: the folder holds something already or cannot be written to, or the recording is damaged.
    """
    make_empty_folder(folder)
    written = []
    for name, table in tables(run):
        path = folder / f"{name}.parquet"
        with replacing(path, taken=f"{path} is there already: choose another FOLDER", folder="FOLDER") as scratch:
            pq.write_table(table, scratch, compression="zstd")
        written.append(path)
    return written


def tables(run: StoredRun) -> Iterator[tuple[str, pa.Table]]:
    """Yield the tables by their names; a brain without neurons has no spikes, one without synapses no weights."""
    yield "decisions", run.decisions
    poses = run.trajectory()
    x, y, z = poses.position_m.T
    columns = {"decision": poses.decision, "time_s": poses.time_s, "x_m": x, "y_m": y, "z_m": z}
    yield "poses", pa.table(columns | {"heading_rad": poses.heading_rad})
    if run.anatomy is None:
        return
    spikes = run.spikes()
    population = pa.array(spikes.population).dictionary_encode()
    yield "spikes", pa.table(spikes._asdict() | {"population": population})
    if run.brain.weights is not None:
        history = run.weight_history
        means = dict(zip(run.anatomy.projection_names, history.mean_weights.T, strict=True))
        yield "mean_weights", pa.table({"decision": history.decision, "time_s": history.time_s} | means)
        weights = run.anatomy.by_projection(run.brain.weights)
        yield "weights", pa.concat_tables(_synapses(*own) for own in weights.items())


def _synapses(name: str, weights: NDArray[Any]) -> pa.Table:
    """Return a row for every synapse; of a list of synapses the neurons are not known, but the place in the list is."""
    table = {"projection": pa.DictionaryArray.from_arrays(np.zeros(weights.size, np.int32), [name])}
    ends: Any = np.indices(weights.shape, np.int32).reshape(weights.ndim, -1)
    if weights.ndim != 2:
        ends = [pa.nulls(weights.size, pa.int32())] * 2
    columns = {"place": np.arange(weights.size, dtype=np.int32), "presynaptic": ends[0], "postsynaptic": ends[1]}
    return pa.table(table | columns | {"weight": weights.ravel()}).unify_dictionaries()
