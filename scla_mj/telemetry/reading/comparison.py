"""Compares what a recording says with the run's other files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from numpy.typing import NDArray

from scla_mj.anatomy import PROJECTION_NAMES
from scla_mj.paths import BRAIN_NPZ, CONFIG_JSON, DECISIONS_PARQUET, SUMMARY_JSON
from scla_mj.signals import Outcome, Snapshot
from scla_mj.telemetry.reading.reader import Inspection

_TIME_TOLERANCE_S: Final = 1e-6
"""A recording's times are whole nanoseconds."""
_MEAN_TOLERANCE: Final = 1e-4
"""Between the mean weight that the brain reported and the mean of its matrix: float32 rounding over 10,000 weights."""


_SETTINGS: Final = ("protocol", "seed", "telemetry")
_CEILING: Final = "ceiling_hits_per_1000"


class RunFiles(NamedTuple):
    """What the run's other files say, as plain values; None for a file that is not to be compared.

    `config` has seed, protocol, telemetry, cells, target, cell_size_m, thinking_window_s and jump, an epoch and a cell
    or None. `decisions` has `epochs`, `transitions`, `max_position_error_m` and `simulated_s` as `summary` has them,
    counted from the rows of decisions.parquet. `summary` is the content of summary.json, `brain` that of brain.npz.
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


def compare(inspection: Inspection, files: RunFiles) -> list[Comparison]:
    """Compare every figure that the recording and another file both have."""
    rows: list[Comparison] = []
    if files.config is not None:
        rows += _compare_config(inspection, files.config)
    if files.decisions is not None:
        rows += _compare_counts(DECISIONS_PARQUET, _counts(inspection), files.decisions)
    if files.summary is not None:
        rows += _compare_setting(inspection, files.summary)
        rows += _compare_counts(SUMMARY_JSON, _counts(inspection), files.summary)
    if files.brain is not None:
        rows += _compare_brain(inspection, files.brain)
    return rows


def compare_with_summary(files: RunFiles) -> list[Comparison]:
    """Compare every figure that summary.json and another file both have, of a run that was not recorded."""
    rows: list[Comparison] = []
    summary = files.summary
    if summary is not None and files.config is not None:
        settings = ("protocol", "seed", "cells", "target")
        rows += [_equal(CONFIG_JSON, what, summary[what], files.config[what]) for what in settings]
    if summary is not None and files.decisions is not None:
        rows += _compare_counts(DECISIONS_PARQUET, summary, files.decisions)
    return rows


def _counts(inspection: Inspection) -> dict[str, Any]:
    """Return a recording's counts as summary.json names them."""
    outcomes = inspection.outcomes
    return {
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


def _equal(file: str, what: str, recording: Any, run: Any) -> Comparison:
    return Comparison(file, what, _text(recording), _text(run), recording == run)


def _close(file: str, what: str, recording: float, run: float, tolerance: float = 0.0) -> Comparison:
    return Comparison(file, what, _text(recording), _text(run), math.isclose(recording, run, abs_tol=tolerance))


def _text(value: Any) -> str:
    if isinstance(value, tuple | list):
        return " ".join(_text(part) for part in value)
    if value is None:
        return "none"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _compare_config(inspection: Inspection, config: Mapping[str, Any]) -> list[Comparison]:
    known = inspection.properties
    rows = [_equal(CONFIG_JSON, what, known[what], config[what]) for what in _SETTINGS if what in known]
    rows += [_equal(CONFIG_JSON, what, tuple(known[what]), tuple(config[what])) for what in ("cells", "target")]
    rows += [_close(CONFIG_JSON, what, known[what], config[what]) for what in ("cell_size_m", "thinking_window_s")]
    last = inspection.epochs[-1].epoch if inspection.epochs else 0
    recorded = tuple((jump.epoch, *jump.target) for jump in inspection.jumps) or None
    jump = config["jump"]
    run = None if jump is None or jump[0] > last else ((jump[0], *jump[1]),)
    return [*rows, _equal(CONFIG_JSON, "jump of the target: epoch, x, y", recorded, run)]


def _compare_setting(inspection: Inspection, summary: Mapping[str, Any]) -> list[Comparison]:
    known = inspection.properties
    at_once = any(jump.epoch == 1 for jump in inspection.jumps)  # summary.json then has the target from before
    rows = [_equal(SUMMARY_JSON, what, known[what], summary[what]) for what in ("protocol", "seed") if what in known]
    places = ("cells",) if at_once else ("cells", "target")
    rows += [_equal(SUMMARY_JSON, what, tuple(known[what]), tuple(summary[what])) for what in places]
    rows.append(_close(SUMMARY_JSON, "ceiling, hits per 1000", known[_CEILING], summary[_CEILING]))
    for epoch, own in zip(inspection.epochs, summary["epochs"], strict=False):
        rows.append(_close(SUMMARY_JSON, f"epoch {epoch.epoch}, ceiling", epoch.ceiling_hits_per_1000, own[_CEILING]))
    return rows


def _compare_counts(file: str, reference: Mapping[str, Any], run: Mapping[str, Any]) -> list[Comparison]:
    expected, moves = reference["transitions"], run["transitions"]
    rows = _compare_epochs(file, reference["epochs"], run["epochs"])
    rows += [_equal(file, f"moves {what}", expected[what], moves[what]) for what in expected]
    error = "max_position_error_m"
    rows.append(_equal(file, "largest position error, m", reference[error], run[error]))
    rows.append(_close(file, "simulated time, s", reference["simulated_s"], run["simulated_s"], _TIME_TOLERANCE_S))
    return rows


def _compare_epochs(file: str, reference: list[Mapping[str, Any]], run: list[Mapping[str, Any]]) -> list[Comparison]:
    expected, found = ({int(own["epoch"]): own for own in epochs} for epochs in (reference, run))

    def of(epoch: Mapping[str, Any] | None) -> str:
        return "none" if epoch is None else f"{epoch['hits']} of {epoch['decisions']}"

    pairs = [(number, of(expected.get(number)), of(found.get(number))) for number in sorted(expected | found)]
    return [Comparison(file, f"epoch {number}, hits of decisions", one, two, one == two) for number, one, two in pairs]


def _compare_brain(inspection: Inspection, brain: Snapshot) -> list[Comparison]:
    rows = []
    for number, name in enumerate(PROJECTION_NAMES if brain.weights is not None and inspection.last_weights else ()):
        assert brain.weights is not None
        recorded, run = inspection.last_weights[name], float(brain.weights[number].mean(dtype=float))
        rows.append(_close(BRAIN_NPZ, f"last mean weight {name}", recorded, run, _MEAN_TOLERANCE))
    rows.append(_same_array("last weight matrices", inspection.weights, brain.weights))
    rows.append(_same_array("last action probabilities", inspection.probabilities, brain.probabilities))
    return rows


def _same_array(what: str, recorded: NDArray[Any] | None, run: NDArray[Any] | None) -> Comparison:
    if recorded is None or run is None:
        return Comparison(BRAIN_NPZ, what, _shape(recorded), _shape(run), recorded is run)
    same = recorded.shape == run.shape and recorded.dtype == run.dtype and recorded.tobytes() == run.tobytes()
    return Comparison(BRAIN_NPZ, what, _shape(recorded), _shape(run) if not same else "the same bits", same)


def _shape(array: NDArray[Any] | None) -> str:
    return "none" if array is None else " x ".join(map(str, array.shape)) + f" {array.dtype}"
