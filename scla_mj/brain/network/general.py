"""A network of any description: run it, release modulators, read and set weights, watch neurons and synapses."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scla_mj.brain.network import general_kernel
from scla_mj.brain.network.description import NetworkDescription
from scla_mj.brain.network.inputs import fill
from scla_mj.brain.network.recorded import Monitor, SpikeTrains, Watch
from scla_mj.brain.network.weights import SYNAPSE_VARIABLES, Connections
from scla_mj.brain.network.wiring import STATE
from scla_mj.errors import SclaError
from scla_mj.randomness import require_seed
from scla_mj.restoring import restore_whole
from scla_mj.validation import shown

_NEURON_VARIABLES: Final = {"v": general_kernel.V, "u": general_kernel.U}
_TRACES: Final = {"x": general_kernel.PRE_TRACE, "y": general_kernel.POST_TRACE}
_VARIABLES: Final = "v, u, x, x1, y, y1, weight, eligibility"

Drive = ArrayLike | Mapping[str, ArrayLike]


class GeneralNetwork(Connections):
    """A network built from a description; `Network.from_description` makes one.

    Args:
        description: populations, projections, modulators; checked here.
        seed: of connections, weights and noise.

    Attributes:
        description: as checked, with every projection's name and every modulator.
        populations: where each population's neurons begin and end, by `name`, `start`, `stop`.
        memory: the state and the anatomy as the kernel keeps them (wiring.py).

    Raises:
        SclaError: the description does not fit together.

    Example:
        >>> a, b = Neurons("a", 100, noise=5.0), Neurons("b", 10)
        >>> network = Network.from_description(NetworkDescription([a, b], [Synapses("a", "b", 2.0)]), seed=0)
        >>> spikes = network.run(1000.0, {"a": 5.0})
        >>> spikes["b"].time_ms  # the spikes of population b
    """

    def __init__(self, description: NetworkDescription, *, seed: int = 0) -> None:
        require_seed(seed)
        super().__init__(description, seed=seed)
        self._own_drive = np.repeat([p.drive for p in self.description.populations], [p.size for p in self.populations])
        self._own_drive = self._own_drive.astype(self.memory.v.dtype)
        self._watch = Watch()

    @property
    def time_ms(self) -> float:
        """Network time since it began."""
        return float(self._steps * self.description.step_ms)

    def run(self, duration_ms: float, drive: Drive | None = None) -> SpikeTrains:
        """Run under constant currents, beyond the populations' own drive, and return the spikes.

        Args:
            duration_ms: a whole number of steps.
            drive: (N,), or for populations by name a number or one for each of its neurons.

        Raises:
            SclaError: an argument is not valid, or a membrane potential is no longer finite.
        """
        begin_ms, step_ms = self.time_ms, self.description.step_ms
        self.advance(self._in_steps("duration_ms", duration_ms), self.currents(drive))
        spikes = self.spikes()
        counts = dict(zip((p.name for p in self.populations), spikes.counts.tolist(), strict=True))
        time_ms = begin_ms + spikes.step.astype(np.float64) * step_ms
        return SpikeTrains(time_ms, spikes.neuron, counts, self._window_steps * step_ms, self.populations)

    def currents(self, drive: Drive | None) -> ArrayLike | None:
        """Return a drive as one current for each neuron, (N,)."""
        if not isinstance(drive, Mapping):
            return drive
        currents = np.zeros(self.description.size)
        for name, values in drive.items():
            population = next((p for p in self.populations if p.name == name), None)
            if population is None:
                known = ", ".join(p.name for p in self.populations)
                raise SclaError(f"drive names {shown(name)}, which is no population: known are {known}")
            own = currents[population.start : population.stop]
            fill(f"drive of {name}", own, np.broadcast_to(values, own.shape) if np.ndim(values) == 0 else values)
        return currents

    def release(self, amount: float | Mapping[str, float], *, delay_ms: float = 0.0) -> None:
        """Add a signed amount to every modulator, or to each of those that are named, now or after some time.

        Raises:
            SclaError: a name is unknown, or a number is not valid.
        """
        names = [modulator.name for modulator in self.description.modulators]
        if not names:
            raise SclaError("this network has no modulator to release: give it a plastic projection or a Modulator")
        amounts = dict.fromkeys(names, amount) if not isinstance(amount, Mapping) else amount
        for name in amounts:
            if name not in names:
                raise SclaError(f"amount names {shown(name)}, which is no modulator: known are {', '.join(names)}")
        delay_steps = self._in_steps("delay_ms", delay_ms)
        self.release_dopamine([amounts.get(name, 0.0) for name in names], delay_steps=delay_steps)

    @property
    def dopamine(self) -> NDArray[np.float64]:
        """The concentration at each plastic projection, in their order."""
        return np.array([self.modulators[projection.modulator] for projection in self.description.plastic])

    def _by_projection(self, released: NDArray[np.float64]) -> NDArray[np.float64]:
        numbers = {modulator.name: number for number, modulator in enumerate(self.description.modulators)}
        return released[[numbers[projection.modulator] for projection in self.description.plastic]]

    @property
    def modulators(self) -> dict[str, float]:
        """The concentrations by name."""
        levels = self.memory.modulators["level"] + self._due()
        return dict(zip((m.name for m in self.description.modulators), levels.tolist(), strict=True))

    def monitor(
        self, variable: str, of: str, which: ArrayLike | None = None, *, every_ms: float | None = None
    ) -> Monitor:
        """Return a monitor that follows a variable from now on; the run keeps its bits.

        Args:
            variable: "v", "u" of a population; "weight", "eligibility" of a projection; its rule's traces "x", "x1",
                ... of its source and "y", "y1", ... of its target neurons.
            of: the population's or the projection's name.
            which: neurons, or synapses in the order of `synapses`, from 0; all unless given.
            every_ms: a whole number of steps between two samples; every step unless given.

        Raises:
            SclaError: one of them is not known.
        """
        every = 1 if every_ms is None else self._in_steps("every_ms", every_ms)
        code, part, first, size = self._found(variable, of)
        chosen = np.arange(size) if which is None else np.atleast_1d(np.asarray(which))
        if every < 1 or chosen.dtype.kind not in "iu" or chosen.ndim != 1 or ((chosen < 0) | (chosen >= size)).any():
            raise SclaError(
                f"a monitor of {of} takes whole numbers from 0 to {size - 1}, and every_ms of a step or more"
            )
        monitor = Monitor(variable, of, chosen.astype(np.int64), every, self.description.step_ms)
        self._watch.add(monitor, code, part, first)
        return monitor

    def state(self) -> dict[str, Any]:
        """Return copies of all that changes; monitors are no part of it."""
        arrays = {}
        for name in STATE:
            array = getattr(self.memory, name)
            fields = {f"{name}_{field}": array[field].copy() for field in _CHANGING.get(name, ())}
            arrays.update(fields or {name: array.copy()})
        arrays["uniform_weights"] = self.memory.projections["weight"].copy()
        releases = [{"due": due, "amount": amount.copy()} for due, amount in self._releases]
        return {"arrays": arrays, "steps": self._steps, "releases": releases}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state` of a network of the same description and seed, bit-identically, and begin a new window.

        Raises:
            SclaError: it is not the state of such a network; nothing is changed then.
        """
        restore_whole(state, self.state(), self._put_back, name="the network's state")

    def _put_back(self, state: dict[str, Any]) -> None:
        releases = [
            (release["due"], fill("amount", np.empty(len(self._nothing)), release["amount"]))
            for release in state["releases"]
        ]
        self._begin_window()
        for name in STATE:
            array = getattr(self.memory, name)
            for field in _CHANGING.get(name, ()):
                array[field] = state["arrays"][f"{name}_{field}"]
            if name not in _CHANGING:
                array[:] = state["arrays"][name]
        self.memory.projections["weight"] = state["arrays"]["uniform_weights"]
        self._steps, self._releases = state["steps"], releases

    def _run(self, steps: int, drive: NDArray[Any], released: NDArray[np.float64]) -> int:
        memory = self.memory
        np.add(self._own_drive, drive, out=memory.drive)
        memory.modulators["level"] += released
        watch = self._watch.opened(self._steps, steps)
        room = self._spike_step, self._spike_neuron, self.spike_count, self._counts
        filled: int = self._kernel(memory, steps, *room, self._window_steps, watch)
        self._watch.close(self._steps, steps, watch[2])
        return filled

    def _in_steps(self, name: str, duration_ms: float) -> int:
        step_ms = self.description.step_ms
        if not isinstance(duration_ms, float | int) or not 0.0 <= duration_ms < math.inf:
            raise SclaError(f"{name} is {shown(duration_ms)}: it must be a number of ms, 0 or more")
        steps = round(duration_ms / step_ms)
        if abs(steps * step_ms - duration_ms) > 1e-6 * step_ms * max(steps, 1):
            raise SclaError(f"{name} is {duration_ms:g}: it must be a whole number of steps of {step_ms:g} ms")
        return steps

    def _found(self, variable: str, of: str) -> tuple[int, int, int, int]:
        """Return what the kernel needs to find a variable: its code, part, the first index, and how many there are."""
        if variable in _NEURON_VARIABLES:
            population = next((p for p in self.populations if p.name == of), None)
            if population is None:
                raise SclaError(
                    f"{shown(of)} is no population: known are {', '.join(p.name for p in self.populations)}"
                )
            return _NEURON_VARIABLES[variable], 0, population.start, population.size
        described, table = self._projection(of)
        if {"weight": not described.is_uniform, "eligibility": described.rule is not None}.get(variable):
            first, last = int(table["first_synapse"]), int(table["last_synapse"])
            return SYNAPSE_VARIABLES[variable], self._projections[of], first, last - first
        kind, number = variable[:1], variable[1:] or "0"
        if described.rule is not None and kind in _TRACES and number.isdecimal():
            limits = self.memory.limits[table["rule"]]
            trace = int(limits[f"first_{kind}"]) + int(number)
            if trace < limits[f"last_{kind}"]:
                population = self._ends(described)[kind == "y"]
                return _TRACES[kind], trace, population.start, population.size
        raise SclaError(f"{of} has no {shown(variable)} to watch: variables are {_VARIABLES}")


_CHANGING: Final = {
    "synapses": ("weight", "scaled", "at"),
    "modulators": ("level",),
    "courses": ("decayed", "sign"),
}
"""Of these arrays of records, the fields that change."""
