"""The network as the brain uses it: drive populations, read their spikes, release dopamine."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import NEURON_COUNT, POPULATIONS
from scla_mj.brain.network import kernel
from scla_mj.brain.network.parameters import build_parameters
from scla_mj.brain.network.state import initial_state, presynaptic_first
from scla_mj.errors import SclaError

if TYPE_CHECKING:
    from scla_mj.config import NetworkConfig, PlasticityConfig

# The lazy eligibility is scaled by exp(-t / tau_c) within one call of the kernel; a call this short keeps it in range.
_STEPS_A_CALL: Final = 1000
_VIEWS: Final = ("fired_octets",)
"""What shares its memory with another array of the state."""


class Spikes(NamedTuple):
    """The spikes of one stretch of time: their steps and neurons, and the count of each population, (12,)."""

    step: NDArray[np.int32]
    neuron: NDArray[np.int32]
    counts: NDArray[np.int64]


class Network:
    """1000 Izhikevich neurons, 80,000 plastic synapses, dopamine (paper, Tables 3 and 4, equations 1 to 4).

    `neurons`, a multiple of 1000, makes a larger one with as many synapses a neuron (see anatomy.py).
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
        self._real = np.dtype(network.precision)
        self.parameters = build_parameters(network, plasticity, neural_step_ms=neural_step_ms, neurons=neurons)
        self.state = initial_state(network, weights=weights, noise=noise, neurons=neurons)
        self._steps_a_call = _steps_a_call(plasticity.eligibility_tau_ms / neural_step_ms)
        self._steps = 0
        self._releases: list[tuple[int, NDArray[np.float64]]] = []
        self._silence = np.zeros(neurons, self._real)
        self._spike_step = np.empty(2 * _STEPS_A_CALL * neurons, np.int32)
        self._spike_neuron = np.empty_like(self._spike_step)
        self._columns = np.empty(self.state.anchor.shape[2])

    @property
    def weights(self) -> NDArray[Any]:
        """A view of the weights, (8, 100, 100): projection, pre- and postsynaptic neuron; see `presynaptic_first`."""
        return presynaptic_first(self.state.anchor)

    @property
    def eligibility(self) -> NDArray[Any]:
        """A view of the eligibility traces, shaped like the weights."""
        return presynaptic_first(self.state.scaled)

    @property
    def dopamine(self) -> NDArray[np.float64]:
        """The dopamine concentration at each projection, (8,)."""
        return self.state.dopamine

    def mean_weights(self) -> NDArray[np.float64]:
        """Return each projection's mean weight, (8,)."""
        means = np.empty(len(self.state.anchor))
        kernel.mean_weights(self.state.anchor, self._columns, means)
        return means

    def run(
        self, steps: int, drive: NDArray[Any] | None = None, *, first_step: int = 0, after: Spikes | None = None
    ) -> Spikes:
        """Run `steps` neural steps under a constant current into each neuron, (N,), and return the spikes.

        `first_step` is the number that the first step's spikes carry. With `after`, which must be what the last run
        returned, the new spikes follow those in what is returned.

        Raises:
            SclaError: a membrane potential is no longer finite.
        """
        current = self._silence if drive is None else drive.astype(self._real, copy=False)
        counts = np.zeros(len(POPULATIONS), np.int64) if after is None else after.counts.copy()
        total = 0 if after is None else len(after.step)
        done = 0
        while done < steps:
            size = min(self._steps_a_call, steps - done, self._steps_to_release())
            self._reserve(total, size)
            spikes = kernel.run(
                self.state,
                self.parameters,
                current,
                size,
                first_step + done,
                self._spike_step[total:],
                self._spike_neuron[total:],
                counts,
            )
            if spikes == kernel.NOT_FINITE:
                raise SclaError(
                    "the network's membrane potentials are no longer finite: use a smaller drive, noise or neural step"
                )
            total += spikes
            done += size
            self._steps += size
        return Spikes(self._spike_step[:total].copy(), self._spike_neuron[:total].copy(), counts)

    def saved(self) -> dict[str, Any]:
        """Return copies of all that `restore` needs: the arrays of `state`, the steps so far, dopamine on its way."""
        arrays = {name: array.copy() for name, array in self.state._asdict().items() if name not in _VIEWS}
        releases = [{"due": due, "amount": amount.copy()} for due, amount in self._releases]
        return {"arrays": arrays, "steps": self._steps, "releases": releases}

    def restore(self, saved: dict[str, Any]) -> None:
        """Go on from what `saved` returned, to the bit."""
        for name, array in saved["arrays"].items():
            getattr(self.state, name)[:] = array
        self._steps = saved["steps"]
        self._releases = [(release["due"], release["amount"]) for release in saved["releases"]]

    def _reserve(self, spikes: int, steps: int) -> None:
        """Make room for a spike of every neuron in every step, behind the `spikes` that there are."""
        wanted = spikes + steps * len(self._silence)
        if wanted > len(self._spike_step):
            room = np.empty(2 * wanted - len(self._spike_step), np.int32)
            self._spike_step, self._spike_neuron = (
                np.concatenate((memory, room)) for memory in (self._spike_step, self._spike_neuron)
            )

    def release_dopamine(self, amount: NDArray[np.float64], *, delay_steps: int = 0) -> None:
        """Add a signed amount to the dopamine concentration at each projection, (8,), now or some steps from now."""
        self._releases.append((self._steps + delay_steps, amount))
        self._steps_to_release()

    def _steps_to_release(self) -> int:
        """Carry out the releases that are due; return the steps to the next one."""
        for due, amount in self._releases:
            if due <= self._steps:
                self.state.dopamine[:] += amount
        self._releases = [(due, amount) for due, amount in self._releases if due > self._steps]
        return min((due - self._steps for due, _ in self._releases), default=_STEPS_A_CALL)


def _steps_a_call(eligibility_tau_steps: float) -> int:
    """Return how many steps a call may take: beyond one time constant the lazy weights lose digits of float32."""
    return max(1, int(min(_STEPS_A_CALL, eligibility_tau_steps)))
