"""A network as data: populations, the projections between them, and what modulates their plasticity.

Plain frozen dataclasses; `Network.from_description` builds one. Currents, weights and noise have one unit, the input of
equation 1, where 15 makes a regular spiking neuron fire at 30 Hz; potentials are in mV, times in ms.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

from scla_mj.anatomy import Population, stacked
from scla_mj.brain.network.models import IZHIKEVICH_TYPES, LIF, Izhikevich
from scla_mj.brain.network.rules import Rule, complaint
from scla_mj.config import Precision
from scla_mj.errors import SclaError
from scla_mj.validation import shown


@dataclass(frozen=True)
class Neurons:
    """A population: neurons of one kind.

    Attributes:
        neuron: the name of an Izhikevich type, or a model with its parameters.
        noise: standard deviation of a uniform current, drawn anew for each neuron and step.
        drive: a constant current.
        synaptic_tau_ms: a spike's current decays with this time constant; 0: it lasts one step.
        role, colour: those of a brain's anatomy (anatomy.py); the name must do for one, too.
    """

    name: str
    size: int
    neuron: str | Izhikevich | LIF = "regular spiking"
    noise: float = 0.0
    drive: float = 0.0
    synaptic_tau_ms: float = 0.0
    role: str = ""
    colour: str | None = None

    @property
    def model(self) -> Izhikevich | LIF:
        """The model, looked up where it has a name."""
        return IZHIKEVICH_TYPES[self.neuron] if isinstance(self.neuron, str) else self.neuron


@dataclass(frozen=True)
class Uniform:
    """Weights drawn uniformly from [low, high)."""

    low: float
    high: float


@dataclass(frozen=True)
class Normal:
    """Weights drawn from a normal distribution."""

    mean: float
    deviation: float


@dataclass(frozen=True)
class Blocks:
    """Both populations fall into so many blocks of equal size; each block is connected all to all with its like."""

    number: int


Connect = Literal["all to all", "one to one"] | Blocks | float


@dataclass(frozen=True)
class Synapses:
    """A projection: the synapses from one population to another, or to itself.

    Attributes:
        weight: a number or a distribution; negative inhibits. Plastic weights are clipped to their rule's range.
        connect: "all to all", "one to one" (equal sizes), `Blocks(number)`, or the probability of each pair.
        delay_steps: a spike acts so many steps later; 1: in the next step. The rule sees it in the step of the spike.
        rule: how the weights change (rules.py); None: they are fixed.
        modulator: the name of the `Modulator` of the rule. Projections of one name share one concentration.
        self_connections: whether a neuron may be connected with itself.
        name: "SOURCEtoTARGET" unless given.
    """

    source: str
    target: str
    weight: float | Uniform | Normal = 1.0
    connect: Connect = "all to all"
    delay_steps: int = 1
    rule: Rule | None = None
    modulator: str = "dopamine"
    self_connections: bool = True
    name: str = ""

    @property
    def is_uniform(self) -> bool:
        """Whether all pairs of neurons have one fixed weight, so that no synapse needs a memory."""
        whole = self.self_connections or self.source != self.target
        constant = self.rule is None and isinstance(self.weight, float | int)
        return constant and self.connect == "all to all" and whole


@dataclass(frozen=True)
class Modulator:
    """A concentration m, such as dopamine: m' = (baseline - m) / tau + releases.

    With `source` every spike of that population releases `per_spike`.
    """

    name: str = "dopamine"
    tau_ms: float = 200.0
    baseline: float = 0.0
    source: str = ""
    per_spike: float = 0.0


@dataclass(frozen=True)
class NetworkDescription:
    """A whole network. Neurons are numbered in the order of the populations.

    Plastic projections name one of `modulators`; where there are none, dopamine with its defaults.

    Raises:
        SclaError: names do not fit together, or a number is out of its range; from `check`, which a network calls.
    """

    populations: Sequence[Neurons]
    projections: Sequence[Synapses] = ()
    modulators: Sequence[Modulator] = ()
    step_ms: float = 1.0
    precision: Precision = "float32"

    @property
    def size(self) -> int:
        """Number of neurons."""
        return sum(population.size for population in self.populations)

    @property
    def ranges(self) -> tuple[Population, ...]:
        """Where each population's neurons begin and end."""
        ranges = stacked(*((population.name, population.size, population.role) for population in self.populations))
        return tuple(own._replace(colour=p.colour) for own, p in zip(ranges, self.populations, strict=True))

    @property
    def plastic(self) -> tuple[Synapses, ...]:
        """The plastic projections."""
        return tuple(projection for projection in self.projections if projection.rule is not None)

    def check(self) -> NetworkDescription:
        """Return it with every name and modulator spelt out."""
        for kind, items in ((Neurons, self.populations), (Synapses, self.projections), (Modulator, self.modulators)):
            if not all(isinstance(item, kind) for item in items):
                raise SclaError(f"a description holds something else where it should hold {kind.__name__}(...)")
        sizes = {population.name: population.size for population in self.populations}
        _require(len(sizes) > 0, "a network without populations: it must have one or more")
        _unique("population", [population.name for population in self.populations])
        _number("step_ms", self.step_ms, 0.05, 1.0)
        _require(
            self.precision in ("float32", "float64"),
            f"precision is {shown(self.precision)}: it must be float32 or float64",
        )
        for population in self.populations:
            _check_population(population, self.step_ms)
        _require(self.size <= _MOST_NEURONS, f"{self.size} neurons: a network has {_MOST_NEURONS} at most")
        named = [p if p.name else dataclasses.replace(p, name=f"{p.source}to{p.target}") for p in self.projections]
        _unique("projection", [projection.name for projection in named])
        for projection in named:
            _check_projection(projection, sizes, self.step_ms)
        rules = [projection.rule for projection in named if projection.rule is not None]
        if len({(*r.functions, *r.parameters, len(r.pre_taus_ms), len(r.post_taus_ms)) for r in rules}) > 1:
            raise SclaError(
                "rules differ in their functions, parameters' names or number of traces: all must be of one"
            )
        return dataclasses.replace(self, projections=tuple(named), modulators=_modulators(self, named))


_MOST_NEURONS: Final = 1_000_000
_MOST_DELAY: Final = 10_000


def _modulators(description: NetworkDescription, named: Sequence[Synapses]) -> tuple[Modulator, ...]:
    """Return the modulators, of which plastic projections name one; where none is described, dopamine."""
    known = {modulator.name: modulator for modulator in description.modulators}
    _unique("modulator", [modulator.name for modulator in description.modulators])
    plastic = [projection for projection in named if projection.rule is not None]
    if plastic and not known:
        known["dopamine"] = Modulator("dopamine")
    sources = {population.name for population in description.populations} | {""}
    for m in known.values():
        _number(f"modulator {m.name}: tau_ms", m.tau_ms, 0.05, 3.6e6)
        _number(f"modulator {m.name}: baseline", m.baseline, -1000.0, 1000.0)
        _number(f"modulator {m.name}: per_spike", m.per_spike, -1000.0, 1000.0)
        _require(
            m.source in sources, f"modulator {m.name}: source is {shown(m.source)}: it must be a population's name"
        )
    for projection in plastic:
        if projection.modulator not in known:
            named_so = f"projection {projection.name}: modulator is {shown(projection.modulator)}"
            raise SclaError(
                f"{named_so}: known are {', '.join(known)}; any other must be in the description's modulators"
            )
    return tuple(known.values())


def _check_population(population: Neurons, step_ms: float) -> None:
    name = f"population {shown(population.name)}"
    _require(isinstance(population.name, str) and bool(population.name), f"{name}: its name must be a text")
    if type(population.size) is not int or population.size < 1:
        raise SclaError(f"{name}: size is {shown(population.size)}: it must be a whole number, 1 or more")
    if isinstance(population.neuron, str) and population.neuron not in IZHIKEVICH_TYPES:
        raise SclaError(f"{name}: neuron is {shown(population.neuron)}: known types are {', '.join(IZHIKEVICH_TYPES)}")
    if not isinstance(population.model, Izhikevich | LIF):
        raise SclaError(f"{name}: neuron is {shown(population.neuron)}: it must be a type's name, Izhikevich or LIF")
    for item in dataclasses.fields(population.model):
        _number(f"{name}: {item.name}", getattr(population.model, item.name), -1000.0, 1000.0)
    if isinstance(population.model, LIF):
        model = population.model
        _number(f"{name}: tau_ms", model.tau_ms, step_ms, 1000.0)
        _number(f"{name}: refractory_ms", model.refractory_ms, 0.0, 1000.0)
        _require(model.reset_mv < model.threshold_mv, f"{name}: reset_mv must lie below threshold_mv")
    _number(f"{name}: noise", population.noise, 0.0, 1e4)
    _number(f"{name}: drive", population.drive, -1e6, 1e6)
    _number(f"{name}: synaptic_tau_ms", population.synaptic_tau_ms, 0.0, 1e4)


def _check_projection(projection: Synapses, sizes: dict[str, int], step_ms: float) -> None:
    name = f"projection {projection.name}"
    for end in (projection.source, projection.target):
        _require(end in sizes, f"{name}: {shown(end)} is no population: known are {', '.join(sizes)}")
    weight = projection.weight
    for part in dataclasses.astuple(weight) if isinstance(weight, Uniform | Normal) else (weight,):
        _number(f"{name}: weight", part, -1e6, 1e6)
    if isinstance(weight, Uniform):
        _number(f"{name}: weight's high end", weight.high, weight.low, 1e6)
    if isinstance(weight, Normal):
        _number(f"{name}: weight's deviation", weight.deviation, 0.0, 1e6)
    connect = projection.connect
    source, target = sizes[projection.source], sizes[projection.target]
    if isinstance(connect, Blocks):
        number = connect.number
        if type(number) is not int or number < 1 or source % number or target % number:
            raise SclaError(
                f"{name}: {shown(number)} blocks of {source} and of {target} neurons: both must be multiples of it"
            )
    elif not isinstance(connect, str):
        _number(f"{name}: connect, a probability,", connect, 0.0, 1.0)
    elif connect not in ("all to all", "one to one"):
        raise SclaError(
            f"{name}: connect is {shown(connect)}: it must be all to all, one to one, Blocks(...) or a probability"
        )
    if connect == "one to one":
        _require(source == target, f"{name}: one to one from {source} neurons to {target}: sizes must be equal")
    delay = projection.delay_steps
    if type(delay) is not int or not 1 <= delay <= _MOST_DELAY:
        raise SclaError(f"{name}: delay_steps is {shown(delay)}: it must be a whole number, 1 to {_MOST_DELAY}")
    if projection.rule is not None:
        _check_rule(name, projection.rule, step_ms)


def _check_rule(name: str, rule: Rule, step_ms: float) -> None:
    _require(isinstance(rule, Rule), f"{name}: rule is {shown(rule)}: it must be a Rule, such as modulated_stdp()")
    for function in rule.functions:
        _require(callable(function), f"{name}: {shown(function)} is no function of its rule")
    for tau in (*rule.pre_taus_ms, *rule.post_taus_ms, rule.eligibility_tau_ms):
        _number(f"{name}: a time constant of its rule", tau, 0.05, 3.6e6)
    for taus in (rule.pre_taus_ms, rule.post_taus_ms):
        _require(1 <= len(taus) <= 3, f"{name}: its rule has {len(taus)} traces on one side: it must have 1 to 3")
    _require(all(str(key).isidentifier() for key in rule.parameters), f"{name}: its rule's parameters have odd names")
    for key, value in rule.parameters.items():
        _number(f"{name}: {key}", value, -1e9, 1e9)
    _number(f"{name}: low", rule.low, -1e6, 1e6)
    _number(f"{name}: high", rule.high, rule.low, 1e6)
    wrong = complaint(rule)
    _require(not wrong, f"{name}: its rule's {wrong}")


def _unique(kind: str, names: Iterable[str]) -> None:
    seen: set[str] = set()
    for name in names:
        _require(name not in seen, f"two {kind}s are called {shown(name)}: give each a name of its own")
        seen.add(name)


def _number(name: str, value: Any, low: float, high: float) -> None:
    fits = isinstance(value, float | int) and not isinstance(value, bool) and math.isfinite(value)
    _require(fits and low <= value <= high, f"{name} is {shown(value)}: it must be a number from {low:g} to {high:g}")


def _require(holds: bool, otherwise: str) -> None:
    if not holds:
        raise SclaError(otherwise)
