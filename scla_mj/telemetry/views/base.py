"""What the views of a recording have in common: when they are called, their rows in time, their panels."""

from __future__ import annotations

import enum
import functools
from typing import Any, Final, NamedTuple

import numpy as np
import pyarrow as pa
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import ArrayLike, DTypeLike, NDArray

from scla_mj.anatomy import Anatomy, Population, Projection
from scla_mj.checked import CheckedConfig
from scla_mj.grid import Grid
from scla_mj.palette import HIT_COLOUR, OUTCOME_COLOURS, RGB, on_either
from scla_mj.signals import TRAJECTORY_COLUMNS, Activity, DecisionRecord, Snapshot
from scla_mj.telemetry import names
from scla_mj.telemetry.growable_array import GrowableArray

DECISION: Final = np.dtype(
    [
        ("start_s", np.float64),
        ("decided_s", np.float64),
        ("end_s", np.float64),
        ("decision", np.int64),
        ("epoch", np.int64),
        ("hit", np.bool_),
        ("outcome", np.uint8),
        ("thinks", np.bool_),
    ]
)
"""A decision as every view's `send` gets it: `decided_s` is the end of its window, `decision` counts over the whole run
from 1, `outcome` is one of `names.OUTCOME_CODES`, `thinks` says that the brain had an activity to record."""
Rows = NDArray[np.void]
"""Rows of `DECISION`."""

_COLOURS: Final = np.array([OUTCOME_COLOURS[outcome] for outcome in names.OUTCOME_CODES], np.uint8)

_TIME: Final = TRAJECTORY_COLUMNS.index("time_s")
_STRIPS: Final = {
    2: (rr.components.Position2DBatch, rr.components.LineStrip2DBatch([]).as_arrow_array().type),
    3: (rr.components.Position3DBatch, rr.components.LineStrip3DBatch([]).as_arrow_array().type),
}
_POSE_PERIOD_S: Final = 0.05
"""A recording keeps a pose about this often: 20 Hz still looks smooth."""

_DECISION_S: Final = 0.98
"""How long a decision takes on average: turns a range of seconds into one of decisions, for the other timeline."""
_SCROLL_S: Final = 60.0

LABEL_COLOUR: Final[RGB] = (255, 255, 255)
"""Of text in a view: Rerun draws it on a box of its own, which the light theme makes lighter than what is behind it."""

cursor: Final = rrb.TimeRangeBoundary.cursor_relative
WHOLE_RUN: Final = rrb.TimeAxis(
    view_range=rr.TimeRange(start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.infinite())
)


class RecordedRun:
    """What the views know of the run. `grid` and ceiling are those of its `epoch`, as the target may jump.

    `model` is a compiled `mujoco.MjModel` to draw. A brain without neurons has the `anatomy` None, and no `populations`
    and `projections`; what its `memory` at the start lacks, it never has.
    """

    def __init__(self, checked: CheckedConfig, model: Any, anatomy: Anatomy | None, memory: Snapshot) -> None:
        self.checked, self.config, self.clock, self.model = checked, checked.config, checked.clock, model
        self.memory = memory
        self.epoch, self.anatomy = 1, anatomy
        self.populations: tuple[Population, ...] = () if anatomy is None else anatomy.populations
        self.projections: tuple[Projection, ...] = () if anatomy is None else anatomy.projections
        self.sizes = np.array([population.size for population in self.populations], np.int64)
        self._starts = np.array([population.start for population in self.populations], np.int64)

    @property
    def grid(self) -> Grid:
        """The arena's cells, and the target's place in this epoch."""
        return self.checked.grid(self.epoch)

    @property
    def ceiling_hits_per_1000(self) -> float:
        """What the best policy earns in this epoch."""
        return self.checked.ceiling_hits_per_1000(self.epoch)

    @property
    def title(self) -> str:
        """Brain, protocol and seed: what tells this run from others."""
        return f"{self.config.brain.rpartition(':')[2]}, {self.config.protocol}, seed {self.config.seed}"

    def activity(self, record: DecisionRecord) -> Activity | None:
        """Return what the brain's neurons did, if it has any."""
        return None if self.anatomy is None else record.activity

    def count_spikes(self, activity: Activity) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return every population's spikes in the thinking window and in the whole decision."""
        if activity.counts is not None:
            return activity.counts
        # By neuron, then by population: half the time of looking every spike's population up.
        thinking, whole = (
            np.add.reduceat(np.bincount(neuron, minlength=int(self.sizes.sum())), self._starts)
            for neuron in (activity.spike_neuron[: activity.thinking_spikes], activity.spike_neuron)
        )
        return thinking, whole


class EpochCount(NamedTuple):
    """Decisions and hits of one epoch, and the ceiling that the hits are drawn against."""

    epoch: int
    decisions: int
    hits: int
    ceiling_hits_per_1000: float

    @property
    def hits_per_1000(self) -> float:
        """Hits per 1000 decisions."""
        return 1000 * self.hits / self.decisions


class Place(enum.Enum):
    """Where in the dashboard a panel stands: a tab, and there a column or a row."""

    NOW_LEFT = enum.auto()
    NOW_RIGHT = enum.auto()
    LEARNING_TOP = enum.auto()
    LEARNING_MIDDLE = enum.auto()
    LEARNING_BOTTOM = enum.auto()
    BRAIN_LEFT = enum.auto()
    BRAIN_RIGHT = enum.auto()
    LOG = enum.auto()


class Panel(NamedTuple):
    """A panel of the dashboard; `rank` orders those of one place, `share` is its part of the room."""

    place: Place
    content: Any
    rank: int = 9
    share: float = 1.0


class View:
    """One view of a recording. A subclass overrides what it needs; in this class every method does nothing.

    What `add` keeps in arrays from `gather` is cleared once `send` has sent it. Before `remember`, `end_epoch`,
    `move_target` and `stop` the stream's time is set to the end of the last decision.
    """

    def __init__(self, stream: rr.RecordingStream, run: RecordedRun) -> None:
        self.stream, self.run = stream, run
        self.gathered: list[GrowableArray] = []

    def gather(self, dtype: DTypeLike, *shape: int) -> GrowableArray:
        """Return a new array for what waits to be sent."""
        self.gathered.append(GrowableArray(dtype, shape))
        return self.gathered[-1]

    def panels(self) -> list[Panel]:
        """Return the view's panels in the dashboard."""
        return []

    def log_static(self) -> None:
        """Log what holds for the whole recording, such as colours and names."""

    def add(self, record: DecisionRecord, decision: int) -> None:
        """Take what is kept of one decision, by its number over the whole run."""

    def send(self, rows: Rows) -> None:
        """Send what was gathered of these decisions as columns, copied, since Rerun may still read it."""

    def remember(self, snapshot: Snapshot, decision: int, *, last: bool = False) -> None:
        """Log the brain's memory after a decision, 0 at the start; it is the `last` time in this file, or it is not."""

    def end_epoch(self, count: EpochCount) -> None:
        """Log the result of a whole epoch."""

    def move_target(self) -> None:
        """Draw the target where `run.grid` has it from now on, and the hits against its ceiling."""

    def stop(self, decisions: int) -> None:
        """Log that the run stops early, after so many decisions."""

    def state(self) -> dict[str, Any]:
        """Return everything that `restore` needs to continue in another file."""
        return {}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a `state`."""


def time_columns(time_s: ArrayLike, decision: NDArray[np.int64], epoch: NDArray[np.int64]) -> list[rr.TimeColumn]:
    """Return simulated time, decision (over the whole run, from 1) and epoch as index columns of equal length."""
    nanoseconds = np.round(np.asarray(time_s, float) * 1e9).astype("timedelta64[ns]")
    return [
        rr.TimeColumn(names.SIM_TIME, duration=nanoseconds),
        rr.TimeColumn(names.DECISION, sequence=decision),
        rr.TimeColumn(names.EPOCH, sequence=epoch),
    ]


def set_time(stream: rr.RecordingStream, time_s: float, decision: int, epoch: int) -> None:
    """Set all three for the next row that is logged on its own."""
    stream.set_time(names.SIM_TIME, duration=np.timedelta64(round(time_s * 1e9), "ns"))
    stream.set_time(names.DECISION, sequence=decision)
    stream.set_time(names.EPOCH, sequence=epoch)


def at(rows: Rows, *times: str) -> list[rr.TimeColumn]:
    """Return the index columns of a value per decision at its "start_s", "decided_s" or "end_s", or at several."""
    time_s = np.column_stack([rows[time] for time in times]).reshape(-1)
    return time_columns(time_s, np.repeat(rows["decision"], len(times)), np.repeat(rows["epoch"], len(times)))


def at_poses(rows: Rows, time_s: NDArray[np.float64], poses: NDArray[np.int64]) -> list[rr.TimeColumn]:
    """Return the index columns of a value per pose, of which each decision has `poses`."""
    return time_columns(time_s, np.repeat(rows["decision"], poses), np.repeat(rows["epoch"], poses))


@functools.lru_cache(maxsize=4096)
def kept_poses(periods: int, control_period_s: float) -> NDArray[np.intp]:
    """Return which of a move's control periods are kept as poses: 20 Hz, and always the one in which it ended."""
    kept = np.arange(0, periods, max(1, round(_POSE_PERIOD_S / control_period_s)))
    return np.union1d(kept, [periods - 1]) if periods else kept


def end_time_s(record: DecisionRecord) -> float:
    """Return when the decision's move ended, or when it began if nothing moved."""
    trajectory = record.move.trajectory
    return float(trajectory[-1, _TIME]) if len(trajectory) else record.time_s


def outcome_colours(rows: Rows) -> NDArray[np.uint8]:
    """Return the colour of how each decision ended, (n, 3)."""
    colours: NDArray[np.uint8] = _COLOURS[rows["outcome"]]
    colours[rows["hit"]] = HIT_COLOUR
    return colours


def line_strips(points: NDArray[np.float32], lengths: NDArray[np.int64]) -> Any:
    """Cut points, (n, 2) or (n, 3), into line strips, as Arrow's list of them: Rerun takes any other strip by strip."""
    batch, strip = _STRIPS[points.shape[1]]
    ends = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int32)
    return pa.ListArray.from_arrays(pa.array(ends), batch(points).as_arrow_array(), type=strip)


def send_scalars(stream: rr.RecordingStream, entity: str, index: list[rr.TimeColumn], values: ArrayLike) -> None:
    """Send a curve."""
    stream.send_columns(entity, index, rr.Scalars.columns(scalars=np.array(values, np.float64)))


def log_line(stream: rr.RecordingStream, entity: str, colour: RGB, name: str, width: float) -> None:
    """Log how a curve looks."""
    stream.log(entity, rr.SeriesLines(colors=[on_either(colour)], names=[name], widths=[width]), static=True)


def log_points(stream: rr.RecordingStream, entity: str, colour: RGB, name: str, *, marker: str = "circle") -> None:
    """Log how a value per decision looks that has nothing to do with the one before: as points."""
    look = rr.SeriesPoints(colors=[on_either(colour)], names=[name], markers=[marker], marker_sizes=[3.0])
    stream.log(entity, look, static=True)


def last(seconds: float) -> list[rrb.VisibleTimeRange]:
    """The stretch before the cursor, on either timeline: without the second, switching to it costs seconds a frame."""
    decisions = max(1, round(seconds / _DECISION_S))
    return [
        rrb.VisibleTimeRange(names.SIM_TIME, start=cursor(seconds=-seconds), end=cursor()),
        rrb.VisibleTimeRange(names.DECISION, start=cursor(seq=-decisions), end=cursor()),
    ]


def curves(
    contents: list[str], name: str, *, corner: rrb.Corner2D = rrb.Corner2D.LeftTop, legend: bool = True, **more: Any
) -> rrb.TimeSeriesView:
    """Return a panel of curves."""
    plot_legend = rrb.PlotLegend(corner=corner, visible=legend)
    return rrb.TimeSeriesView(origin="/", contents=contents, name=name, plot_legend=plot_legend, **more)


def scrolling_curves(contents: list[str], name: str, **more: Any) -> rrb.TimeSeriesView:
    """Return a panel of the last minute. An axis of its own in seconds would show nothing on the other timeline."""
    return curves(contents, name, time_ranges=last(_SCROLL_S), **more)
