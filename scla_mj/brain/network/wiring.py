"""The memory of a described network: every array that the general kernel reads and writes, in the kernel's own types.

The types of the arrays do not depend on the network's size, so one compiled kernel runs every description of its
precision and rule.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.brain.network import general_kernel
from scla_mj.brain.network.connections import wire
from scla_mj.brain.network.description import (
    NetworkDescription,
    Neurons,
    Synapses,
)
from scla_mj.brain.network.models import LIF, Izhikevich
from scla_mj.brain.network.parameters import LOWER_BOUND, TRACE_LOWER_BOUND, neuron_constants
from scla_mj.brain.network.rules import Rule, modulated_stdp
from scla_mj.randomness import Consumer, generator, noise_lanes

_MOST_STEPS: Final = 1000
"""Steps between two restarts of E and G, each of which costs what a few dozen steps cost."""
_MOST_TAUS: Final = 7.0
"""E stays above exp(-7), so that G keeps 13 digits of what is added to it."""


class Memory(NamedTuple):
    """What the kernel works on. `R` is float32 or float64; N neurons, S synapses, P populations, K projections.

    State: `v`, `u` (N,) R (of a LIF neuron, u is the number of steps for which it is still held); `arriving`
    (slots, N) R, the currents of the coming steps, step n in slot n modulo slots; `lasting` (N,) R, synaptic currents
    with a time constant; `noise_low`, `noise_high` (N,), each neuron's generator; `pre_traces`, `post_traces`
    (traces, N) R; `synapses` (S,), records of weight, scaled, at and target, projection by projection and row by row;
    `modulators`; `courses`, one for each pair of modulator and eligibility time constant; `gathered`
    (courses, steps + 1); `clock`.
    Anatomy: `populations` (P,), `projections` (K,), `limits` and `parameters`, one record a rule; `rows`: where the
    synapses of each source neuron begin; `columns`: where in `onto`, records of synapse and source, those onto each
    target neuron begin; `out`, `into`: projections out of and into each population; `population_of` (N,).
    Scratch: `drive` (N,) R; `fired`, `fired_octets`, `step_counts`.
    """

    v: NDArray[Any]
    u: NDArray[Any]
    arriving: NDArray[Any]
    lasting: NDArray[Any]
    noise_low: NDArray[np.uint32]
    noise_high: NDArray[np.uint32]
    pre_traces: NDArray[Any]
    post_traces: NDArray[Any]
    synapses: NDArray[np.void]
    modulators: NDArray[np.void]
    courses: NDArray[np.void]
    gathered: NDArray[np.float64]
    clock: NDArray[np.int64]
    populations: NDArray[np.void]
    projections: NDArray[np.void]
    limits: NDArray[np.void]
    parameters: NDArray[np.void]
    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    onto: NDArray[np.void]
    out: NDArray[np.int32]
    into: NDArray[np.int32]
    population_of: NDArray[np.int32]
    noise_amplitude: NDArray[Any]
    pre_decay: NDArray[Any]
    post_decay: NDArray[Any]
    trace_bound: Any
    drive: NDArray[Any]
    fired: NDArray[np.uint8]
    fired_octets: NDArray[np.uint64]
    step_counts: NDArray[np.int64]


STATE: Final = Memory._fields[: Memory._fields.index("populations")]
"""The names of what changes."""


def new_memory(description: NetworkDescription, *, seed: int) -> Memory:
    """Return the memory of a checked description: at rest, its weights and the noise drawn from the seed."""
    real = np.dtype(description.precision)
    n, h = description.size, description.step_ms
    rules = _distinct([projection.rule for projection in description.plastic])
    pairs = _distinct([_pair_of(projection) for projection in description.plastic])
    wiring = wire(description, real, generator(seed, Consumer.WEIGHTS))
    populations, out, into = _populations(description, real)
    lanes = noise_lanes(seed, n)
    fired = np.zeros(n + -n % 8, np.uint8)
    steps = max(1, min([_MOST_STEPS, *(int(_MOST_TAUS * tau / h) for _, tau in pairs)]))
    pre, post = ([tau for rule in rules for tau in getattr(rule, taus)] for taus in ("pre_taus_ms", "post_taus_ms"))
    sizes = [population.size for population in description.populations]
    return Memory(
        v=np.repeat([_rest(population)[0] for population in description.populations], sizes).astype(real),
        u=np.repeat([_rest(population)[1] for population in description.populations], sizes).astype(real),
        arriving=np.zeros((max([1, *(p.delay_steps for p in description.projections)]), n), real),
        lasting=np.zeros(n, real),
        noise_low=lanes[0],
        noise_high=lanes[1],
        pre_traces=np.zeros((len(pre), n), real),
        post_traces=np.zeros((len(post), n), real),
        synapses=wiring.synapses,
        modulators=_modulators(description),
        courses=_courses(description, pairs),
        gathered=np.zeros((len(pairs), steps + 1)),
        clock=np.zeros(2, np.int64),
        populations=populations,
        projections=_projections(description, rules, pairs, wiring.tables, real),
        limits=_limits(rules, description.precision),
        parameters=_parameters(rules, real, h),
        rows=wiring.rows,
        columns=wiring.columns,
        onto=wiring.onto,
        out=out,
        into=into,
        population_of=np.repeat(np.arange(len(sizes), dtype=np.int32), sizes),
        noise_amplitude=np.repeat([p.noise * 3.0**0.5 / math.sqrt(h) for p in description.populations], sizes).astype(
            real
        ),
        pre_decay=np.array([math.exp(-h / tau) for tau in pre], real),
        post_decay=np.array([math.exp(-h / tau) for tau in post], real),
        trace_bound=real.type(TRACE_LOWER_BOUND[description.precision]),
        drive=np.zeros(n, real),
        fired=fired,
        fired_octets=fired.view(np.uint64),
        step_counts=np.zeros(len(sizes), np.int64),
    )


def _projections(
    description: NetworkDescription, rules: list[Any], pairs: list[Any], tables: NDArray[np.int64], real: np.dtype[Any]
) -> NDArray[np.void]:
    whole = ("source", "target", "delay", "first_row", "first_column", "first_synapse", "last_synapse", "uniform")
    fields = [*((name, np.int64) for name in (*whole, "rule", "course")), ("weight", real)]
    names = [population.name for population in description.populations]
    table = np.zeros(len(description.projections), fields)
    for record, projection, places in zip(table, description.projections, tables, strict=True):
        record["source"], record["target"] = names.index(projection.source), names.index(projection.target)
        record["delay"], record["uniform"] = projection.delay_steps, projection.is_uniform
        record["first_row"], record["first_column"], record["first_synapse"], record["last_synapse"] = places
        record["rule"] = record["course"] = -1
        if projection.rule is not None:
            record["rule"], record["course"] = rules.index(projection.rule), pairs.index(_pair_of(projection))
        if projection.is_uniform:
            record["weight"] = projection.weight
    return table


def _populations(description: NetworkDescription, real: np.dtype[Any]) -> tuple[Any, Any, Any]:
    """Return the table of populations, and the explicit projections out of and the plastic ones into each."""
    whole = ("kind", "start", "stop", "first_out", "last_out", "first_in", "last_in")
    out, into = list[int](), list[int]()
    constants = [_constants(population, description.step_ms, real.type) for population in description.populations]
    fields = [*((name, np.int64) for name in whole), *((name, real) for name in constants[0])]
    table = np.zeros(len(description.populations), fields)
    for record, population, own, numbers in zip(
        table, description.populations, description.ranges, constants, strict=True
    ):
        record["kind"] = general_kernel.LIF if isinstance(population.model, LIF) else general_kernel.IZHIKEVICH
        record["start"], record["stop"] = own.start, own.stop
        record["first_out"], record["first_in"] = len(out), len(into)
        for k, projection in enumerate(description.projections):
            if projection.source == population.name and not projection.is_uniform:
                out.append(k)
            if projection.target == population.name and projection.rule is not None:
                into.append(k)
        record["last_out"], record["last_in"] = len(out), len(into)
        for name, number in numbers.items():
            record[name] = number
    return table, np.array(out, np.int32), np.array(into, np.int32)


def _constants(population: Neurons, step_ms: float, real: Any) -> dict[str, Any]:
    """Return one step's numbers of a population's neurons, by the names that the kernel reads."""
    model, tau = population.model, population.synaptic_tau_ms
    kind = model if isinstance(model, Izhikevich) else Izhikevich(0.0, 0.0, 0.0, 0.0)
    numbers = {**neuron_constants(kind, step_ms, real)._asdict(), "rest": 0.0, "keep": 0.0, "gain": 0.0}
    if isinstance(model, LIF):
        keep = math.exp(-step_ms / model.tau_ms)
        numbers |= {"rest": model.rest_mv, "keep": keep, "gain": model.resistance * (1.0 - keep)}
        numbers |= {"peak": model.threshold_mv, "reset_v": model.reset_mv}
        numbers |= {"reset_u": round(model.refractory_ms / step_ms)}
    if tau > 0.0:
        numbers["pulse"] = 1.0
    return {**numbers, "lasting": math.exp(-step_ms / tau) if tau > 0.0 else 0.0, "noise_unit": 2.0**-31}


def _rest(population: Neurons) -> tuple[float, float]:
    """Return v and u at the start."""
    model = population.model
    return (model.c, model.b * model.c) if isinstance(model, Izhikevich) else (model.rest_mv, 0.0)


def _modulators(description: NetworkDescription) -> NDArray[np.void]:
    names = [population.name for population in description.populations]
    numbers = ("level", "baseline", "decay", "per_spike", "lower_bound")
    table = np.zeros(len(description.modulators), [*((name, np.float64) for name in numbers), ("source", np.int64)])
    for record, modulator in zip(table, description.modulators, strict=True):
        record["level"] = record["baseline"] = modulator.baseline
        record["decay"] = math.exp(-description.step_ms / modulator.tau_ms)
        record["lower_bound"] = LOWER_BOUND[description.precision]
        record["per_spike"] = modulator.per_spike
        record["source"] = names.index(modulator.source) if modulator.source else -1
    return table


def _courses(description: NetworkDescription, pairs: list[tuple[str, float]]) -> NDArray[np.void]:
    names = [modulator.name for modulator in description.modulators]
    fields = [("modulator", np.int64), ("decay", np.float64), ("decayed", np.float64), ("sign", np.float64)]
    decays = [math.exp(-description.step_ms / tau) for _, tau in pairs]
    return np.array(
        [(names.index(name), decay, 1.0, 0.0) for (name, _), decay in zip(pairs, decays, strict=True)], fields
    )


def _limits(rules: list[Rule], precision: str) -> NDArray[np.void]:
    """Return one record per rule: its range, and which traces are its own."""
    real = np.dtype(precision)
    reals, whole = ("low", "high", "kept", "lower_bound"), ("first_x", "last_x", "first_y", "last_y")
    table = np.zeros(len(rules), [*((name, real) for name in reals), *((name, np.int64) for name in whole)])
    x = y = 0
    for record, rule in zip(table, rules, strict=True):
        bounds = (x, x + len(rule.pre_taus_ms), y, y + len(rule.post_taus_ms))
        record["first_x"], record["last_x"], record["first_y"], record["last_y"] = bounds
        x, y = bounds[1], bounds[3]
        record["low"], record["high"], record["kept"] = rule.low, rule.high, 0.0 if rule.nearest else 1.0
        record["lower_bound"] = LOWER_BOUND[precision]
    return table


def _parameters(rules: list[Rule], real: np.dtype[Any], step_ms: float) -> NDArray[np.void]:
    """Return one record per rule: its parameters and the step, which a rule may read too."""
    names = list(rules[0].parameters) if rules else list(modulated_stdp().parameters)
    table = np.zeros(len(rules), [(name, real) for name in (*names, "step_ms")])
    for record, rule in zip(table, rules, strict=True):
        record["step_ms"] = step_ms
        for name, value in rule.parameters.items():
            record[name] = value
    return table


def _distinct(things: Iterable[Any]) -> list[Any]:
    """Return each once, in the order of their first appearance; they need not be hashable."""
    found: list[Any] = []
    for thing in things:
        if thing not in found:
            found.append(thing)
    return found


def _pair_of(projection: Synapses) -> tuple[str, float]:
    return projection.modulator, projection.rule.eligibility_tau_ms if projection.rule is not None else 0.0
