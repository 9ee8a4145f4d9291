"""The network as the brain uses it: drive populations, read their spikes, release dopamine."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import NEURON_COUNT, NEURONS_PER_SIDE, POPULATIONS, PROJECTIONS
from scla_mj.brain.network import kernel, readers
from scla_mj.brain.network.memory import new_memory
from scla_mj.brain.network.parameters import STRETCH_STEPS, build_parameters
from scla_mj.brain.network.state import begin, state_of
from scla_mj.errors import SclaError

if TYPE_CHECKING:
    from scla_mj.config import NetworkConfig, PlasticityConfig

_SPIKES_A_CALL: Final = 4_000_000
"""Room for a spike of every neuron in every step of a call of the kernel: longer runs are cut into several."""


class Spikes(NamedTuple):
    """The spikes of a window: their steps, from its beginning, and neurons, and the count of each population, (12,)."""

    step: NDArray[np.int32]
    neuron: NDArray[np.int32]
    counts: NDArray[np.int64]


class Network:
    """1000 Izhikevich neurons, 80,000 plastic synapses, dopamine (paper, Tables 3 and 4, equations 1 to 4).

    `neurons`, a multiple of 1000, makes a larger one with as many synapses a neuron (see anatomy.py). A window of time
    begins with a call of `run`, or of `advance` that does not go on.

    Attributes:
        state: what changes with time, views of `memory`, which is what the kernel works on.
        spike_count: spikes in the window so far.

    Raises:
        SclaError: `neurons` is no multiple of 1000.
    """

    def __init__(
        self,
        network: NetworkConfig,
        plasticity: PlasticityConfig,
        *,
        neural_step_ms: float,
        weights: np.random.Generator,
        noise: np.random.SeedSequence,
        neurons: int = NEURON_COUNT,
    ) -> None:
        if neurons < NEURON_COUNT or neurons % NEURON_COUNT:
            raise SclaError(f"a network of {neurons} neurons has no such populations: choose a multiple of 1000")
        self._real = np.dtype(network.precision)
        self.parameters = build_parameters(network, plasticity, neural_step_ms=neural_step_ms, neurons=neurons)
        self.memory = new_memory(self.parameters)
        self.state = state_of(self.memory)
        begin(self.state, network, weights=weights, noise=noise)
        self._steps_a_call = max(STRETCH_STEPS, _SPIKES_A_CALL // neurons)
        self._steps = 0
        self._releases: list[tuple[int, NDArray[np.float64]]] = []
        self._nothing = np.zeros(len(PROJECTIONS))
        self._undriven = np.zeros(neurons, self._real)
        self._counts = np.zeros(len(POPULATIONS), np.int64)
        self._window_steps = 0
        self.spike_count = 0
        self._spike_step = np.empty(2 * _SPIKES_A_CALL, np.int32)
        self._spike_neuron = np.empty_like(self._spike_step)
        self._means = np.empty(len(self.state.weight))
        self._mean_at = np.full(len(self.state.weight), -1)

    @property
    def weights(self) -> NDArray[Any]:
        """The weights of now, (8, 100, 100): projection, pre- and postsynaptic neuron; a copy.

        In a larger network (8, blocks, 100, 100): a neuron reaches those of its own block of 100.
        """
        weights = np.empty(self.state.weight.shape, self._real)
        readers.read_weights(self.memory, weights)
        return _by_block(weights)

    @weights.setter
    def weights(self, weights: NDArray[Any]) -> None:
        """Set the weights; what lies out of bounds is clipped when it is read, or changed.

        Raises:
            SclaError: they have another shape, or one of them is not finite.
        """
        _require_shape("weights", weights, _by_block(self.state.weight).shape)
        if not np.isfinite(weights).all():
            raise SclaError("a weight is not finite: all must be numbers")
        self.state.weight[:] = weights.reshape(self.state.weight.shape)
        self.state.gathered_at[:] = self.state.gathered[:, np.newaxis]
        self._mean_at[:] = -1

    @property
    def eligibility(self) -> NDArray[Any]:
        """The eligibility traces of now, a copy shaped like the weights."""
        sensors = [projection.sensor for projection in PROJECTIONS]
        decayed = self.state.decayed[sensors].astype(self._real)
        return _by_block(self.state.scaled * decayed[:, np.newaxis, np.newaxis])

    @property
    def dopamine(self) -> NDArray[np.float64]:
        """The dopamine concentration at each projection, (8,); a copy."""
        return self.state.dopamine + self._due() if self._releases else self.state.dopamine.copy()

    def mean_weights(self) -> NDArray[np.float64]:
        """Return each projection's mean weight, (8,)."""
        readers.mean_weights(self.memory, self._mean_at, self._means)
        return self._means.copy()

    def run(self, steps: int, drive: NDArray[Any] | None = None, *, first_step: int = 0) -> Spikes:
        """Run `steps` neural steps under a constant current into each neuron, (N,), and return the spikes.

        `first_step` is the number that the first step's spikes carry.

        Raises:
            SclaError: `steps` or `drive` cannot be, or a membrane potential is no longer finite: then none will be.
        """
        self.advance(steps, drive)
        spikes = self.spikes()
        return spikes._replace(step=spikes.step + np.int32(first_step))

    def advance(self, steps: int, drive: NDArray[Any] | None = None, *, goes_on: bool = False) -> NDArray[np.int64]:
        """Run as `run` does, but hand out no spikes; return how often each population has fired in the window, (12,).

        A call that `goes_on` makes the window longer: what is counted, and what `spikes` returns, is of all of it.

        Raises:
            SclaError: `steps` or `drive` cannot be, or a membrane potential is no longer finite: then none will be.
        """
        drive = self._undriven if drive is None else np.ascontiguousarray(drive, self._real)
        _require_shape("drive", drive, self._undriven.shape)
        if not isinstance(steps, int | np.integer) or steps < 0:
            raise SclaError(f"a network cannot run {steps} steps: it must be a whole number, 0 or more")
        if not goes_on:
            self._begin_window()
        wanted = self._window_steps + steps
        while self._window_steps < wanted:
            released = self._take_due()
            size = min(self._steps_a_call, wanted - self._window_steps, self._steps_to_release())
            self._reserve(size)
            filled = kernel.run(
                self.memory,
                drive,
                released,
                size,
                self._window_steps,
                self._spike_step,
                self._spike_neuron,
                self.spike_count,
                self._counts,
            )
            if filled == kernel.NOT_FINITE:
                raise SclaError(
                    "the network's membrane potentials are no longer finite: use a smaller drive, noise or neural step"
                )
            self.spike_count = filled
            self._window_steps += size
            self._steps += size
        return self._counts.copy()

    def spikes(self) -> Spikes:
        """Return the window's spikes; copies."""
        count = self.spike_count
        return Spikes(self._spike_step[:count].copy(), self._spike_neuron[:count].copy(), self._counts.copy())

    def saved(self) -> dict[str, Any]:
        """Return copies of all that `restore` needs: the arrays of `state`, the steps so far, dopamine on its way."""
        arrays = {name: array.copy() for name, array in self.state._asdict().items()}
        releases = [{"due": due, "amount": amount.copy()} for due, amount in self._releases]
        means = {"values": self._means.copy(), "at": self._mean_at.copy()}
        return {"arrays": arrays, "steps": self._steps, "releases": releases, "means": means}

    def restore(self, saved: dict[str, Any]) -> None:
        """Go on from what `saved` returned, to the bit; with a new window."""
        self._begin_window()
        for name, array in saved["arrays"].items():
            getattr(self.state, name)[:] = array
        self._steps = saved["steps"]
        self._releases = [(release["due"], release["amount"]) for release in saved["releases"]]
        self._means[:], self._mean_at[:] = saved["means"]["values"], saved["means"]["at"]

    def _begin_window(self) -> None:
        self._counts[:] = self.spike_count = self._window_steps = 0

    def _reserve(self, steps: int) -> None:
        """Make room for a spike of every neuron in every step, behind those that there are."""
        wanted = self.spike_count + steps * len(self._undriven) + 1
        if wanted > len(self._spike_step):
            room = np.empty(2 * wanted - len(self._spike_step), np.int32)
            self._spike_step, self._spike_neuron = (
                np.concatenate((memory, room)) for memory in (self._spike_step, self._spike_neuron)
            )

    def release_dopamine(self, amount: NDArray[np.float64], *, delay_steps: int = 0) -> None:
        """Add a signed amount to the dopamine concentration at each projection, (8,), now or some steps from now.

        Raises:
            SclaError: the amount is no (8,) array.
        """
        _require_shape("amount", amount, self._nothing.shape)
        self._releases.append((self._steps + delay_steps, amount))

    def _due(self) -> NDArray[np.float64]:
        """Return the dopamine that is to be released before the next step, (8,)."""
        amounts = [amount for due, amount in self._releases if due <= self._steps]
        return amounts[0] if len(amounts) == 1 else sum(amounts, start=self._nothing)

    def _take_due(self) -> NDArray[np.float64]:
        """Return the same, and forget it."""
        if not self._releases:
            return self._nothing
        released = self._due()
        self._releases = [(due, amount) for due, amount in self._releases if due > self._steps]
        return released

    def _steps_to_release(self) -> int:
        if not self._releases:
            return self._steps_a_call
        return min(due - self._steps for due, _ in self._releases)


def _by_block(synapses: NDArray[Any]) -> NDArray[Any]:
    """Return a view of synapses, (8, n, 100), with their presynaptic neurons by blocks, if there are several."""
    blocks = synapses.reshape(len(PROJECTIONS), -1, NEURONS_PER_SIDE, NEURONS_PER_SIDE)
    return blocks[:, 0] if blocks.shape[1] == 1 else blocks


def _require_shape(name: str, array: NDArray[Any], wanted: tuple[int, ...]) -> None:
    """Compiled code looks at no bounds."""
    shape = array.shape if isinstance(array, np.ndarray) else np.shape(array)
    if shape != wanted:
        raise SclaError(f"{name} has the shape {shape}: it must be {wanted}")
