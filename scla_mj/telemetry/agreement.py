"""Sets what a recording alone says beside what the run's other files say."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from numpy.typing import NDArray

from scla_mj.anatomy import PROJECTION_NAMES
from scla_mj.signals import Outcome, Snapshot
from scla_mj.telemetry.reader import Inspection

_TIME_TOLERANCE_S: Final = 1e-6
"""A recording's times are whole nanoseconds."""
_MEAN_TOLERANCE: Final = 1e-4
"""Between the mean weight that the brain reported and the mean of its matrix: float32 rounding over 10,000 weights."""


class Comparison(NamedTuple):
    """One figure from the recording and from the run's files, as text, and whether they agree."""

    what: str
    recording: str
    run: str
    agrees: bool


def compare(inspection: Inspection, summary: Mapping[str, Any], brain: Snapshot) -> list[Comparison]:
    """Compare every figure that both have.

    Args:
        inspection: what the recording says.
        summary: the content of summary.json.
        brain: the content of brain.npz.
    """
    return [
        *_compare_setting(inspection, summary),
        *_compare_epochs(inspection, summary["epochs"]),
        *_compare_moves(inspection, summary),
        *_compare_brain(inspection, brain),
    ]


def _equal(what: str, recording: Any, run: Any) -> Comparison:
    return Comparison(what, _text(recording), _text(run), recording == run)


def _text(value: Any) -> str:
    if isinstance(value, tuple | list):
        return " ".join(_text(part) for part in value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _compare_setting(inspection: Inspection, summary: Mapping[str, Any]) -> list[Comparison]:
    known = inspection.properties
    rows = [_equal(what, known[what], summary[what]) for what in ("protocol", "seed") if what in known]
    rows += [_equal(what, tuple(known[what]), tuple(summary[what])) for what in ("cells", "target")]
    ceiling, run = known["ceiling_hits_per_1000"], summary["ceiling_hits_per_1000"]
    return [*rows, Comparison("ceiling, hits per 1000", _text(ceiling), _text(run), math.isclose(ceiling, run))]


def _compare_epochs(inspection: Inspection, epochs: list[Mapping[str, Any]]) -> list[Comparison]:
    recorded = {epoch.epoch: (epoch.hits, epoch.decisions) for epoch in inspection.epochs}
    run = {int(epoch["epoch"]): (int(epoch["hits"]), int(epoch["decisions"])) for epoch in epochs}

    def of(counts: dict[int, tuple[int, int]], epoch: int) -> str:
        return "{} of {}".format(*counts[epoch]) if epoch in counts else "none"

    return [
        Comparison(
            f"epoch {epoch}, hits of decisions",
            of(recorded, epoch),
            of(run, epoch),
            recorded.get(epoch) == run.get(epoch),
        )
        for epoch in sorted(recorded | run)
    ]


def _compare_moves(inspection: Inspection, summary: Mapping[str, Any]) -> list[Comparison]:
    moves = summary["transitions"]
    rows = [_equal("moves commanded", inspection.decisions, moves["commanded"])]
    for what, outcome in (("completed", Outcome.MOVED), ("blocked", Outcome.BLOCKED), ("failed", Outcome.FAILED)):
        rows.append(_equal(f"moves {what}", inspection.outcomes[outcome], moves[what]))
    rows.append(_equal("largest position error, m", inspection.max_position_error_m, summary["max_position_error_m"]))
    simulated_s, run_s = inspection.simulated_s, summary["simulated_s"]
    close = math.isclose(simulated_s, run_s, abs_tol=_TIME_TOLERANCE_S)
    return [*rows, Comparison("simulated time, s", _text(simulated_s), _text(run_s), close)]


def _compare_brain(inspection: Inspection, brain: Snapshot) -> list[Comparison]:
    rows = []
    for number, name in enumerate(PROJECTION_NAMES if brain.weights is not None and inspection.last_weights else ()):
        assert brain.weights is not None
        recorded, run = inspection.last_weights[name], float(brain.weights[number].mean(dtype=float))
        close = math.isclose(recorded, run, abs_tol=_MEAN_TOLERANCE)
        rows.append(Comparison(f"last mean weight {name}", _text(recorded), _text(run), close))
    rows.append(_same_array("last weight matrices", inspection.weights, brain.weights))
    rows.append(_same_array("last action probabilities", inspection.probabilities, brain.probabilities))
    return rows


def _same_array(what: str, recorded: NDArray[Any] | None, run: NDArray[Any] | None) -> Comparison:
    if recorded is None or run is None:
        return Comparison(what, _shape(recorded), _shape(run), recorded is run)
    same = recorded.shape == run.shape and recorded.dtype == run.dtype and recorded.tobytes() == run.tobytes()
    return Comparison(what, _shape(recorded), _shape(run) if not same else "the same bits", same)


def _shape(array: NDArray[Any] | None) -> str:
    return "none" if array is None else " x ".join(map(str, array.shape)) + f" {array.dtype}"
