"""A window of network time, advanced in one or more calls; its spikes, and releases that are still to come."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scla_mj.brain.network.inputs import MOST_DOPAMINE, MOST_STEPS, count, current, fill
from scla_mj.brain.network.neurons import NOT_FINITE
from scla_mj.brain.network.parameters import STRETCH_STEPS
from scla_mj.errors import SclaError
from scla_mj.signals import Activity

_SPIKES_PER_CALL: Final = 4_000_000
"""Room for a spike of every neuron in every step of one call of the kernel: longer runs take several calls."""


class Spikes(NamedTuple):
    """The spikes of a window, in order of time: the step and the neuron of each, and the count per population.

    Steps count from the beginning of the window.
    """

    step: NDArray[np.int32]
    neuron: NDArray[np.int32]
    counts: NDArray[np.int64]


class Window(ABC):
    """What every compiled network does alike; a network of its own kind supplies `_run`.

    A window of time begins with a call of `advance`, unless that extends the one before.

    Args:
        neurons, populations, modulators: their numbers, N, P and M.
        real: the kernel's number format.

    Attributes:
        spike_count: number of spikes in the window so far.
        watched: the neurons whose membrane potentials an activity holds.
    """

    watched: tuple[int, ...] = ()

    def __init__(self, *, neurons: int, populations: int, modulators: int, real: np.dtype[Any]) -> None:
        self._steps_per_call = max(STRETCH_STEPS, _SPIKES_PER_CALL // neurons)
        self._steps = 0
        self._releases: list[tuple[int, NDArray[np.float64]]] = []
        self._released = np.zeros(modulators)
        self._nothing = np.zeros(modulators)
        self._undriven, self._drive = np.zeros((2, neurons), real)
        self._counts = np.zeros(populations, np.int64)
        self._window_steps = 0
        self.spike_count = 0
        self._spike_step = np.empty(2 * _SPIKES_PER_CALL, np.int32)
        self._spike_neuron = np.empty_like(self._spike_step)

    def advance(self, steps: int, drive: ArrayLike | None = None, *, extend: bool = False) -> NDArray[np.int64]:
        """Run `steps` steps under a constant current into each neuron, (N,); return the window's spikes by population.

        With `extend` the steps belong to the window of the call before: counts and `spikes()` cover all of it.

        Raises:
            SclaError: `steps` or `drive` is not valid, or a membrane potential is no longer finite (it stays so).
        """
        driven = self._undriven if drive is None else current(fill("drive", self._drive, drive))
        steps = count("steps", steps, most=MOST_STEPS - self._window_steps * extend)
        if not extend:
            self._begin_window()
        wanted = self._window_steps + steps
        while self._window_steps < wanted:
            released, size = self._nothing, min(self._steps_per_call, wanted - self._window_steps)
            if self._releases:
                released = self._due()
                self._releases = [(due, amount) for due, amount in self._releases if due > self._steps]
                size = min([size, *(due - self._steps for due, _ in self._releases)])
            self._reserve(size)
            filled = self._run(size, driven, released)
            if filled == NOT_FINITE:
                raise SclaError("a membrane potential is no longer finite: use a smaller drive, noise or neural step")
            self.spike_count = filled
            self._window_steps += size
            self._steps += size
        return self._counts.copy()

    def spikes(self) -> Spikes:
        """Return the window's spikes; copies."""
        count = self.spike_count
        return Spikes(self._spike_step[:count].copy(), self._spike_neuron[:count].copy(), self._counts.copy())

    def activity(self, thinking: int, spikes: int, counts: NDArray[np.int64]) -> Activity:
        """Return the window as a decision's activity.

        Args:
            thinking: steps of the decision window, its beginning.
            spikes: their number in these steps.
            counts: the same by population, (P,).
        """
        return Activity(
            spike_step=self._spike_step[: self.spike_count].copy(),
            spike_neuron=self._spike_neuron[: self.spike_count].copy(),
            thinking_spikes=spikes,
            thinking_steps=thinking,
            steps=self._window_steps,
            mean_weights=self.mean_weights(),
            dopamine=self._by_projection(self._released),
            counts=(counts, self._counts.copy()),
            potentials=self._potentials(thinking) if self.watched else None,
        )

    def _potentials(self, steps: int) -> NDArray[Any] | None:
        """Return the watched neurons' potentials after each of the window's first steps; a copy."""
        return None

    @abstractmethod
    def mean_weights(self) -> NDArray[np.float64]:
        """Return each plastic projection's mean weight."""

    def _by_projection(self, released: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what the modulators, (M,), are at each plastic projection; a copy."""
        return released.copy()

    def release_dopamine(self, amount: ArrayLike, *, delay_steps: int = 0) -> None:
        """Add a signed amount to each concentration, (M,), now or after some steps.

        Raises:
            SclaError: `amount` is not M numbers from -1000 to 1000, or `delay_steps` is not a whole number.
        """
        released = fill("amount", np.empty(len(self._nothing)), amount)
        if not np.abs(released).max() <= MOST_DOPAMINE:
            shortly = ", ".join(f"{part:g}" for part in released)
            raise SclaError(f"amount is {shortly}: every amount of dopamine must be a number from -1000 to 1000")
        self._releases.append((self._steps + count("delay_steps", delay_steps), released))
        self._released += released

    @abstractmethod
    def _run(self, steps: int, drive: NDArray[Any], released: NDArray[np.float64]) -> int:
        """Release and run; add to the window's spikes and counts. Return their number in it, or `NOT_FINITE`."""

    def _begin_window(self) -> None:
        self._counts[:] = self.spike_count = self._window_steps = 0
        self._released[:] = 0.0

    def _reserve(self, steps: int) -> None:
        """Make room for a spike of every neuron in every step, after those already stored."""
        wanted = self.spike_count + steps * len(self._undriven) + 1
        if wanted > len(self._spike_step):
            room = np.empty(2 * wanted - len(self._spike_step), np.int32)
            self._spike_step, self._spike_neuron = (
                np.concatenate((memory, room)) for memory in (self._spike_step, self._spike_neuron)
            )

    def _due(self) -> NDArray[np.float64]:
        """Return the dopamine that is to be released before the next step, (M,)."""
        return sum((amount for due, amount in self._releases if due <= self._steps), start=self._nothing)
