"""Readers of the current weights, which change nothing in the network."""

from typing import Any

from scla_mj.brain.network.rows import BLOCK
from scla_mj.compiled import cached_njit


@cached_njit()
def read_weights(memory: Any, now: Any) -> None:
    """Write the current weights into `now`, (8, n, 100)."""
    m = memory[0]
    real, weight_max = now.dtype.type, m.plasticity.weight_max
    zero = real(0)
    for k in range(now.shape[0]):
        for row in range(now.shape[1]):
            weight, scaled = m.synapses[k, row].weight, m.synapses[k, row].scaled
            moved = real(m.gathered[k] - m.gathered_at[k, row])
            for j in range(BLOCK):
                now[k, row, j] = min(max(weight[j] + scaled[j] * moved, zero), weight_max)


@cached_njit()
def mean_weights(memory: Any, at: Any, means: Any) -> None:
    """Write each projection's mean weight into `means`, (8,) float64, unless it is up to date.

    `at`, (8,) int64, is the value of `dosed` for which a mean was computed. Sums go by column: unlike one running sum,
    that vectorises.
    """
    m = memory[0]
    real, weight_max, columns = m.trace.dtype.type, m.plasticity.weight_max, m.columns
    zero = real(0)
    for k in range(means.shape[0]):
        if at[k] == m.dosed[k]:
            continue
        at[k] = m.dosed[k]
        for j in range(BLOCK):
            columns[j] = 0.0
        for row in range(m.synapses.shape[1]):
            weight, scaled = m.synapses[k, row].weight, m.synapses[k, row].scaled
            moved = real(m.gathered[k] - m.gathered_at[k, row])
            for j in range(BLOCK):
                columns[j] += min(max(weight[j] + scaled[j] * moved, zero), weight_max)
        total = 0.0
        for j in range(BLOCK):
            total += columns[j]
        means[k] = total / (m.synapses.shape[1] * BLOCK)
