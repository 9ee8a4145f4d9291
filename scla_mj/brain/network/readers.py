"""The lazy weights as they are now, for whoever wants to see them; nothing is changed by it."""

from typing import Any

from scla_mj.brain.network.rows import BLOCK
from scla_mj.compiled import cached_njit


@cached_njit()
def read_weights(weight: Any, scaled: Any, gathered: Any, gathered_at: Any, bounds: Any, now: Any) -> None:
    """Write the weights of now into `now`, (8, n, 100), and change nothing; `bounds`, (2,), clip them."""
    real, low, high = now.dtype.type, bounds[0], bounds[1]
    for k in range(now.shape[0]):
        for row in range(now.shape[1]):
            moved = real(gathered[k] - gathered_at[k, row])
            for j in range(BLOCK):
                now[k, row, j] = min(max(weight[k, row, j] + scaled[k, row, j] * moved, low), high)


@cached_njit()
def mean_weights(
    weight: Any,
    scaled: Any,
    gathered: Any,
    gathered_at: Any,
    bounds: Any,
    dosed: Any,
    columns: Any,
    at: Any,
    means: Any,
) -> None:
    """Write each projection's mean weight into `means`, (8,) float64, where dopamine has changed it since.

    `at`, (8,) int64, is what `dosed` was when those that are there were made. Sums by column, in the scratch array
    `columns`, (100,) float64: unlike one running sum, that vectorises.
    """
    real, low, high = weight.dtype.type, bounds[0], bounds[1]
    for k in range(means.shape[0]):
        if at[k] == dosed[k]:
            continue
        at[k] = dosed[k]
        for j in range(BLOCK):
            columns[j] = 0.0
        for row in range(weight.shape[1]):
            moved = real(gathered[k] - gathered_at[k, row])
            for j in range(BLOCK):
                columns[j] += min(max(weight[k, row, j] + scaled[k, row, j] * moved, low), high)
        total = 0.0
        for j in range(BLOCK):
            total += columns[j]
        means[k] = total / (weight.shape[1] * BLOCK)
