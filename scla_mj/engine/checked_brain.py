"""A user's own brain, every answer checked: a mistake in it ends in one sentence that says where to look."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from numbers import Integral
from typing import Any, Final, NoReturn

import numpy as np

from scla_mj.anatomy import Anatomy, motors_of
from scla_mj.brain.base import Brain
from scla_mj.brain.registry import can_be_resumed
from scla_mj.brain.users_code import shown, users_code
from scla_mj.errors import SclaError
from scla_mj.grid import Action
from scla_mj.runs.brain import check_snapshot
from scla_mj.runs.checkpoint import check_state
from scla_mj.signals import Activity, Decision, Feedback, Percept, Snapshot

_MOST_SPIKES: Final = 2**31
"""Spike counts go into 32-bit columns."""


class CheckedBrain(Brain):
    """Passes everything on to `brain`; what it raises and what it answers wrongly become a `SclaError`."""

    def __init__(self, brain: Brain, name: str, *, cells: tuple[int, int]) -> None:
        self._brain = brain
        self._name = name
        self._cells = cells
        with users_code(f"--brain {name}: its anatomy raised"):
            anatomy = brain.anatomy
        if not (anatomy is None or isinstance(anatomy, Anatomy)):
            raise SclaError(f"--brain {name}: its anatomy must be an Anatomy or None, not {shown(anatomy)}")
        self.anatomy = anatomy
        with users_code(f"--brain {name}: its sensors raised"):
            if not isinstance(brain.sensors, Mapping):
                raise SclaError(
                    f"--brain {name}: its sensors must be a dict of functions by name, not {shown(brain.sensors)}"
                )
            self.sensors = {sensor: functools.partial(self._read, sensor) for sensor in brain.sensors}

    def __getattr__(self, name: str) -> Any:
        """Return what else the brain has, such as its `network`."""
        if name.startswith("_"):
            raise AttributeError(name)
        return getattr(self._brain, name)

    def decide(self, percept: Percept) -> Decision:
        """Return the brain's decision, its spike counts as a tuple of int."""
        with self._asking("decide") as decide:
            return self._decision(decide(percept))

    def _decision(self, decision: object) -> Decision:
        if not isinstance(decision, Decision):
            self._refuse("decide", "return a Decision, such as Decision(Action.UP)", decision)
        action, advised, spikes = decision
        if not isinstance(action, Action):
            self._refuse("decide", "return a Decision whose action is an Action, such as Action.UP", action)
        if advised is not None and not isinstance(advised, Action):
            self._refuse("decide", "return a Decision whose advised is an Action or None", advised)
        return decision if spikes is None else decision._replace(motor_spikes=self._spikes(spikes))

    def learn(self, feedback: Feedback) -> None:
        """Pass the feedback on."""
        with self._asking("learn") as learn:
            learn(feedback)

    def elapse(self, duration_s: float) -> None:
        """Pass the time on."""
        with self._asking("elapse") as elapse:
            elapse(duration_s)

    def activity(self) -> Activity | None:
        """Return the brain's activity, if it is one or None."""
        with self._asking("activity") as activity:
            return self._activity(activity())

    def _activity(self, activity: object) -> Activity | None:
        if activity is None:
            return None
        if not isinstance(activity, Activity):
            self._refuse("activity", "return an Activity or None", activity)
        if self.anatomy is None:
            self._refuse("activity", "return None, or its class name its neurons: anatomy = Anatomy(...)", activity)
        self._check_spikes(activity, self.anatomy.neurons)
        projections = len(self.anatomy.projections)
        for part in ("mean_weights", "dopamine"):
            values = getattr(activity, part)
            if not (_is_array(values, (projections,), np.floating) and np.isfinite(values).all()):
                self._refuse("activity", f"return {part} as {projections} finite floats, a projection each", values)
        potentials: Any = activity.potentials
        watched = len(self.anatomy.watched)
        if watched or potentials is not None:
            shape = np.shape(potentials)
            fits = len(shape) == 2 and shape[0] <= activity.thinking_steps and shape[1] == watched
            if not (fits and _is_array(potentials, shape, np.floating) and np.isfinite(potentials).all()):
                wanted = f"({activity.thinking_steps}, {watched}) finite floats, a column for each watched neuron"
                self._refuse("activity", f"return potentials as {wanted}", potentials)
        return activity._replace(counts=None)  # they are counted from the spikes, which have been looked at

    def snapshot(self) -> Snapshot:
        """Return the brain's memory, if its files can hold it."""
        with self._asking("snapshot") as snapshot:
            return self._snapshot(snapshot())

    def _snapshot(self, snapshot: object) -> Snapshot:
        if not isinstance(snapshot, Snapshot):
            self._refuse("snapshot", "return a Snapshot", snapshot)
        try:
            if self.anatomy is None and snapshot.weights is not None:
                raise SclaError("weights are of projections, which its anatomy must name")
            check_snapshot(snapshot, self._cells, anatomy=self.anatomy)
        except SclaError as error:
            raise SclaError(f"--brain {self._name}: its snapshot() must fit brain.npz: {error}, or be None") from error
        return snapshot

    def state(self) -> dict[str, Any] | None:
        """Return the brain's state, if a checkpoint can hold it; None where the brain lacks one of the two methods."""
        if not can_be_resumed(type(self._brain)):
            return None
        with self._asking("state") as ask:
            state: dict[str, Any] = ask()
            try:
                check_state(state)
            except SclaError as error:
                raise SclaError(
                    f"--brain {self._name}: its state() returns what no checkpoint can hold: {error}"
                ) from error
            return state

    def restore(self, state: dict[str, Any]) -> None:
        """Pass the state on."""
        with self._asking("restore") as restore:
            restore(state)

    @contextlib.contextmanager
    def _asking(self, method: str) -> Iterator[Callable[..., Any]]:
        """Yield the brain's method; what it raises, and what looking at its answer raises, is the brain's mistake."""
        with users_code(f"--brain {self._name}: its {method}() raised"):
            yield getattr(self._brain, method)

    def _read(self, sensor: str, world: Any) -> Any:
        with users_code(f"--brain {self._name}: its sensor {sensor} raised"):
            return self._brain.sensors[sensor](world)

    def _refuse(self, method: str, wanted: str, got: Any) -> NoReturn:
        raise SclaError(f"--brain {self._name}: its {method}() must {wanted}; it gave {shown(got)}")

    def _spikes(self, counts: Any) -> tuple[int, ...]:
        motors = motors_of(self.anatomy)
        if (
            not isinstance(counts, Sequence | np.ndarray)
            or len(counts) != len(motors)
            or not all(isinstance(count, Integral) and 0 <= int(count) < _MOST_SPIKES for count in counts)
        ):
            of = f"a count for each population of role motor ({' '.join(motors)}) or None"
            wanted = of if motors else "None, as its anatomy has no population of role motor"
            self._refuse("decide", f"return a Decision whose motor_spikes are {wanted}", counts)
        return tuple(int(count) for count in counts)

    def _check_spikes(self, activity: Activity, neuron_count: int) -> None:
        steps, neurons = activity.spike_step, activity.spike_neuron
        for part, values in (("spike_step", steps), ("spike_neuron", neurons)):
            if not (_is_array(values, np.shape(steps)[:1], np.integer) and values.ndim == 1):
                self._refuse("activity", f"return {part} as a flat integer array, a spike each", values)
        if len(neurons) and (neurons.min() < 0 or neurons.max() >= neuron_count):
            self._refuse("activity", f"return spike_neuron as indices from 0 to {neuron_count - 1}", neurons)
        counts = (activity.thinking_spikes, activity.thinking_steps, activity.steps)
        if not all(isinstance(count, Integral) for count in counts) or not (
            0 <= counts[0] <= len(steps) and 0 < counts[1] <= counts[2]
        ):
            wanted = "return thinking_spikes of at most the spikes' number, and thinking_steps of 1 to steps"
            self._refuse("activity", wanted, counts)
        if len(steps) and (steps[0] < 0 or steps[-1] >= counts[2] or (np.diff(steps) < 0).any()):
            self._refuse("activity", "return spike_step from 0 to below steps, never falling", steps)


def _is_array(values: Any, shape: tuple[int, ...], kind: Any) -> bool:
    return isinstance(values, np.ndarray) and values.shape == shape and np.issubdtype(values.dtype, kind)
