"""The network as a library: drive populations, read their spikes, release dopamine, read and set weights."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scla_mj.anatomy import NEURON_COUNT, NEURONS_PER_SIDE, POPULATIONS, PROJECTIONS, populations_of
from scla_mj.brain.network import kernel, readers
from scla_mj.brain.network.description import NetworkDescription
from scla_mj.brain.network.general import GeneralNetwork
from scla_mj.brain.network.inputs import count, fill
from scla_mj.brain.network.memory import arrays_of, initialise, new_memory
from scla_mj.brain.network.parameters import build_parameters
from scla_mj.brain.network.window import Spikes, Window
from scla_mj.checked import check, is_papers, option
from scla_mj.config import ClockConfig, NetworkConfig, PlasticityConfig, RunConfig
from scla_mj.errors import SclaError
from scla_mj.restoring import restore_whole
from scla_mj.validation import validated

_MOST_NEURONS: Final = 1_000_000
"""Their memory is 0.7 GB."""


class Network(Window):
    """1000 Izhikevich neurons, 80,000 plastic synapses, dopamine (paper, Tables 3 and 4, equations 1 to 4).

    A window of time begins with a call of `run`, or of `advance` unless that extends the one before.

    Args:
        network: initial weights, noise, fixed wiring and number format.
        plasticity: STDP, eligibility and dopamine.
        neural_step_ms: length of one step.
        seed: of the initial weights and of the noise; a run with this seed has the same network.
        neurons: N, a multiple of 1000 up to a million, `network.neurons` if not given; a larger network has as many
            synapses per neuron (anatomy.py).

    Attributes:
        populations: the 12 populations, each with `name`, `start` and `stop`: neurons [start, stop).
        projections: the 8 plastic projections in the order of `weights`, each with `name`, `sensor` and `motor`.
        arrays: the state as the kernel keeps it, views of its `memory` (memory.py).
        spike_count: number of spikes in the window so far.

    Raises:
        SclaError: `neurons` is not a multiple of 1000, or a setting is not valid.

    Example:
        >>> network = Network(seed=0)
        >>> drive = np.zeros(1000)
        >>> drive[:100] = 8.0  # the first population, SU
        >>> counts = network.advance(50, drive)  # 50 ms; spikes per population, (12,)
    """

    projections = PROJECTIONS

    def __init__(
        self,
        network: NetworkConfig = NetworkConfig(),
        plasticity: PlasticityConfig = PlasticityConfig(),
        *,
        neural_step_ms: float = 1.0,
        seed: int = 0,
        neurons: int | None = None,
    ) -> None:
        neurons = count("neurons", network.neurons if neurons is None else neurons, most=_MOST_NEURONS)
        if neurons < NEURON_COUNT or neurons % NEURON_COUNT:
            raise SclaError(f"a network of {neurons} neurons has no such populations: choose a multiple of 1000")
        asked = {"neural_step_ms": neural_step_ms}
        neural_step_ms = validated(ClockConfig, asked, spell=lambda path: option(("clock", *path))).neural_step_ms
        clock = ClockConfig(neural_step_ms, neural_step_ms, *[20 * neural_step_ms] * 3)  # the others fit any step
        checked = check(RunConfig(network=network, plasticity=plasticity, seed=seed, clock=clock)).config
        network, plasticity = checked.network, checked.plasticity
        if not is_papers(network, plasticity):
            raise SclaError(
                "a Network has the paper's types of neurons and projections, and one STDP time constant: for "
                "others describe it, Network.from_description(paper_description(config)) of scla_mj.brain.network.paper"
            )
        self.populations = populations_of(neurons)
        self._real = np.dtype(network.precision)
        self.parameters = build_parameters(network, plasticity, neural_step_ms=neural_step_ms, neurons=neurons)
        self.memory = new_memory(self.parameters)
        self.arrays = arrays_of(self.memory)
        initialise(self.arrays, network, seed=checked.seed)
        super().__init__(neurons=neurons, populations=len(POPULATIONS), modulators=len(PROJECTIONS), real=self._real)
        self.watched = tuple(self.memory[0]["watched"].tolist())
        self._means = np.empty(len(PROJECTIONS))
        self._mean_at = np.full(len(PROJECTIONS), -1)

    @classmethod
    def from_description(cls, description: NetworkDescription, *, seed: int = 0) -> GeneralNetwork:
        """Return a network of any populations, projections and rule (docs/network.md).

        Raises:
            SclaError: the description does not fit together.
        """
        return GeneralNetwork(description, seed=seed)

    @property
    def weights(self) -> NDArray[Any]:
        """The weights, mV, (8, 100, 100): projection, presynaptic and postsynaptic neuron; a read-only copy.

        In a larger network (8, blocks, 100, 100): a neuron reaches those of its own block of 100. To change weights,
        change a copy and assign it::

            weights = network.weights.copy()
            weights[0, :, 5] = 4.0  # all synapses of projection SUtoMU onto the motor neuron 5 of MU
            network.weights = weights

        Raises:
            SclaError: on assignment, of another shape, or of values that are not within 0 to weight_max.
        """
        weights = np.empty(self.arrays.weight.shape, self._real)
        readers.read_weights(self.memory, weights)
        return read_only(_by_block(weights))

    @weights.setter
    def weights(self, weights: ArrayLike) -> None:
        highest = self.parameters.plasticity.weight_max
        values = fill("weights", np.empty(_by_block(self.arrays.weight).shape, self._real), weights)
        low, high = values.min(), values.max()
        if not 0.0 <= low <= high <= highest:
            raise SclaError(f"weights go from {low:g} to {high:g}: every weight must be a number from 0 to {highest:g}")
        self.arrays.weight[:] = values.reshape(self.arrays.weight.shape)
        self.arrays.gathered_at[:] = self.arrays.gathered[:, np.newaxis]
        self._mean_at[:] = -1

    @property
    def eligibility(self) -> NDArray[Any]:
        """The eligibility traces, shaped like the weights; a read-only copy."""
        sensors = [projection.sensor for projection in PROJECTIONS]
        decayed = self.arrays.decayed[sensors].astype(self._real)
        return read_only(_by_block(self.arrays.scaled * decayed[:, np.newaxis, np.newaxis]))

    @property
    def dopamine(self) -> NDArray[np.float64]:
        """The dopamine concentration at each projection, (8,); a read-only copy."""
        return read_only(self.arrays.dopamine + self._due())

    def mean_weights(self) -> NDArray[np.float64]:
        """Return each projection's mean weight, mV, (8,)."""
        readers.mean_weights(self.memory, self._mean_at, self._means)
        return self._means.copy()

    def run(self, steps: int, drive: ArrayLike | None = None) -> Spikes:
        """Run `steps` steps under a constant current into each neuron, (N,), and return their spikes.

        Raises:
            SclaError: `steps` or `drive` is not valid, or a membrane potential is no longer finite (it stays so).
        """
        self.advance(steps, drive)
        return self.spikes()

    def release_dopamine(self, amount: ArrayLike, *, delay_steps: int = 0) -> None:
        """Add a signed amount to the dopamine concentration at each projection, (8,), now or after some steps.

        Raises:
            SclaError: `amount` is not eight numbers from -1000 to 1000, or `delay_steps` is not a whole number.
        """
        super().release_dopamine(amount, delay_steps=delay_steps)

    def state(self) -> dict[str, Any]:
        """Return copies of all that changes: the arrays, the number of steps so far, dopamine that is still to come."""
        arrays = {name: array.copy() for name, array in self.arrays._asdict().items()}
        releases = [{"due": due, "amount": amount.copy()} for due, amount in self._releases]
        means = {"values": self._means.copy(), "at": self._mean_at.copy()}
        return {"arrays": arrays, "steps": self._steps, "releases": releases, "means": means}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`, bit-identically, and begin a new window.

        Raises:
            SclaError: it is not the state of such a network; nothing is changed then.
        """
        restore_whole(state, self.state(), self._put_back, name="the network's state")

    def _put_back(self, state: dict[str, Any]) -> None:
        releases = [(release["due"], fill("amount", np.empty(8), release["amount"])) for release in state["releases"]]
        self._begin_window()
        for name, array in state["arrays"].items():
            getattr(self.arrays, name)[:] = array
        self._steps = state["steps"]
        self._releases = releases
        self._means[:], self._mean_at[:] = state["means"]["values"], state["means"]["at"]

    def _potentials(self, steps: int) -> NDArray[Any]:
        seen: NDArray[Any] = self.memory[0]["potentials"][:steps].copy()
        return seen

    def _run(self, steps: int, drive: NDArray[Any], released: NDArray[np.float64]) -> int:
        """Release dopamine and run; add to the window's spikes and counts. Return the number of spikes in it."""
        room = self._spike_step, self._spike_neuron, self.spike_count
        filled: int = kernel.run(self.memory, drive, released, steps, self._window_steps, *room, self._counts)
        return filled


def _by_block(synapses: NDArray[Any]) -> NDArray[Any]:
    """Return a view of synapses, (8, n, 100), with their presynaptic neurons by blocks, if there are several."""
    blocks = synapses.reshape(len(PROJECTIONS), -1, NEURONS_PER_SIDE, NEURONS_PER_SIDE)
    return blocks[:, 0] if blocks.shape[1] == 1 else blocks


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Return a copy made for a reader such that writing to it, which would change nothing here, raises."""
    array.setflags(write=False)
    return array
