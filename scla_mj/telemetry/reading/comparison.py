"""Compares what a recording, or without one a summary, says with the run's other files."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final, NamedTuple

from numpy.typing import NDArray

from scla_mj.anatomy import Anatomy
from scla_mj.paths import BRAIN_NPZ, CONFIG_JSON, DECISIONS_PARQUET, SUMMARY_JSON
from scla_mj.signals import Outcome, Snapshot
from scla_mj.telemetry.reading.reader import Inspection

_TIME_TOLERANCE_S: Final = 1e-6
"""A recording's times are whole nanoseconds."""
_MEAN_TOLERANCE: Final = 1e-4
"""Between the mean weight that the brain reported and the mean of its matrix: float32 rounding over 10,000 weights."""


_CEILING: Final = "ceiling_hits_per_1000"
_SETTINGS: Final = (
    "protocol",
    "seed",
    "telemetry",
    "cells",
    "target",
    "others",
    "cell_size_m",
    "thinking_window_s",
    _CEILING,
)


class RunFiles(NamedTuple):
    """What the run's other files say, as plain values; None for a file that is not to be compared.

    `config` has seed, protocol, telemetry, cells, target, others, cell_size_m, thinking_window_s, the `jumps`, each an
    epoch and where the first target is from then on, and the brain's anatomy. `decisions` has `epochs`, `transitions`,
    `max_position_error_m` and `simulated_s` as `summary` has them, counted from the rows of decisions.parquet, and the
    `spikes` of each motor population.
    `summary` is the content of summary.json, `brain` that of brain.npz.
    """

    config: Mapping[str, Any] | None = None
    decisions: Mapping[str, Any] | None = None
    summary: Mapping[str, Any] | None = None
    brain: Snapshot | None = None


class Comparison(NamedTuple):
    """One figure of one of the run's files and the same in the recording or, without one, in summary.json.

    Both are texts to be printed; `agrees` compares the figures themselves.
    """

    file: str
    what: str
    reference: str
    found: str
    agrees: bool


def compare(inspection: Inspection | None, files: RunFiles) -> list[Comparison]:
    """Compare every figure that the recording and another file both have; summary.json stands in for none."""
    rows: list[Comparison] = []
    reference = files.summary if inspection is None else _as_summary(inspection)
    if reference is None:
        return rows
    if files.config is not None:
        rows += _compare_settings(CONFIG_JSON, reference, files.config)
        if inspection is not None:
            rows.append(_compare_jumps(inspection, files.config["jumps"]))
            if "anatomy" in files.config:
                rows.append(_compare_anatomy(inspection.anatomy, files.config["anatomy"]))
    if files.decisions is not None:
        rows += _compare_counts(DECISIONS_PARQUET, reference, files.decisions)
        if inspection is not None:
            rows += _compare_spikes(inspection, files.decisions.get("spikes", {}))
    if inspection is not None and files.summary is not None:
        rows += _compare_summary(inspection, reference, files.summary)
    if inspection is not None and files.brain is not None:
        rows += _compare_brain(inspection, files.brain)
    return rows


def _as_summary(inspection: Inspection) -> dict[str, Any]:
    """Return a recording's properties, and its counts as summary.json names them."""
    outcomes = inspection.outcomes
    return inspection.properties | {
        "epochs": [epoch._asdict() for epoch in inspection.epochs],
        "transitions": {
            "commanded": inspection.decisions,
            "completed": outcomes[Outcome.MOVED],
            "blocked": outcomes[Outcome.BLOCKED],
            "failed": outcomes[Outcome.FAILED],
        },
        "max_position_error_m": inspection.max_position_error_m,
        "simulated_s": inspection.simulated_s,
    }


def _row(file: str, what: str, reference: Any, found: Any, tolerance: float = 0.0) -> Comparison:
    if isinstance(reference, float) and isinstance(found, float):
        agrees = math.isclose(reference, found, abs_tol=tolerance)
    else:
        agrees = _plain(reference) == _plain(found)
    return Comparison(file, what, _text(reference), _text(found), agrees)


def _plain(value: Any) -> Any:
    """Return a value of a file or a recording, which has lists of pairs as one list, so that both compare."""
    if not isinstance(value, Iterable) or isinstance(value, str):
        return value
    return tuple(number for part in value for number in (_plain(part) if isinstance(part, Iterable) else (part,)))


def _text(value: Any) -> str:
    if isinstance(value, tuple | list):
        return " ".join(_text(part) for part in value)
    if value is None:
        return "none"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _compare_settings(file: str, reference: Mapping[str, Any], run: Mapping[str, Any]) -> list[Comparison]:
    return [_row(file, what, reference[what], run[what]) for what in _SETTINGS if what in reference and what in run]


def _compare_jumps(inspection: Inspection, jumps: Sequence[tuple[int, int, int]]) -> Comparison:
    last = inspection.epochs[-1].epoch if inspection.epochs else 0
    recorded = tuple((jump.epoch, *jump.target) for jump in inspection.jumps) or None
    run = tuple(jump for jump in jumps if jump[0] <= last) or None
    return _row(CONFIG_JSON, "jump of the target: epoch, x, y", recorded, run)


def _compare_anatomy(recorded: Anatomy | None, run: Anatomy | None) -> Comparison:
    def text(anatomy: Anatomy | None) -> str:
        return "no neurons" if anatomy is None else f"{anatomy.neurons} neurons in {len(anatomy.populations)}"

    return Comparison(CONFIG_JSON, "anatomy: neurons in populations", text(recorded), text(run), recorded == run)


def _compare_spikes(inspection: Inspection, run: Mapping[str, int]) -> list[Comparison]:
    """Compare the motor populations' spikes; a brain that showed its activity now and then only is not compared."""
    recorded, rows = {own.name: own for own in inspection.populations}, []
    for name, spikes in run.items():
        own = recorded.get(name)
        if own is None or own.decisions == inspection.decisions:
            found = None if own is None else own.thinking_spikes
            rows.append(_row(DECISIONS_PARQUET, f"spikes {name} while thinking", found, spikes))
    return rows


def _compare_summary(
    inspection: Inspection, reference: Mapping[str, Any], summary: Mapping[str, Any]
) -> list[Comparison]:
    at_once = any(jump.epoch == 1 for jump in inspection.jumps)  # summary.json then has the target from before
    rows = _compare_settings(
        SUMMARY_JSON,
        reference,
        {what: summary[what] for what in summary if not (at_once and what in ("target", "others"))},
    )
    for epoch, own in zip(inspection.epochs, summary["epochs"], strict=False):
        rows.append(_row(SUMMARY_JSON, f"epoch {epoch.epoch}, ceiling", epoch.ceiling_hits_per_1000, own[_CEILING]))
    return rows + _compare_counts(SUMMARY_JSON, reference, summary)


def _compare_counts(file: str, reference: Mapping[str, Any], run: Mapping[str, Any]) -> list[Comparison]:
    expected, moves = reference["transitions"], run["transitions"]
    rows = _compare_epochs(file, reference["epochs"], run["epochs"])
    rows += [_row(file, f"moves {what}", expected[what], moves[what]) for what in expected]
    error = "max_position_error_m"
    rows.append(_row(file, "largest position error, m", reference[error], run[error]))
    rows.append(_row(file, "simulated time, s", reference["simulated_s"], run["simulated_s"], _TIME_TOLERANCE_S))
    return rows


def _compare_epochs(file: str, reference: list[Mapping[str, Any]], run: list[Mapping[str, Any]]) -> list[Comparison]:
    expected, found = ({int(own["epoch"]): own for own in epochs} for epochs in (reference, run))

    def of(epoch: Mapping[str, Any] | None) -> str:
        return "none" if epoch is None else f"{epoch['hits']} of {epoch['decisions']}"

    pairs = [(number, of(expected.get(number)), of(found.get(number))) for number in sorted(expected | found)]
    return [Comparison(file, f"epoch {number}, hits of decisions", one, two, one == two) for number, one, two in pairs]


def _compare_brain(inspection: Inspection, brain: Snapshot) -> list[Comparison]:
    rows = []
    weights = {} if inspection.anatomy is None else inspection.anatomy.by_projection(brain.weights)
    for name in weights if inspection.last_weights else ():
        recorded, run = inspection.last_weights[name], float(weights[name].mean(dtype=float))
        rows.append(_row(BRAIN_NPZ, f"last mean weight {name}", recorded, run, _MEAN_TOLERANCE))
    rows += [
        _same_array(f"last weights {name}", inspection.weights.get(name), weights.get(name))
        for name in dict.fromkeys([*weights, *inspection.weights])
    ]
    rows.append(_same_array("last action probabilities", inspection.probabilities, brain.probabilities))
    return rows


def _same_array(what: str, recorded: NDArray[Any] | None, run: NDArray[Any] | None) -> Comparison:
    if recorded is None or run is None:
        return Comparison(BRAIN_NPZ, what, _shape(recorded), _shape(run), recorded is run)
    same = recorded.shape == run.shape and recorded.dtype == run.dtype and recorded.tobytes() == run.tobytes()
    return Comparison(BRAIN_NPZ, what, _shape(recorded), _shape(run) if not same else "the same bits", same)


def _shape(array: NDArray[Any] | None) -> str:
    return "none" if array is None else " x ".join(map(str, array.shape)) + f" {array.dtype}"
