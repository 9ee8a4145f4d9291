"""Where the robot was: from a run's recording or, where it has none, from simulating it again."""

from __future__ import annotations

import itertools
import logging
import shlex
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from scla_mj.brain.registry import BRAINS
from scla_mj.engine.build import simulate
from scla_mj.engine.stored_run import StoredRun
from scla_mj.errors import SclaError
from scla_mj.signals import TRAJECTORY_COLUMNS, DecisionRecord
from scla_mj.telemetry.reading.series import DecisionSpikes, recorded_poses
from scla_mj.world.robot import PREFIX, Addresses, locate, robot_of

_LOG: Final = logging.getLogger(__name__)
_TIME: Final = TRAJECTORY_COLUMNS.index("time_s")
_ROOT: Final = slice(TRAJECTORY_COLUMNS.index("x_m"), TRAJECTORY_COLUMNS.index("qz") + 1)
_WHEELS: Final = [TRAJECTORY_COLUMNS.index(f"wheel_{side}_rad") for side in ("left", "right")]
_JUMP_M: Final = 0.02
"""Between two decisions, one control period apart, no robot drives so far: it was put down elsewhere."""


class Poses:
    """A model's qpos over a stretch of a run, and at any time between.

    Args:
        time_s: the run's time at n instants, in any order.
        decision, qpos: the decision (n,) and qpos (n, nq) then.
        at: where the robot's parts are in qpos.

    Attributes:
        time_s, decision, qpos: the same in the order of time.
        jumps: whether the robot was put down elsewhere between an instant and the next, (n - 1,).
    """

    def __init__(
        self, time_s: NDArray[np.float64], decision: NDArray[np.int64], qpos: NDArray[np.float64], at: Addresses
    ) -> None:
        self.time_s, first = np.unique(time_s, return_index=True)
        self.decision, self.qpos = decision[first], qpos[first]
        # On the way between two turns neither may be written as another, as it can: -q is q, and 2 pi is 0.
        turn = self.qpos[:, at.root_qpos + 3 : at.root_qpos + 7]
        turn[1:] *= np.cumprod(np.where((turn[1:] * turn[:-1]).sum(axis=1) < 0, -1.0, 1.0))[:, None]
        for wheel in (at.left_qpos, at.right_qpos):
            self.qpos[:, wheel] = np.unwrap(self.qpos[:, wheel])
        apart_m = np.linalg.norm(np.diff(self.qpos[:, at.root_qpos : at.root_qpos + 2], axis=0), axis=1)
        self.jumps = (np.diff(self.decision) > 0) & (apart_m > _JUMP_M)
        ends = [0, *(np.flatnonzero(self.jumps) + 1).tolist(), len(self.time_s)]
        self._starts_s = self.time_s[ends[:-1]]
        self._drives = [self._drive(slice(*pair)) for pair in itertools.pairwise(ends)]

    def _drive(self, part: slice) -> Callable[[float], NDArray[np.float64]]:
        """Return qpos by time, without overshooting any, between two jumps."""
        time_s, qpos = self.time_s[part], self.qpos[part]
        if len(time_s) == 1:
            return lambda _: qpos[0]
        curve = PchipInterpolator(time_s, qpos)
        return lambda at_s: np.asarray(curve(np.clip(at_s, time_s[0], time_s[-1])))

    def made(self, time_s: float) -> int:
        """Return the number of poses up to a time."""
        return int(np.searchsorted(self.time_s, time_s, side="right"))

    def at(self, time_s: float) -> NDArray[np.float64]:
        """Return qpos at a time: between two poses on the way from one to the other, before a jump the last one."""
        return self._drives[max(0, int(np.searchsorted(self._starts_s, time_s, side="right")) - 1)](time_s)


def stored_poses(run: StoredRun, decisions: range, model: Any) -> tuple[Poses, DecisionSpikes | None]:
    """Return a model's qpos over some decisions of a run, and their spikes if its brain has neurons.

    Raises:
        SclaError: the recording is damaged; or there is none, and the run cannot be simulated again.
    """
    if run.config.telemetry == "off":
        return _simulated_again(run, decisions, model)
    found = recorded_poses(run.recordings, decisions)
    robot = robot_of(run.checked)
    at = locate(model, robot)
    qpos = np.tile(model.qpos0, (len(found.time_s), 1))
    qpos[:, at.root_qpos : at.root_qpos + 7] = np.column_stack([found.position_m, found.quaternion])
    for wheel, address in zip(robot.wheels, (at.left_qpos, at.right_qpos), strict=True):
        qpos[:, address] = found.wheels_rad[PREFIX + wheel]
    spikes = None if run.anatomy is None else run.spikes(decisions)
    return Poses(found.time_s, found.decision, qpos, at), spikes


def _simulated_again(run: StoredRun, decisions: range, model: Any) -> tuple[Poses, DecisionSpikes | None]:
    if run.config.brain not in BRAINS:
        again = f"scla-mj rollout NEW --config {shlex.quote(str(run.path))} --telemetry light --brain ..."
        raise SclaError(f"{run.path} has no recording, and its brain is code of its own: `{again}` records it")
    last = decisions.stop - 1
    _LOG.info("%s has no recording: decisions 1 to %d are simulated again", run.path, last)
    simulation, at = simulate(run.config), locate(model, robot_of(run.checked))
    actions = run.decisions["action"].to_pylist()
    records: list[DecisionRecord] = []
    for number in range(1, decisions.stop):
        record = simulation.step(observe=number in decisions)
        if record.chosen.action.label != actions[number - 1]:
            raise SclaError(
                f"{run.path} has no recording, and decision {number} comes out differently here: install "
                "the package versions of its config.json, or record it anew"
            )
        if number in decisions:
            records.append(record)
    rows = np.concatenate([record.move.trajectory for record in records])
    numbers = np.repeat(np.arange(decisions.start, decisions.stop), [len(record.move.trajectory) for record in records])
    qpos = np.tile(model.qpos0, (len(rows), 1))
    qpos[:, at.root_qpos : at.root_qpos + 7] = rows[:, _ROOT]
    qpos[:, [at.left_qpos, at.right_qpos]] = rows[:, _WHEELS]
    return Poses(rows[:, _TIME], numbers, qpos, at), _spikes_of(run, records, decisions)


def _spikes_of(run: StoredRun, records: list[DecisionRecord], decisions: range) -> DecisionSpikes | None:
    """Return the spikes of the thinking windows, as a light recording has them."""
    step_s, found = run.checked.clock.neural_step_ms / 1000, []
    for number, record in zip(decisions, records, strict=True):
        if run.anatomy is not None and record.activity is not None:
            kept = slice(record.activity.thinking_spikes)
            neuron = record.activity.spike_neuron[kept].astype(np.int64)
            found.append(
                (record.time_s + record.activity.spike_step[kept] * step_s, neuron, np.full(len(neuron), number))
            )
    if run.anatomy is None or not found:
        return None
    time_s, neuron, decision = (np.concatenate(column) for column in zip(*found, strict=True))
    names = np.concatenate([np.full(population.size, population.name) for population in run.anatomy.populations])
    return DecisionSpikes(time_s, neuron, names[neuron], decision)
