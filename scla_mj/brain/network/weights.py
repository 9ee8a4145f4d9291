"""The connections of a network of any description: who is connected with whom, and how strongly, by name."""

from __future__ import annotations

import functools
import math
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scla_mj.anatomy import Anatomy, Population, Projection
from scla_mj.brain.network import general_kernel, general_synapses
from scla_mj.brain.network.description import Blocks, NetworkDescription, Synapses
from scla_mj.brain.network.inputs import fill
from scla_mj.brain.network.rules import Rule, compiled_functions, fingerprint, modulated_stdp
from scla_mj.brain.network.window import Window
from scla_mj.brain.network.wiring import new_memory
from scla_mj.errors import SclaError
from scla_mj.validation import shown

SYNAPSE_VARIABLES: Final = {"weight": general_kernel.WEIGHT, "eligibility": general_kernel.ELIGIBILITY}


class Connections(Window):
    """A window of a described network (general.py), and its synapses by projection.

    Attributes:
        description: as checked, with every projection's name and every modulator.
        populations: where each population's neurons begin and end, by `name`, `start`, `stop`.
        memory: the state and the anatomy as the kernel keeps them (wiring.py).
    """

    def __init__(self, description: NetworkDescription, *, seed: int) -> None:
        self.description = description.check()
        self.populations = self.description.ranges
        self.memory = new_memory(self.description, seed=seed)
        kinds, modulators = len(self.populations), len(self.description.modulators)
        real = self.memory.v.dtype
        super().__init__(neurons=self.description.size, populations=kinds, modulators=modulators, real=real)
        rules = [projection.rule for projection in self.description.plastic if projection.rule is not None]
        self._kernel, self._read = _kernel_of(*_compiled_with((*rules, modulated_stdp())[0]))
        self._projections = {p.name: k for k, p in enumerate(self.description.projections)}

    @property
    def anatomy(self) -> Anatomy:
        """What a brain with this network declares: its populations, and its plastic projections."""
        plastic = []
        for p in self.description.plastic:
            span = (p.rule.low, p.rule.high) if p.rule is not None and p.rule.low < p.rule.high else None
            shape = self._shape(*self._projection(p.name))
            plastic.append(Projection(p.name, p.source, p.target, shape, weight_range=span))
        return Anatomy(self.populations, tuple(plastic))

    def synapses(self, projection: str) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the source and the target neuron of each synapse, from 0 in its population, by source, (n,) each."""
        described, table = self._projection(projection)
        source, target = self._ends(described)
        if described.is_uniform:
            return np.repeat(np.arange(source.size), target.size), np.tile(np.arange(target.size), source.size)
        first = int(table["first_row"])
        own = self.memory.synapses[table["first_synapse"] : table["last_synapse"]]
        per_row = np.diff(self.memory.rows[first : first + source.size + 1])
        return np.repeat(np.arange(source.size), per_row), own["target"].astype(np.int64) - target.start

    def weights(self, projection: str) -> NDArray[Any]:
        """Return a copy of a projection's weights: (source, target) if it is all to all, else (n,) as `synapses`."""
        described, table = self._projection(projection)
        if described.is_uniform:
            return np.full(self._shape(described, table), table["weight"], self.memory.v.dtype)
        return self._values(projection, "weight")

    def eligibility(self, projection: str) -> NDArray[Any]:
        """Return a copy of a plastic projection's eligibilities, shaped like its weights.

        Raises:
            SclaError: there is no such projection, or it is fixed.
        """
        if self._projection(projection)[0].rule is None:
            raise SclaError(f"{projection} is fixed and has no eligibility: give its Synapses a rule")
        return self._values(projection, "eligibility")

    def mean_weights(self) -> NDArray[np.float64]:
        """Return the mean weight of each plastic projection, in their order."""
        return np.array([self.weights(p.name).mean(dtype=np.float64) for p in self.description.plastic])

    def set_weights(self, projection: str, weights: ArrayLike) -> None:
        """Set a projection's weights, to one number or to values in the shape that `weights` returns.

        Raises:
            SclaError: another shape, what is not a number, or weights out of the range of the projection's rule.
        """
        described, table = self._projection(projection)
        shape = self._shape(described, table)
        values = np.broadcast_to(weights, shape) if np.ndim(weights) == 0 else weights
        drawn = fill(f"weights of {projection}", np.empty(shape, self.memory.v.dtype), values)
        low, high = (described.rule.low, described.rule.high) if described.rule is not None else (-1e6, 1e6)
        if drawn.size and not low <= drawn.min() <= drawn.max() <= high:
            raise SclaError(
                f"weights of {projection} go from {drawn.min():g} to {drawn.max():g}: "
                f"every weight must be a number from {low:g} to {high:g}"
            )
        if described.is_uniform:
            if drawn.min() != drawn.max():
                raise SclaError(f"{projection} has one weight for all its pairs: set it to one number")
            table["weight"] = drawn.flat[0]
            return
        own = self.memory.synapses[table["first_synapse"] : table["last_synapse"]]
        own["weight"], own["at"] = drawn.reshape(-1), self.memory.clock[general_synapses.NOW]

    def _projection(self, name: str) -> tuple[Synapses, Any]:
        """Return a projection as described, and its record in the memory."""
        if name not in self._projections:
            raise SclaError(f"{shown(name)} is no projection: known are {', '.join(self._projections)}")
        return self.description.projections[self._projections[name]], self.memory.projections[self._projections[name]]

    def _ends(self, projection: Synapses) -> tuple[Population, Population]:
        named = {population.name: population for population in self.populations}
        return named[projection.source], named[projection.target]

    def _shape(self, projection: Synapses, table: Any) -> tuple[int, ...]:
        source, target = self._ends(projection)
        count = int(table["last_synapse"] - table["first_synapse"])
        if isinstance(projection.connect, Blocks):
            number = projection.connect.number
            shape = number, source.size // number, target.size // number
            return shape if count == math.prod(shape) else (count,)
        whole = projection.is_uniform or (projection.connect == "all to all" and count == source.size * target.size)
        return (source.size, target.size) if whole else (count,)

    def _values(self, projection: str, variable: str) -> NDArray[Any]:
        described, table = self._projection(projection)
        values = np.empty(int(table["last_synapse"] - table["first_synapse"]), self.memory.v.dtype)
        place = self._projections[projection], int(table["first_synapse"])
        self._read(self.memory, SYNAPSE_VARIABLES[variable], *place, values)
        return values.reshape(self._shape(described, table))


def _compiled_with(rule: Rule) -> tuple[Any, ...]:
    """Return all that makes one kernel differ from another."""
    return rule.functions, (len(rule.pre_taus_ms), len(rule.post_taus_ms))


@functools.cache
def _kernel_of(functions: tuple[Any, ...], traces: tuple[int, int]) -> tuple[Any, Any]:
    """Return the kernel, and what reads synapses; both are compiled at their first call."""
    return general_kernel.build(compiled_functions(functions), traces, fingerprint(functions) + repr(traces))
