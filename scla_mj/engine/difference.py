"""In what two runs differ: their settings, their decisions to the bit, their summaries and their final brains."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from scla_mj.config import options_of

if TYPE_CHECKING:
    from scla_mj.engine.inspection import RunInspection

_EARNED: Final = ("epochs", "transitions", "max_position_error_m", "simulated_s", "localisation")
"""What a summary says besides the settings and the machine's own time, which no two runs share."""
_ARRAYS: Final = ("weights", "probabilities")
_STORED: Final = {"decisions": "decisions", "summary": "a summary", "brain": "weights or action probabilities"}
"""What a run stores of each part: no table of Q-learning's, for one."""


class DecisionDifference(NamedTuple):
    """The first decision that two runs do not share; `columns` has both values of each column that differs.

    Where one run ends earlier, and all of it is the same, `columns` is empty.
    """

    epoch: int
    decision: int
    columns: dict[str, tuple[Any, Any]]


class RunDifference(NamedTuple):
    """In what two runs differ: both values by name. Other versions of the packages do not count as a difference.

    `rows` are the numbers of decisions. `brains` names the arrays that differ, or that one of the two lacks. `absent`
    are the parts of which neither run stores anything to compare: decisions, summary, brain.
    """

    settings: dict[str, tuple[Any, Any]]
    versions: dict[str, tuple[Any, Any]]
    rows: tuple[int, int]
    decisions: DecisionDifference | None
    summary: dict[str, tuple[Any, Any]]
    brains: tuple[str, ...]
    absent: tuple[str, ...]

    @property
    def same(self) -> bool:
        """Return whether nothing differs."""
        return not (self.settings or self.decisions or self.summary or self.brains)

    def sentence(self) -> str:
        """Return in one line what differs, what is the same, and what neither run stores."""
        differing = {
            "settings": f"settings ({', '.join(self.settings)})" if self.settings else "",
            "decisions": self._where() if self.decisions else "",
            "summary": f"summary ({', '.join(self.summary)})" if self.summary else "",
            "brain": f"brain ({', '.join(self.brains)})" if self.brains else "",
        }
        same = [part for part, text in differing.items() if not text and part not in self.absent]
        stored = ", ".join(_STORED[part] for part in self.absent)
        unknown = f"; neither run stores {stored}" if stored else ""
        if self.same:
            said = ", ".join(f"{self.rows[0]} decisions" if part == "decisions" else part for part in same)
            return f"are the same to the bit: {said}{unknown}"
        alike = f"; the same: {', '.join(same)}" if same else ""
        return f"differ: {', '.join(filter(None, differing.values()))}{alike}{unknown}"

    def _where(self) -> str:
        assert self.decisions is not None
        first, (one, other) = self.decisions, self.rows
        ends = "" if one == other else f" ({one} and {other} of them)"
        return f"decisions from epoch {first.epoch}, decision {first.decision} on{ends}"


def compare_runs(one: RunInspection, other: RunInspection) -> RunDifference:
    """Compare two runs that are not damaged, as `inspect_run` returned them."""
    assert one.run is not None and other.run is not None
    held = {
        "decisions": one.made or other.made,
        "summary": one.summary or other.summary,
        "brain": any(_array(found, name) for found in (one, other) for name in _ARRAYS),
    }
    return RunDifference(
        settings=_differing(options_of(one.run.config), options_of(other.run.config)),
        versions=_differing(one.run.versions, other.run.versions),
        rows=(one.made, other.made),
        decisions=_first_difference(one.decisions, other.decisions),
        summary=_differing(_figures(one), _figures(other)),
        brains=tuple(name for name in _ARRAYS if _array(one, name) != _array(other, name)),
        absent=tuple(part for part, found in held.items() if not found),
    )


def _differing(one: dict[str, Any], other: dict[str, Any]) -> dict[str, tuple[Any, Any]]:
    names = dict.fromkeys([*one, *other])
    return {name: (one.get(name), other.get(name)) for name in names if one.get(name) != other.get(name)}


def _figures(found: RunInspection) -> dict[str, Any]:
    return {} if found.summary is None else {name: getattr(found.summary, name) for name in _EARNED}


def _array(found: RunInspection, name: str) -> Any:
    """Return what identifies the content of an array, or of each of a dict: its type, its shape and its bits."""
    values = None if found.brain is None else getattr(found.brain, name)
    arrays = values if isinstance(values, dict) else {} if values is None else {name: values}
    return {key: (array.dtype, array.shape, array.tobytes()) for key, array in arrays.items()}


def _first_difference(one: pa.Table | None, other: pa.Table | None) -> DecisionDifference | None:
    rows = [0 if table is None else table.num_rows for table in (one, other)]
    if one is None or other is None:
        longer = one if other is None else other
        return None if longer is None or not longer.num_rows else _difference_at(longer, None, 0)
    shared, columns = min(rows), [name for name in one.column_names if name in other.column_names]
    first = min((_first_in(one[name][:shared], other[name][:shared]) for name in columns), default=shared)
    if first < shared:
        return _difference_at(one, other, first)
    return None if rows[0] == rows[1] else _difference_at(one if rows[0] > rows[1] else other, None, shared)


def _first_in(one: pa.ChunkedArray, other: pa.ChunkedArray) -> int:
    """Return the first row in which two columns of one length differ to the bit, or their length."""
    one, other = _bits(one), _bits(other)
    differs = pc.or_(pc.xor(pc.is_null(one), pc.is_null(other)), pc.fill_null(pc.not_equal(one, other), False))
    first = pc.index(differs, True).as_py()
    return len(one) if first < 0 else int(first)


def _bits(column: pa.ChunkedArray) -> Any:
    """Return a column that compares to the bit: a NaN equals itself, and 0.0 is not -0.0."""
    return pa.array(column.to_numpy().view(np.int64)) if pa.types.is_float64(column.type) else column.combine_chunks()


def _difference_at(one: pa.Table, other: pa.Table | None, row: int) -> DecisionDifference:
    here = one.slice(row, 1).to_pylist()[0]
    there = here if other is None else other.slice(row, 1).to_pylist()[0]
    columns = {
        name: (here[name], there[name]) for name in here if name in there and repr(here[name]) != repr(there[name])
    }
    return DecisionDifference(here["epoch"], here["decision"], columns)
