"""Plasticity rules: what a presynaptic spike does, what a postsynaptic spike does, how a weight follows.

A `Rule` is three plain functions of numbers, with which the general kernel (general_kernel.py) is compiled:

    on_pre(w, c, x, y, p)  -> w, c    the presynaptic neuron fired; x is raised afterwards
    on_post(w, c, x, y, p) -> w, c    the postsynaptic neuron fired, after all `on_pre` of the step; y is raised then
    follow(w, dose, p)     -> w       the weight after a stretch in which nobody fired

w is the weight, c the eligibility, x[0], x[1], ... the presynaptic neuron's traces and y[0], ... the postsynaptic
one's, one for each time constant: a spike adds 1 to a trace (or, `nearest`, sets it to 1), and it decays. p has the
rule's `parameters` by name. c decays with its own time constant. `dose` is the sum of c times the modulator, step by
step: a rule dw/dt = c m f(w) has the flow of f over the `dose` as its `follow` (f = 1: w + dose). So it must leave w as
it is for a dose of 0, and take two doses of one sign as it takes their sum.

The functions may use numbers and functions of `math`, and nothing that changes between two calls.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import CodeType, FunctionType, SimpleNamespace
from typing import Any

import numpy as np

from scla_mj.compiled import leaf_njit
from scla_mj.validation import shown


@dataclass(frozen=True)
class Rule:
    """How the weights of a plastic projection change; see the head of this module.

    Attributes:
        on_pre, on_post, follow: its functions; all plastic projections of a network have the same three.
        parameters: numbers by name, which may differ from projection to projection.
        pre_taus_ms, post_taus_ms: time constants of the traces x and y, one or more each.
        eligibility_tau_ms: time constant of c.
        low, high: weights are clipped to this range.
        nearest: a spike sets a trace to 1 instead of adding 1 to it: only the nearest spikes pair.
    """

    on_pre: Callable[..., Any]
    on_post: Callable[..., Any]
    follow: Callable[..., Any]
    parameters: Mapping[str, float] = field(default_factory=dict)
    pre_taus_ms: tuple[float, ...] = (20.0,)
    post_taus_ms: tuple[float, ...] = (20.0,)
    eligibility_tau_ms: float = 1000.0
    low: float = 0.0
    high: float = 4.0
    nearest: bool = False

    @property
    def functions(self) -> tuple[Callable[..., Any], ...]:
        """The three functions."""
        return self.on_pre, self.on_post, self.follow


def complaint(rule: Rule) -> str:
    """Return what is wrong with a rule's functions, each tried once on plain numbers; "" if nothing is."""
    weight, p = (rule.low + rule.high) / 2.0, SimpleNamespace(**rule.parameters)
    traces = (0.5,) * len(rule.pre_taus_ms), (0.5,) * len(rule.post_taus_ms)
    spike, stretch = (weight, 0.0, *traces, p), (weight, 0.0, p)
    for name, arguments, shape in (("on_pre", spike, (2,)), ("on_post", spike, (2,)), ("follow", stretch, ())):
        function = getattr(rule, name)
        try:
            found = getattr(function, "py_func", function)(*arguments)
        except (AttributeError, LookupError, NameError, TypeError) as error:
            has = f"; p has {', '.join(rule.parameters)}" if isinstance(error, AttributeError) else ""
            return f"{name} raised {type(error).__name__}: {error}{has}"
        except (ArithmeticError, ValueError):  # of these numbers, perhaps not of others
            continue
        if found is None or np.shape(found) != shape:
            return f"{name} returned {shown(found)}: it must return {'w, c' if shape else 'w'}"
    return ""


def _pair_pre(w: Any, c: Any, x: Any, y: Any, p: Any) -> Any:
    return w, c - p.depression * y[0]


def _pair_post(w: Any, c: Any, x: Any, y: Any, p: Any) -> Any:
    return w, c + p.potentiation * x[0]


def _additive(w: Any, dose: Any, p: Any) -> Any:
    return w + p.rate * dose


def modulated_stdp(
    potentiation: float = 0.1,
    depression: float = 0.12,
    *,
    pre_tau_ms: float = 20.0,
    post_tau_ms: float = 20.0,
    rate: float = 0.05,
    eligibility_tau_ms: float = 1000.0,
    low: float = 0.0,
    high: float = 4.0,
) -> Rule:
    """Return the paper's rule: pairs of spikes mark a synapse, dopamine changes it (Izhikevich 2007; docs/model.md).

    `rate` is the change of a weight per step, per unit of eligibility times modulator.
    """
    return Rule(
        _pair_pre,
        _pair_post,
        _additive,
        {"potentiation": potentiation, "depression": depression, "rate": rate},
        (pre_tau_ms,),
        (post_tau_ms,),
        eligibility_tau_ms,
        low,
        high,
    )


def _triplet_pre(w: Any, c: Any, x: Any, y: Any, p: Any) -> Any:
    return w - y[0] * (p.pair_minus + p.triplet_minus * x[1]), c


def _triplet_post(w: Any, c: Any, x: Any, y: Any, p: Any) -> Any:
    return w + x[0] * (p.pair_plus + p.triplet_plus * y[1]), c


def _unmoved(w: Any, dose: Any, p: Any) -> Any:
    return w


def triplet_stdp(
    pair_plus: float = 5e-10,
    pair_minus: float = 7e-3,
    triplet_plus: float = 6.2e-3,
    triplet_minus: float = 2.3e-4,
    *,
    tau_plus_ms: float = 16.8,
    tau_minus_ms: float = 33.7,
    tau_x_ms: float = 101.0,
    tau_y_ms: float = 125.0,
    scale: float = 1.0,
    low: float = 0.0,
    high: float = 4.0,
) -> Rule:
    """Return the triplet rule of Pfister and Gerstner (2006), equations 3 and 4: weights change at the spikes.

    The defaults are their visual cortex, all to all, full model (Table 4); `scale` is mV per unit of theirs.
    """
    amplitudes = {
        "pair_plus": pair_plus,
        "pair_minus": pair_minus,
        "triplet_plus": triplet_plus,
        "triplet_minus": triplet_minus,
    }
    scaled = {name: scale * value for name, value in amplitudes.items()}
    pre, post = (tau_plus_ms, tau_x_ms), (tau_minus_ms, tau_y_ms)
    return Rule(_triplet_pre, _triplet_post, _unmoved, scaled, pre, post, low=low, high=high)


@functools.cache
def compiled_functions(functions: tuple[Callable[..., Any], ...]) -> tuple[Any, ...]:
    """Return a rule's functions as parts of a compiled loop."""
    return tuple(leaf_njit()(function) for function in functions)


def fingerprint(functions: tuple[Callable[..., Any], ...]) -> str:
    """Return a text that tells functions with other code, or that use other numbers, apart: for the compiled cache."""
    return repr((sys.version, [_traits(function) for function in functions]))


def _traits(thing: Any) -> Any:
    function = getattr(thing, "py_func", thing)
    if not isinstance(function, FunctionType):
        return repr(thing)
    code, known = function.__code__, function.__globals__
    cells = [cell.cell_contents for cell in function.__closure__ or ()]
    used = [known[name] for name in code.co_names if name in known]
    return _code(code), function.__defaults__, [_traits(value) for value in (*cells, *used)]


def _code(code: CodeType) -> Any:
    parts = [_code(part) if isinstance(part, CodeType) else part for part in code.co_consts]
    return code.co_code, parts, code.co_names, code.co_varnames
