"""`brain.npz`: a brain's memory as plain numpy arrays. The same arrays give the same bytes; nothing is pickled."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import NEURONS_PER_SIDE, PROJECTION_NAMES
from scla_mj.errors import SclaError
from scla_mj.grid import Action
from scla_mj.paths import BRAIN_NPZ
from scla_mj.runs.atomic import reading, replacing
from scla_mj.signals import Snapshot, WeightCurve

WEIGHTS_SHAPE: Final = (len(PROJECTION_NAMES), NEURONS_PER_SIDE, NEURONS_PER_SIDE)
_HISTORY: Final = tuple(f"history_{name}" for name in WeightCurve._fields)
_MEMBERS: Final = ("weights", "projections", "probabilities", *_HISTORY)
_PROBABILITY_TOLERANCE: Final = 1e-6
"""Far above the rounding of four summed float64 numbers, far below any visible change of a policy."""


def write_brain(folder: Path, snapshot: Snapshot, history: WeightCurve | None = None) -> None:
    """Write `brain.npz`: `weights` (8, 100, 100), their `projections` (8,), `probabilities` (W, H, 4), those there are.

    The `history` of the mean weights, if it has any samples, is written as `history_decision`, `history_time_s` and
    `history_mean_weights`.

    Raises:
        SclaError: the folder cannot be written to.
    """
    arrays: dict[str, NDArray[Any]] = {}
    if snapshot.weights is not None:
        arrays["weights"] = snapshot.weights
        arrays["projections"] = np.array(PROJECTION_NAMES)
    if snapshot.probabilities is not None:
        arrays["probabilities"] = snapshot.probabilities
    if history is not None and len(history.decision):
        arrays |= dict(zip(_HISTORY, history, strict=True))
    with replacing(Path(folder) / BRAIN_NPZ) as scratch, scratch.open("wb") as file:
        np.savez(file, allow_pickle=False, **{name: np.asarray(array, order="C") for name, array in arrays.items()})


def read_brain(folder: Path) -> Snapshot:
    """Return the memory that a run's `brain.npz` holds.

    Raises:
        SclaError: the file is missing, damaged, or holds something else; the sentence names it.
    """
    path = Path(folder) / BRAIN_NPZ
    arrays = _read_members(path)
    snapshot = Snapshot(arrays.get("weights"), arrays.get("probabilities"))
    try:
        check_snapshot(snapshot)
    except SclaError as error:
        raise SclaError(f"{path} is damaged: {error}") from error
    if snapshot.weights is not None and tuple(arrays.get("projections", ())) != PROJECTION_NAMES:
        raise SclaError(f"{path}: projections must name the weights: {', '.join(PROJECTION_NAMES)}")
    return snapshot


def read_weight_history(folder: Path) -> WeightCurve | None:
    """Return the mean weights over the run that its `brain.npz` holds; None for a brain without synapses.

    Raises:
        SclaError: the file is missing or damaged.
    """
    path = Path(folder) / BRAIN_NPZ
    arrays = _read_members(path)
    if not arrays.keys() & set(_HISTORY):
        return None
    decision, time_s, means = (arrays.get(name, np.zeros(0)) for name in _HISTORY)
    sound = (
        decision.ndim == 1 and decision.shape == time_s.shape and means.shape == (len(decision), len(PROJECTION_NAMES))
    )
    if not (sound and np.issubdtype(decision.dtype, np.integer) and np.isfinite(means).all()):
        raise SclaError(f"{path} is damaged: the history of the mean weights must be (n,), (n,) and (n, 8)")
    return WeightCurve(decision, time_s, means)


def _read_members(path: Path) -> dict[str, NDArray[Any]]:
    with (
        reading(path, "numpy arrays"),
        path.open("rb") as stream,
        np.load(stream, allow_pickle=False) as archive,
    ):
        _check_members(path, archive)
        return {name: archive[name] for name in archive.files}


def _check_members(path: Path, archive: Any) -> None:
    """Refuse foreign members before they are read; ours are not compressed, so that none unpacks into gigabytes.

    Our archives begin with their first member: bytes before it belong to members that a damaged directory lost.
    """
    for name in archive.files:
        if name not in _MEMBERS:
            raise SclaError(
                f"{path} is not a brain file of scla-mj: it holds {name!r}, known are {', '.join(_MEMBERS)}"
            )
    offsets = [entry.header_offset for entry in archive.zip.infolist()]
    if min(offsets, default=archive.zip.start_dir) != 0:
        raise SclaError(f"{path} is damaged: its directory names {len(offsets)} arrays, and the file holds more")
    if any(entry.compress_type != zipfile.ZIP_STORED for entry in archive.zip.infolist()):
        raise SclaError(f"{path} is not a brain file of scla-mj: its arrays are compressed")


def check_snapshot(snapshot: Snapshot, cells: tuple[int, int] | None = None) -> None:
    """Refuse weights or action probabilities that `brain.npz` cannot hold; `cells` is (W, H) where the grid is known.

    Raises:
        SclaError: the sentence says what the array is and what it must be.
    """
    weights, probabilities = snapshot
    if weights is not None:
        kinds = (np.float32, np.float64)
        if not isinstance(weights, np.ndarray) or weights.shape != WEIGHTS_SHAPE or weights.dtype not in kinds:
            raise SclaError(f"weights are {_kind(weights)}, they must be floats of {WEIGHTS_SHAPE}")
        if not np.isfinite(weights).all():
            raise SclaError("every weight must be a finite number")
    if probabilities is not None:
        is_map = isinstance(probabilities, np.ndarray) and probabilities.dtype == np.float64 and probabilities.ndim == 3
        width, height = cells or (probabilities.shape[:2] if is_map else ("W", "H"))
        if not is_map or probabilities.shape != (width, height, len(Action)):
            wanted = f"float64 ({width}, {height}, {len(Action)})" if cells else "float64 (W, H, 4)"
            raise SclaError(f"probabilities are {_kind(probabilities)}, they must be {wanted}")
        sums_off = np.abs(probabilities.sum(axis=2) - 1.0)
        if not (probabilities.min(initial=0.0) >= 0.0 and sums_off.max(initial=0.0) <= _PROBABILITY_TOLERANCE):
            raise SclaError("every cell's probabilities must be 0 or more and sum to 1")


def _kind(values: Any) -> str:
    return f"{values.dtype} {values.shape}" if isinstance(values, np.ndarray) else type(values).__name__
