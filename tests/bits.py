"""The digests of some short runs: `python tests/bits.py` writes them to bits.json, `--print` only shows them."""

from __future__ import annotations

import argparse
import dataclasses
import hashlib
import json
import math
import platform
import tempfile
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from scla_mj.anatomy import POPULATION_NAMES
from scla_mj.config import NetworkConfig, RunConfig, TaskConfig
from scla_mj.engine.rollout import rollout
from scla_mj.runs.brain import read_brain
from scla_mj.runs.decisions import read_decisions, schema
from scla_mj.runs.folder import PACKAGES
from scla_mj.signals import Snapshot

FILE = Path(__file__).with_name("bits.json")
_DOUBLE = NetworkConfig(precision="float64")
_ASTRAY = TaskConfig(action_noise=0.1)
RUNS: dict[str, RunConfig] = {
    "scla-dopamine any-start float32": RunConfig(brain="scla-dopamine"),
    "scla-dopamine any-start float64": RunConfig(brain="scla-dopamine", network=_DOUBLE),
    "scla-dopamine sensed-start, moves astray": RunConfig(brain="scla-dopamine", protocol="sensed-start", task=_ASTRAY),
    "scla-dopamine crossed wheels": RunConfig(brain="scla-dopamine", task=TaskConfig(crossed_epoch=1)),
    "scla-printed any-start float32": RunConfig(brain="scla-printed"),
    "scla-printed any-start float64": RunConfig(brain="scla-printed", network=_DOUBLE),
    "scla-printed sensed-start, moves astray": RunConfig(brain="scla-printed", protocol="sensed-start", task=_ASTRAY),
    "network float32": RunConfig(brain="network", seed=1),
    "network float64": RunConfig(brain="network", seed=1, network=_DOUBLE),
} | {
    brain: RunConfig(brain=brain)
    for brain in (
        "actor-critic", "automata-everywhere", "automaton", "cell-states", "dyna-q", "q-lambda", "q-learning", "random",
        "shortest-path",
    )
}  # fmt: skip
SHORT: dict[str, Any] = {"epochs": 1, "decisions": 200, "telemetry": "off"}


def where() -> str:
    """Return what the bits are promised for: the operating system and the kind of processor."""
    return f"{platform.system()} {platform.machine()}"


def versions() -> dict[str, str]:
    """Return the versions of the packages that compute; the lock names them."""
    return {name: metadata.version(name) for name in (*PACKAGES, "llvmlite")}


def libm() -> str:
    """Return a digest of the C library's functions: others, or a processor without FMA, have other last bits."""
    angles = [0.001 * number for number in range(-6000, 6000)]
    values = [(math.sin(x), math.cos(x), math.atan2(x, 1.7), math.exp(-abs(x)), math.hypot(x, 0.3)) for x in angles]
    return _digest(np.array(values).tobytes())


def digests() -> dict[str, dict[str, str]]:
    """Run every one of RUNS and return its three digests."""
    found = {}
    for name, config in RUNS.items():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "run"
            rollout(dataclasses.replace(config, **SHORT), path, pictures=False)
            found[name] = digests_of(read_decisions(path), read_brain(path))
    return found


def digests_of(table: pa.Table, memory: Snapshot) -> dict[str, str]:
    """Return digests of what was decided, of the measured numbers (times, errors), and of the memory."""
    measured = {name for name in table.column_names if pa.types.is_floating(table.schema.field(name).type)}
    decided = [column for column in schema(POPULATION_NAMES[4:8]).names if column not in measured]
    for motor in set(decided) - set(table.column_names):  # a brain without neurons has none
        table = table.append_column(motor, pa.nulls(len(table), pa.int32()))
    weights = np.zeros(0) if memory.weights is None else memory.weights
    probabilities = np.zeros(0) if memory.probabilities is None else memory.probabilities
    return {
        "decided": _digest(repr(table.select(decided).to_pydict()).encode()),
        "measured": _digest(*(table[name].to_numpy().tobytes() for name in sorted(measured))),
        "memory": _digest(str(weights.dtype).encode(), weights.tobytes(), probabilities.tobytes()),
    }


def _digest(*parts: bytes) -> str:
    return hashlib.sha256(b"".join(len(part).to_bytes(8, "little") + part for part in parts)).hexdigest()


def main() -> None:
    """Write the digests of this platform beside those of the others, or print them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--print", action="store_true", help="print the digests and write nothing")
    only_print = parser.parse_args().print
    entry = {"versions": versions(), "libm": libm(), "runs": digests()}
    if only_print:
        print(json.dumps(entry, indent=2))
        return
    known = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    FILE.write_text(json.dumps(known | {where(): entry}, indent=2, sort_keys=True) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
