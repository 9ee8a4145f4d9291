"""What crosses each arrow of the loop: sense, think, decide, command, step physics, record. Plain immutable data."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    from typing import TypeAlias

    import numpy as np
    from numpy.typing import NDArray

    from scla_mj.grid import Action, Cell

    Weights: TypeAlias = NDArray[np.float32] | NDArray[np.float64] | dict[str, NDArray[Any]]


class Percept(NamedTuple):
    """What the robot senses: the cell it believes to be in, and the direction of a target in a neighbouring cell.

    `readings` are those of the brain's own sensors, by name (docs/extending.md).
    """

    cell: Cell
    sensed: Action | None
    readings: Mapping[str, Any] = MappingProxyType({})


class Decision(NamedTuple):
    """What a brain decided: the action, an automaton's advice if it gave one, and the spikes of its motor populations.

    `motor_spikes` are counted in the thinking window, one number per population of role "motor" in the brain's anatomy.
    """

    action: Action
    advised: Action | None = None
    motor_spikes: tuple[int, ...] | None = None


class Outcome(enum.StrEnum):
    """How a commanded move ended."""

    MOVED = "moved"
    BLOCKED = "blocked"
    FAILED = "failed"


TRAJECTORY_COLUMNS: Final = (
    "time_s", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz",
    "wheel_left_rad", "wheel_right_rad", "command_left_rad_s", "command_right_rad_s",
)  # fmt: skip


class Move(NamedTuple):
    """What the body did with one decision, from its physical pose.

    `trajectory` has one row per control period (none where nobody observes the move) and the columns of
    `TRAJECTORY_COLUMNS`; `time_s` counts from the run's start. `duration_s` is the drive alone, without the thinking
    window; `crossed_s` is the part of it until the axle crossed into the next cell, None for a move without one.
    `fallen` says that the robot cannot drive on from where it is (it lies, or is lost, or has failed too often in a
    row) and is put down somewhere else.
    """

    outcome: Outcome
    before: Cell
    after: Cell
    duration_s: float
    position_error_m: float
    heading_error_rad: float
    fallen: bool
    trajectory: NDArray[np.float64]
    crossed_s: float | None = None


class Feedback(NamedTuple):
    """What a brain learns from: what it sensed, decided and executed, how that ended, and what it senses now.

    `executed` differs from `action` only with action noise; the robot knows it from wheels and gyro. Both are in the
    brain's own directions: with crossed wheels the body goes the opposite way, and only `after` shows it. `crossed_s`
    is the time from the start of the drive at which the axle crossed into the next cell, None without a crossing.
    """

    before: Percept
    action: Action
    executed: Action
    outcome: Outcome
    after: Percept
    hit: bool
    crossed_s: float | None = None


class Activity(NamedTuple):
    """What a spiking brain did during one decision.

    `spike_step` counts neural steps from the decision's start and never falls; `spike_neuron` is the neuron's index.
    Neurons, populations and projections are those of the brain's `anatomy`, in its order.
    The first `thinking_spikes` spikes fell into the thinking window of `thinking_steps` steps. `mean_weights` are those
    at the decision's end, `dopamine` is what it released (one value per projection each). `counts`, (populations,)
    each, are every population's spikes in the thinking window and in the whole decision, from a brain that has counted
    them. `potentials`, (steps, watched), are the membrane potentials, mV, of the neurons that the anatomy's `watched`
    names, after each step of the thinking window, or of its beginning.
    """

    spike_step: NDArray[np.int32]
    spike_neuron: NDArray[np.int32]
    thinking_spikes: int
    thinking_steps: int
    steps: int
    mean_weights: NDArray[np.float64]
    dopamine: NDArray[np.float64]
    counts: tuple[NDArray[np.int64], NDArray[np.int64]] | None = None
    potentials: NDArray[np.float32] | NDArray[np.float64] | None = None


class Snapshot(NamedTuple):
    """A brain's memory: weights if it has synapses, action probabilities (W, H, 4) if it has automata, and `values`,
    (W, H) floats, of how good it finds each cell if it has an opinion; a recording shows them, no other file has them.

    `weights` are floats: one array whose first axis is the anatomy's projections, where all have one shape, such as the
    paper's (8, 100, 100); or a dict of an array per projection, by its name. They are read back as they were given.
    """

    weights: Weights | None = None
    probabilities: NDArray[np.float64] | None = None
    values: NDArray[np.float64] | None = None


class Localised(NamedTuple):
    """How far from the truth a robot believed to be when it decided, and whether it had the cell right."""

    error_m: float
    right_cell: bool


class DecisionRecord(NamedTuple):
    """One decision, whole: everything that a log or a recording may want, and nothing that can be written back.

    `epoch` and `decision` count from 1; `time_s` is the run's time when the thinking window opened. `executed` is the
    direction the body was sent in, `chosen.action` unless action noise replaced it or the wheels are crossed.
    `localised` is None where the robot knows its pose from the simulator.
    """

    epoch: int
    decision: int
    time_s: float
    percept: Percept
    chosen: Decision
    executed: Action
    move: Move
    hit: bool
    activity: Activity | None
    localised: Localised | None = None


class WeightCurve(NamedTuple):
    """Samples of the mean weights: the run's decision (n,), its time (n,) and the means (n, projections)."""

    decision: NDArray[np.int64]
    time_s: NDArray[np.float64]
    mean_weights: NDArray[np.float64]
