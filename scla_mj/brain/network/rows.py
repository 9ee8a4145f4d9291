"""Updates of the synapses of one sensory neuron in one projection; synapses.py explains them and names the symbols.

Every loop has the 100 steps of a block, few arrays and no branch, so that the compiler vectorises it. Numbers are of
the arrays' own format: a literal would be a float64 and promote the result.
"""

from typing import Any, Final

import numpy as np

from scla_mj.anatomy import NEURONS_PER_SIDE
from scla_mj.compiled import leaf_njit

BLOCK: Final = NEURONS_PER_SIDE
"""Populations consist of blocks of this size; a projection connects block with block, all to all."""


@leaf_njit()
def deliver(current: Any, weight: Any) -> None:
    """Add the weights to the motor neurons' currents."""
    for j in range(BLOCK):
        current[j] += weight[j]


@leaf_njit()
def depress(scaled: Any, depression: Any, trace: Any, reach: Any, post: Any) -> None:
    """Subtract the depression of a sensory spike from eligibility, and `reach` P, so that P counts from now on."""
    for j in range(BLOCK):
        scaled[j] -= depression * trace[j] + reach * post[j]


@leaf_njit(inline="always")
def hold_back(weight: Any, reach: Any, since: Any, post: Any, post_gathered: Any) -> None:
    """Subtract from current weights what `reach` would add for the stretch before the spike."""
    for j in range(BLOCK):
        weight[j] -= reach * (since * post[j] - post_gathered[j])


@leaf_njit(inline="always")
def potentiate(scaled: Any, reach: Any, post: Any) -> None:
    """Add to eligibility what motor spikes added."""
    for j in range(BLOCK):
        scaled[j] += reach * post[j]


@leaf_njit()
def bring_on(
    synapses: Any, post: Any, post_gathered: Any, reach: Any, moved: Any, since: Any, weight_max: Any, table: Any
) -> None:
    """Bring weights to the current, clipped w and `scaled` to Z; `table` keeps the old ones and a margin of error.

    A negative `margin` says that a weight may have reached a bound and then turned back from it. Only a Z that became
    positive turns its weight back, upwards if G rises and downwards if it falls, by at most the current Z times the
    change of G.
    """
    weight, scaled = synapses.weight, synapses.scaled
    zero, no_bound = weight.dtype.type(0), weight.dtype.type(np.inf)
    lowest = zero if moved > zero else -no_bound
    highest = weight_max if moved < zero else no_bound
    for j in range(BLOCK):
        w, z = weight[j], scaled[j]
        table.weight[j], table.scaled[j] = w, z
        now = z + reach * post[j]
        ended = w + (z * moved + reach * (since * post[j] - post_gathered[j]))
        turned = ended - now * moved
        table.margin[j] = max(max(z, -now), min(turned - lowest, highest - turned))
        weight[j] = min(max(ended, zero), weight_max)
        scaled[j] = now


@leaf_njit()
def is_sure(margin_bits: Any, sign_bits: Any) -> bool:
    """Return whether no margin is negative: none, viewed as 64-bit integers, has one of the `sign_bits`."""
    together = np.uint64(0)
    for i in range(margin_bits.shape[0]):
        together |= margin_bits[i]
    return bool((together & sign_bits) == 0)


@leaf_njit()
def settle_row(weight: Any, scaled: Any, moved: Any, decayed: Any, weight_max: Any, lower_bound: Any) -> None:
    """Bring `weight` to the current, clipped w and `scaled` to the eligibility c, zero below its lower bound."""
    zero = weight.dtype.type(0)
    if moved != zero:
        for j in range(BLOCK):
            weight[j] = min(max(weight[j] + scaled[j] * moved, zero), weight_max)
    for j in range(BLOCK):
        eligibility = scaled[j] * decayed
        scaled[j] = eligibility if abs(eligibility) >= lower_bound else zero


@leaf_njit(inline="always")
def fill(values: Any, number: Any) -> None:
    """Set every value."""
    for i in range(values.shape[0]):
        values[i] = number
