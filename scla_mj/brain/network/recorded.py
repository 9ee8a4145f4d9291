"""What a network of a description hands out: spikes by population, and what monitors have seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import Population
from scla_mj.errors import SclaError
from scla_mj.extras import need


class Train(NamedTuple):
    """Spikes of one population in order of time, and which of its neurons fired, from 0."""

    time_ms: NDArray[np.float64]
    neuron: NDArray[np.int64]


@dataclass(frozen=True)
class SpikeTrains:
    """The spikes of a run, in order of time; `trains["name"]` are those of one population.

    Attributes:
        time_ms: when the step began in which it was fired, since the network began, (n,).
        neuron: by its number in the network, (n,) int32.
        counts: spikes by population.
        duration_ms: how long the run was.
        populations: where each population's neurons begin and end.
    """

    time_ms: NDArray[np.float64]
    neuron: NDArray[np.int32]
    counts: dict[str, int]
    duration_ms: float
    populations: tuple[Population, ...]

    def __getitem__(self, name: str) -> Train:
        population = next((p for p in self.populations if p.name == name), None)
        if population is None:
            raise SclaError(f"{name!r} is no population: known are {', '.join(self.counts)}")
        own = (self.neuron >= population.start) & (self.neuron < population.stop)
        return Train(self.time_ms[own], self.neuron[own].astype(np.int64) - population.start)

    def rates_hz(self) -> dict[str, float]:
        """Return the mean rate of each population's neurons."""
        seconds = self.duration_ms / 1000.0
        return {p.name: self.counts[p.name] / (p.size * seconds) if seconds else 0.0 for p in self.populations}

    def _columns(self) -> dict[str, Any]:
        of = np.searchsorted([p.stop for p in self.populations], self.neuron, side="right")
        starts = np.array([p.start for p in self.populations])
        names = np.array([p.name for p in self.populations])
        return {"time_ms": self.time_ms, "population": names[of], "neuron": self.neuron - starts[of]}

    def to_pandas(self) -> Any:
        """Return a data frame, one row a spike: time_ms, population, neuron (from 0 in its population)."""
        return need("pandas", "to_pandas").DataFrame(self._columns())

    def to_xarray(self) -> Any:
        """Return a data set along the dimension `spike`."""
        columns = {name: ("spike", values) for name, values in self._columns().items()}
        return need("xarray", "to_xarray").Dataset(columns, attrs={"duration_ms": self.duration_ms})


class Monitor:
    """Values of one variable of chosen neurons or synapses, at intervals, read inside the kernel after a step.

    Attributes:
        variable: its name, such as "v".
        of: the name of the population or projection.
        which: the neurons, or the synapses in the order of `synapses(of)`, (n,).
        every: steps between two samples.
    """

    def __init__(self, variable: str, of: str, which: NDArray[np.int64], every: int, step_ms: float) -> None:
        self.variable, self.of, self.which, self.every = variable, of, which, every
        self._step_ms = step_ms
        self._steps: list[NDArray[np.int64]] = []
        self._values: list[NDArray[np.float64]] = []

    @property
    def time_ms(self) -> NDArray[np.float64]:
        """The end of each sampled step, since the network began, (samples,)."""
        return np.concatenate([np.zeros(0, np.int64), *self._steps]) * self._step_ms

    @property
    def values(self) -> NDArray[np.float64]:
        """The values, (samples, n)."""
        return np.concatenate([np.zeros((0, len(self.which))), *self._values])

    def samples(self, begin: int, steps: int) -> NDArray[np.int64]:
        """Return the steps after which it samples, among the `steps` that follow the first `begin`."""
        return np.arange(begin // self.every + 1, (begin + steps) // self.every + 1) * self.every

    def add(self, steps: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        """Keep what was seen."""
        self._steps.append(steps)
        self._values.append(values.reshape(len(steps), len(self.which)))

    @property
    def _axis(self) -> str:
        return "synapse" if self.variable in ("weight", "eligibility") else "neuron"

    def to_pandas(self) -> Any:
        """Return a data frame, one row a sample, one column a neuron or synapse."""
        pandas = need("pandas", "to_pandas")
        index = pandas.Index(self.time_ms, name="time_ms")
        return pandas.DataFrame(self.values, index=index, columns=pandas.Index(self.which, name=self._axis))

    def to_xarray(self) -> Any:
        """Return an array with the dimensions `time_ms` and `neuron` or `synapse`."""
        coords: Sequence[tuple[str, Any]] = [("time_ms", self.time_ms), (self._axis, self.which)]
        return need("xarray", "to_xarray").DataArray(
            self.values, coords=coords, name=self.variable, attrs={"of": self.of}
        )


class Watch:
    """All monitors of a network, as the kernel takes them."""

    def __init__(self) -> None:
        self._monitors: list[Monitor] = []
        self._table = np.zeros(0, _TABLE)
        self._watched = np.zeros(0, np.int64)

    def add(self, monitor: Monitor, variable: int, part: int, first: int) -> None:
        """Add a monitor of a variable's `part`, whose neurons or synapses are numbered from `first`."""
        begin, end = len(self._watched), len(self._watched) + len(monitor.which)
        row = np.array([(variable, part, monitor.every, begin, end, 0)], _TABLE)
        self._monitors.append(monitor)
        self._table = np.append(self._table, row)
        self._watched = np.append(self._watched, first + monitor.which)

    def opened(self, begin: int, steps: int) -> tuple[NDArray[np.void], NDArray[np.int64], NDArray[np.float64]]:
        """Return the table, the indices, and a buffer for what is to be seen in the `steps` after the first `begin`."""
        sizes = [len(m.samples(begin, steps)) * len(m.which) for m in self._monitors]
        self._table["at"] = np.cumsum([0, *sizes])[:-1]
        return self._table, self._watched, np.zeros(sum(sizes))

    def close(self, begin: int, steps: int, seen: NDArray[np.float64]) -> None:
        """Hand what was seen to the monitors."""
        at = 0
        for monitor in self._monitors:
            samples = monitor.samples(begin, steps)
            size = len(samples) * len(monitor.which)
            monitor.add(samples, seen[at : at + size])
            at += size


_TABLE: Final = np.dtype([(name, np.int64) for name in ("variable", "part", "every", "first", "last", "at")])
