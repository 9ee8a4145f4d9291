"""The synapses of a described network, drawn from its seed, and the lists by which their neurons find them."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.brain.network.description import Blocks, NetworkDescription, Normal, Synapses, Uniform
from scla_mj.errors import SclaError

_MOST_SYNAPSES: Final = 2**31 - 1


class Wiring(NamedTuple):
    """Synapses of all projections; `tables`, (K, 4): a projection's first row, column and synapse, and its last."""

    synapses: NDArray[np.void]
    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    onto: NDArray[np.void]
    tables: NDArray[np.int64]


def wire(description: NetworkDescription, real: np.dtype[Any], rng: np.random.Generator) -> Wiring:
    """Draw every synapse, projection by projection."""
    places = {population.name: population for population in description.ranges}
    synapse = np.dtype([("weight", real), ("scaled", real), ("at", np.uint32), ("target", np.uint32)], align=True)
    onto = np.dtype([("synapse", np.uint32), ("source", np.uint32)])
    parts, rows, columns, entries, tables = [], [np.zeros(1, int)], [np.zeros(1, int)], [], []
    total = rows_so_far = columns_so_far = plastic = 0
    for projection in description.projections:
        tables.append((rows_so_far, columns_so_far, total, total))
        if projection.is_uniform:
            continue
        source, target = _pairs(projection, places[projection.source].size, places[projection.target].size, rng)
        part = np.zeros(len(source), synapse)
        part["weight"] = _weights(projection, len(source), rng)
        part["target"] = places[projection.target].start + target
        parts.append(part)
        rows.append(total + np.cumsum(np.bincount(source, minlength=places[projection.source].size)))
        rows_so_far += places[projection.source].size
        tables[-1] = (*tables[-1][:3], total + len(source))
        if projection.rule is not None:
            order = np.argsort(target, kind="stable")
            entry = np.zeros(len(source), onto)
            entry["synapse"], entry["source"] = total + order, places[projection.source].start + source[order]
            entries.append(entry)
            columns.append(plastic + np.cumsum(np.bincount(target, minlength=places[projection.target].size)))
            columns_so_far += places[projection.target].size
            plastic += len(source)
        total += len(source)
        if total > _MOST_SYNAPSES:
            raise SclaError(
                f"projection {projection.name}: {total} synapses so far: a network has {_MOST_SYNAPSES} at most"
            )
    return Wiring(
        np.concatenate([np.zeros(0, synapse), *parts]),
        np.concatenate(rows),
        np.concatenate(columns),
        np.concatenate([np.zeros(0, onto), *entries]),
        np.array(tables, int).reshape(-1, 4),
    )


def _pairs(projection: Synapses, sources: int, targets: int, rng: np.random.Generator) -> tuple[Any, Any]:
    """Return the source and the target of each synapse, by source."""
    connect = projection.connect
    if connect == "one to one":
        source = target = np.arange(sources)
    elif connect == "all to all":
        source, target = np.repeat(np.arange(sources), targets), np.tile(np.arange(targets), sources)
    elif isinstance(connect, Blocks):
        size = targets // connect.number
        source = np.repeat(np.arange(sources), size)
        target = source // (sources // connect.number) * size + np.tile(np.arange(size), sources)
    else:
        found = [np.flatnonzero(rng.random(targets) < connect) for _ in range(sources)]
        source, target = np.repeat(np.arange(sources), [len(row) for row in found]), np.concatenate(found)
    if not projection.self_connections and projection.source == projection.target:
        kept = source != target
        source, target = source[kept], target[kept]
    return source, target


def _weights(projection: Synapses, count: int, rng: np.random.Generator) -> Any:
    weight, rule = projection.weight, projection.rule
    if isinstance(weight, Uniform):
        drawn = rng.uniform(weight.low, weight.high, count)
    elif isinstance(weight, Normal):
        drawn = rng.normal(weight.mean, weight.deviation, count)
    else:
        drawn = np.full(count, float(weight))
    return drawn if rule is None else np.clip(drawn, rule.low, rule.high)
