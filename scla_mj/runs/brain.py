"""`brain.npz`: a brain's memory as plain numpy arrays. The same arrays give the same bytes; nothing is pickled."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import Anatomy
from scla_mj.errors import SclaError
from scla_mj.grid import Action
from scla_mj.paths import BRAIN_NPZ
from scla_mj.runs.atomic import reading, replacing
from scla_mj.signals import Snapshot, WeightCurve

_HISTORY: Final = tuple(f"history_{name}" for name in WeightCurve._fields)
_MEMBERS: Final = ("weights", "projections", "probabilities", *_HISTORY)
_OF_ONE: Final = "weights_"
"""Begins the name of the array of one projection's weights, where each has a shape of its own."""
_PROBABILITY_TOLERANCE: Final = 1e-6
"""Far above the rounding of four summed float64 numbers, far below any visible change of a policy."""


def write_brain(
    folder: Path, snapshot: Snapshot, history: WeightCurve | None = None, *, anatomy: Anatomy | None
) -> None:
    """Write `brain.npz`: `weights`, the names of their `projections` and `probabilities` (W, H, 4), those there are.

    The `anatomy` names the projections. Weights that are a dict are written as `weights_NAME` each. The `history` of
    the mean weights, if it has any samples, is written as `history_decision`, `history_time_s` and
    `history_mean_weights`.

    Raises:
        SclaError: the folder cannot be written to.
    """
    arrays: dict[str, NDArray[Any]] = {}
    projections = () if anatomy is None else anatomy.projection_names
    if isinstance(snapshot.weights, dict):
        arrays |= {_OF_ONE + name: snapshot.weights[name] for name in projections}
    elif snapshot.weights is not None:
        arrays["weights"] = snapshot.weights
    kept = history is not None and len(history.decision)
    if snapshot.weights is not None or kept:
        arrays["projections"] = np.array(projections)
    if snapshot.probabilities is not None:
        arrays["probabilities"] = snapshot.probabilities
    if history is not None and kept:
        arrays |= dict(zip(_HISTORY, history, strict=True))
    with replacing(Path(folder) / BRAIN_NPZ) as scratch, scratch.open("wb") as file:
        np.savez(file, allow_pickle=False, **{name: np.asarray(array, order="C") for name, array in arrays.items()})


def read_brain(folder: Path, anatomy: Anatomy | None = None) -> Snapshot:
    """Return the memory that a run's `brain.npz` holds; of a known `anatomy`, its weights must fit that.

    Raises:
        SclaError: the file is missing, damaged, or holds something else; the sentence names it.
    """
    path = Path(folder) / BRAIN_NPZ
    arrays = _read_members(path)
    names = _projections(arrays)
    each = {name: arrays[_OF_ONE + name] for name in names if _OF_ONE + name in arrays}
    snapshot = Snapshot(each or arrays.get("weights"), arrays.get("probabilities"))
    if anatomy is not None and snapshot.weights is not None and names != anatomy.projection_names:
        raise SclaError(f"{path}: projections must name the weights: {', '.join(anatomy.projection_names)}")
    try:
        _check_names(arrays, names)
        check_snapshot(snapshot, anatomy=anatomy)
    except SclaError as error:
        raise SclaError(f"{path} is damaged: {error}") from error
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
    shape = len(decision) if decision.ndim == 1 else -1, len(_projections(arrays))
    sound = decision.shape == time_s.shape and means.shape == shape
    if not (sound and np.issubdtype(decision.dtype, np.integer) and np.isfinite(means).all()):
        raise SclaError(f"{path} is damaged: the history of the mean weights must be (n,), (n,) and (n, {shape[1]})")
    return WeightCurve(decision, time_s, means)


def _projections(arrays: dict[str, NDArray[Any]]) -> tuple[str, ...]:
    names = arrays.get("projections", np.zeros(0, str))
    return tuple(map(str, names.ravel().tolist()))


def _check_names(arrays: dict[str, NDArray[Any]], names: tuple[str, ...]) -> None:
    """Refuse weights that nothing names: one array has a row for every name, or each name has an array."""
    each = {name.removeprefix(_OF_ONE) for name in arrays if name.startswith(_OF_ONE)}
    rows = len(arrays["weights"]) if "weights" in arrays and arrays["weights"].ndim else None
    if (each and each != set(names)) or (rows is not None and rows != len(names)):
        raise SclaError(f"it holds other weights than those of its projections, {', '.join(names) or 'none'}")


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
        if name not in _MEMBERS and not name.startswith(_OF_ONE):
            raise SclaError(
                f"{path} is not a brain file of scla-mj: it holds {name!r}, known are {', '.join(_MEMBERS)}"
            )
    offsets = [entry.header_offset for entry in archive.zip.infolist()]
    if min(offsets, default=archive.zip.start_dir) != 0:
        raise SclaError(f"{path} is damaged: its directory names {len(offsets)} arrays, and the file holds more")
    if any(entry.compress_type != zipfile.ZIP_STORED for entry in archive.zip.infolist()):
        raise SclaError(f"{path} is not a brain file of scla-mj: its arrays are compressed")


def check_snapshot(snapshot: Snapshot, cells: tuple[int, int] | None = None, *, anatomy: Anatomy | None = None) -> None:
    """Refuse weights or action probabilities that `brain.npz` cannot hold, and values that cannot be shown.

    `cells` is (W, H) where the grid is known, the weights have the shapes of the `anatomy` where that is.

    Raises:
        SclaError: the sentence says what the array is and what it must be.
    """
    weights, probabilities, values = snapshot
    if weights is not None:
        _check_weights(weights, anatomy)
    if probabilities is not None:
        is_map = isinstance(probabilities, np.ndarray) and probabilities.dtype == np.float64 and probabilities.ndim == 3
        width, height = cells or (probabilities.shape[:2] if is_map else ("W", "H"))
        if not is_map or probabilities.shape != (width, height, len(Action)):
            wanted = f"float64 ({width}, {height}, {len(Action)})" if cells else "float64 (W, H, 4)"
            raise SclaError(f"probabilities are {_kind(probabilities)}, they must be {wanted}")
        sums_off = np.abs(probabilities.sum(axis=2) - 1.0)
        if not (probabilities.min(initial=0.0) >= 0.0 and sums_off.max(initial=0.0) <= _PROBABILITY_TOLERANCE):
            raise SclaError("every cell's probabilities must be 0 or more and sum to 1")
    if values is not None:
        _check_floats("values", values, cells)


def _check_weights(weights: Any, anatomy: Anatomy | None) -> None:
    if isinstance(weights, dict):
        if anatomy is not None and weights.keys() != set(anatomy.projection_names):
            named = ", ".join(anatomy.projection_names) or "none"
            raise SclaError(f"weights are of {', '.join(map(str, weights)) or 'none'}, the projections are {named}")
        for name, array in weights.items():
            shapes = {} if anatomy is None else {item.name: item.shape for item in anatomy.projections}
            _check_floats(f"weights of {name}", array, shapes.get(name))
        return
    shape = None
    if anatomy is not None:
        common = {projection.shape for projection in anatomy.projections}
        if len(common) != 1:
            raise SclaError(f"weights are {_kind(weights)}, they must be a dict with an array for each projection")
        shape = len(anatomy.projections), *common.pop()
    _check_floats("weights", weights, shape)


def _check_floats(what: str, array: Any, shape: tuple[int, ...] | None) -> None:
    floats = isinstance(array, np.ndarray) and array.dtype in (np.float32, np.float64) and array.ndim > 0
    if not floats or (shape is not None and array.shape != shape):
        raise SclaError(f"{what} are {_kind(array)}, they must be floats{'' if shape is None else f' of {shape}'}")
    if not np.isfinite(array).all():
        raise SclaError(f"{what} must be finite numbers")


def _kind(values: Any) -> str:
    return f"{values.dtype} {values.shape}" if isinstance(values, np.ndarray) else type(values).__name__
