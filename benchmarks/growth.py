"""Cost as the network, the arena and the time without reward grow."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from benchmarks.rollouts import whole
from benchmarks.table import Sheet, against
from benchmarks.timing import Contender, Watch, median_cpu_s
from benchmarks.workload import CHUNK_MS, CHUNKS_A_SECOND, Workload, rewarded, run_chunks
from scla_mj.brain.network.network import Network
from scla_mj.config import RunConfig

NEURONS: Final = (1000, 2000, 5000, 10_000, 20_000, 50_000, 100_000)
ARENAS: Final = (5, 10, 20, 50)
_TEN_TIMES_TARGET: Final = 12.0
_NEURON_SECONDS: Final = 10_000
"""Neurons times seconds of network time per turn of a small network, one second of which would take only 3 ms."""
_GRID_TARGET: Final = 1.10
_UNREWARDED_TARGET: Final = 1.10
HOUR_S: Final = 3600


class Point(NamedTuple):
    """One size and its cost, a median."""

    size: int
    cost: float


def neurons(
    config: RunConfig, *, repetitions: int, watch: Watch, sizes: Sequence[int] = NEURONS
) -> tuple[Sheet, list[Point]]:
    """Time larger networks with as many synapses per neuron, 50 ms at a time."""
    works = {size: _rewarded(config, seconds=max(1, _NEURON_SECONDS // size), neurons=size) for size in sizes}
    contenders = {str(size): _network_contender(config, size, work) for size, work in works.items()}
    seconds = median_cpu_s(contenders, repetitions=repetitions, watch=watch)
    points = [Point(size, 1e6 * seconds[str(size)] / (len(works[size].drives) * CHUNK_MS)) for size in sizes]
    return neurons_sheet(points), points


def neurons_sheet(points: Sequence[Point]) -> Sheet:
    """Return the table; the target is on every step of ten times as many neurons."""
    rows, values, costs = [], {}, dict(points)
    for size, cost in points:
        tenth = costs.get(size // 10)
        ratio = "" if tenth is None else f"{cost / tenth:.1f}"
        target = "" if tenth is None else against(cost / tenth, _TEN_TIMES_TARGET)
        rows.append((f"{size:,}", f"{80 * size:,}", f"{cost:.2f}", f"{1000 * cost / size:.2f}", ratio, target))
        values[f"{size} neurons, µs per simulated ms"] = cost
    return Sheet(
        "neurons",
        "CPU time per simulated ms by neurons",
        ("neurons", "plastic synapses", "µs per simulated ms", "ns per neuron", "over a tenth of them", "target"),
        tuple(rows),
        "80 plastic synapses per neuron; a tenth of the neurons is driven, dopamine once per second, "
        "input every 50 ms.",
        values,
    )


def arenas(
    config: RunConfig, *, repetitions: int, watch: Watch, edges: Sequence[int] = ARENAS
) -> tuple[Sheet, list[Point]]:
    """Time a decision in larger arenas, telemetry light, without the run's fixed cost."""
    contenders = {}
    for edge in edges:
        middle = (edge + 1) // 2
        grid = dataclasses.replace(config.grid, cells=(edge, edge), target=(middle, middle), closed_cells=())
        large = dataclasses.replace(config, grid=grid)
        contenders[str(edge)] = whole(large, "light", "", {})
        contenders[f"one {edge}"] = whole(dataclasses.replace(large, epochs=1, decisions=1), "light", "", {})
    seconds = median_cpu_s(contenders, repetitions=repetitions, watch=watch)
    more = max(config.epochs * config.decisions - 1, 1)
    points = [Point(edge, 1000.0 * (seconds[str(edge)] - seconds[f"one {edge}"]) / more) for edge in edges]
    return arenas_sheet(points), points


def arenas_sheet(points: Sequence[Point]) -> Sheet:
    """Return the table; the others are compared with the first arena."""
    rows, values = [], {}
    for edge, cost in points:
        ratio = cost / points[0].cost
        target = against(ratio, _GRID_TARGET) if edge == points[-1].size else ""
        rows.append((f"{edge} x {edge}", f"{cost:.3f}", f"{ratio:.2f}", target))
        values[f"{edge} x {edge}, ms per decision"] = cost
    return Sheet(
        "arenas",
        "CPU time per decision by the arena's size",
        ("cells", "ms per decision", "over the first", "target"),
        tuple(rows),
        "Telemetry light. Decisions differ between arenas: walls are met less often in a larger one.",
        values,
    )


def unrewarded(config: RunConfig, *, watch: Watch, seconds: int = HOUR_S) -> Sheet:
    """Time an hour of network time without reward against a rewarded one, a minute of each in turn."""
    minutes = max(seconds // 60, 1)
    work = _rewarded(config, seconds=min(seconds, 60))
    silent = work._replace(releases=np.zeros_like(work.releases))
    kinds = {"rewarded": work, "unrewarded": silent}
    networks = {name: Network(config.network, config.plasticity, seed=config.seed) for name in kinds}
    contenders = {name: _going_on(networks[name], kind) for name, kind in kinds.items()}
    cpu_s = median_cpu_s(contenders, repetitions=minutes, watch=watch)
    rewarded_us, unrewarded_us = (1e6 * cpu_s[name] / (len(work.drives) * CHUNK_MS) for name in kinds)
    ratio = unrewarded_us / rewarded_us
    return Sheet(
        "unrewarded",
        f"CPU time per simulated ms over {minutes} minutes of network time, medians over minutes",
        ("what", "µs per simulated ms", "target"),
        (
            ("rewarded once per second", f"{rewarded_us:.2f}", ""),
            ("never rewarded", f"{unrewarded_us:.2f}", ""),
            ("unrewarded over rewarded", f"{ratio:.2f}", against(ratio, _UNREWARDED_TARGET)),
        ),
        "Subnormal numbers would slow the kernel many times over.",
        {"rewarded_us": rewarded_us, "unrewarded_us": unrewarded_us, "ratio": ratio},
    )


def _rewarded(config: RunConfig, *, seconds: int, neurons: int = NEURONS[0]) -> Workload:
    return rewarded(
        seconds * CHUNKS_A_SECOND,
        drive=config.network.sensory_drive,
        release=config.plasticity.dopamine_release,
        rng=np.random.Generator(np.random.PCG64(config.seed)),
        neurons=neurons,
    )


def _network_contender(config: RunConfig, size: int, work: Workload) -> Contender:
    network = Network(config.network, config.plasticity, seed=config.seed, neurons=size)
    run_chunks(network, work)
    return _going_on(network, work)


def _going_on(network: Network, work: Workload) -> Contender:
    return Contender(lambda: network, lambda ready: run_chunks(ready, work))
