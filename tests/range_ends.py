"""Runs both ends of every range: `python tests/range_ends.py 3600 [--log FILE] [--dense 10] [--moves 100]`.

Each case runs a network for so many seconds of its own time in float32 and in float64, or, where the network does not
read the setting, the robot for so many decisions. It is driven as in decisions, and dopamine comes every second.
All that it holds must stay finite. Where many settings are at their ends together, it runs as many steps as there are
milliseconds in these seconds, however short its steps are. Cases that a log holds already are not run again.
"""

from __future__ import annotations

import argparse
import collections
import dataclasses
import json
import sys
import time
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from scla_mj.anatomy import PROJECTIONS
from scla_mj.brain.network.dense import DenseNetwork
from scla_mj.brain.network.network import Network
from scla_mj.brain.registry import BRAINS
from scla_mj.checked import check
from scla_mj.config import ClockConfig, NetworkConfig, PlasticityConfig, RunConfig
from scla_mj.engine.build import simulate
from scla_mj.errors import SclaError
from scla_mj.validation import bounds

STEP = "neural_step_ms"
SECTIONS = {"network": NetworkConfig, "plasticity": PlasticityConfig}
DECISION_S, DRIVEN_S = 1.0, 0.05
DESCRIBED = {"neurons", "stdp_tau_minus_ms"}
"""Numbers of a network that is described, or larger (tests/brain/test_scla_settings.py)."""
CORNERS = 12
"""Random corners of the whole box of settings."""


class Case(NamedTuple):
    """One configuration: `values` by section and name; `kind` is lazy, dense or moves."""

    name: str
    kind: str
    precision: str
    values: dict[str, dict[str, Any]]


def ends(kind: Any) -> dict[str, tuple[float, float]]:
    """Return the bounds of every number among a section's fields."""
    found = {}
    for name, hint in typing.get_type_hints(kind, include_extras=True).items():
        bare = typing.get_args(hint)[0] if typing.get_origin(hint) is typing.Annotated else hint
        if bare in (int, float) and name not in DESCRIBED:
            found[name] = bounds(hint)
    return found


def box() -> dict[tuple[str, str], tuple[float, float]]:
    """Return the ends of everything that the network reads."""
    found = {(section, name): at for section, kind in SECTIONS.items() for name, at in ends(kind).items()}
    return found | {("clock", STEP): ends(ClockConfig)[STEP]}


def fitted(values: dict[tuple[str, str], float]) -> dict[str, dict[str, Any]]:
    """Return the values by section, with what they need of each other: weights in order, no time below a step."""
    nested: dict[str, dict[str, Any]] = {"network": {}, "plasticity": {}, "clock": {}}
    for (section, name), value in values.items():
        nested[section][name] = value
    weights = {name: values.get(("network", name)) for name in ("weight_low", "weight_high", "weight_max")}
    low, high, most = (weights[name] for name in ("weight_low", "weight_high", "weight_max"))
    if any(value is not None for value in weights.values()):
        most = max(4.0, low or 0.0, high or 0.0) if most is None else most
        high = min(most, max(1.2, low or 0.0)) if high is None else min(high, most)
        low = min(0.8, high) if low is None else min(low, high)
        nested["network"] |= {"weight_low": low, "weight_high": high, "weight_max": most}
    times = [value for name, value in nested["plasticity"].items() if name.endswith("tau_ms")]
    nested["clock"][STEP] = min([nested["clock"].get(STEP, 1.0), *times])
    return nested


def network_cases() -> Iterator[tuple[str, dict[str, dict[str, Any]]]]:
    """Yield a name and its values: each end alone, all low, all high, random corners."""
    sides = box()
    for (section, name), at in sides.items():
        for end, value in zip(("low", "high"), at, strict=True):
            yield f"{section}.{name} {end}", fitted({(section, name): value})
    for end in (0, 1):
        corner = {key: at[end] for key, at in sides.items() if key != ("clock", STEP)}
        yield f"all {('low', 'high')[end]}", fitted(corner)
    for number in range(CORNERS):
        rng = np.random.default_rng(number)
        corner = {key: at[int(rng.integers(2))] for key, at in sides.items() if key != ("clock", STEP)}
        yield f"corner {number}", fitted(corner)


def moves_cases() -> Iterator[tuple[str, dict[str, dict[str, Any]]]]:
    """Yield the ends of what only the automata or the body read."""
    kinds = {field.name: typing.get_type_hints(RunConfig)[field.name] for field in dataclasses.fields(RunConfig)}
    every = {"automaton": {"": {"brain": "scla-printed"}}}  # which reads all of them
    for section in ("grid", "task", "clock", "automaton", "controller", "disturbance"):
        for name, at in ends(kinds[section]).items():
            if not name.endswith("_epoch") and name != STEP:  # a later epoch is refused for another reason
                for end, value in zip(("low", "high"), at, strict=True):
                    yield (
                        f"{section}.{name} {end}",
                        {section: {name: value} | NEEDED.get((name, end), {})} | every.get(section, {}),
                    )
    for name, at in {"friction_scale": (0.05, 5.0), "mass_scale": (0.2, 5.0)}.items():
        for end, value in zip(("low", "high"), at, strict=True):
            yield f"disturbance.{name} {end}", {"disturbance": {name: (value, value)}}
    for brain, kind in BRAINS.items():
        for name, at in ends(kind.Settings).items() if kind.Settings else ():
            for end, value in zip(("low", "high"), at, strict=True):
                yield f"{brain}.{name} {end}", {"": {"brain": brain, "brain_settings": {name: value}}}


NEEDED: dict[tuple[str, str], dict[str, Any]] = {
    ("thinking_window_ms", "low"): {"control_period_ms": 1.0, "physics_step_ms": 1.0},
    ("physics_step_ms", "low"): {"base_step_ms": 0.1},
    ("physics_step_ms", "high"): {"control_period_ms": 20.0, "thinking_window_ms": 60.0},
    ("control_period_ms", "low"): {"physics_step_ms": 1.0},
    ("control_period_ms", "high"): {"thinking_window_ms": 100.0},
    ("epsilon", "low"): {"scheme": "reward-epsilon-penalty"},
    ("epsilon", "high"): {"scheme": "reward-epsilon-penalty"},
}
"""Other settings without which an end is refused."""


def cases(dense: bool, moves: bool) -> Iterator[Case]:
    """Yield all cases, those of long steps first."""
    ordered = sorted(network_cases(), key=lambda case: -case[1]["clock"][STEP])
    for kind in ("lazy", "dense") if dense else ("lazy",):
        for name, values in ordered:
            for precision in ("float32", "float64"):
                yield Case(name, kind, precision, values)
    for name, values in moves_cases() if moves else ():
        yield Case(name, "moves", "", values)


def carried_out(case: Case, amount: float) -> str:
    """Return what came of a case: finite, refused, or what went wrong; and a figure or two."""
    try:
        return drive_robot(case, int(amount)) if case.kind == "moves" else run_network(case, amount)
    except SclaError as refusal:
        return f"refused: {refusal}"
    except Exception as error:  # what this looks for
        return f"BAD {type(error).__name__}: {error}"


def run_network(case: Case, seconds: float) -> str:
    config = NetworkConfig(precision=case.precision, **case.values["network"])  # type: ignore[arg-type]
    plasticity, step_ms = PlasticityConfig(**case.values["plasticity"]), case.values["clock"][STEP]
    network = (DenseNetwork if case.kind == "dense" else Network)(config, plasticity, neural_step_ms=step_ms, seed=1)
    rng, spikes = np.random.default_rng(0), 0
    delay = round(plasticity.dopamine_delay_s * 1000 / step_ms)
    driven, free = round(DRIVEN_S * 1000 / step_ms), round((DECISION_S - DRIVEN_S) * 1000 / step_ms)
    strongest = 0.0
    seconds = max(1, round(seconds * (1.0 if "." in case.name else step_ms)))
    for second in range(seconds):
        sensed, current = int(rng.integers(4)), np.zeros(1000)
        first, amount = (0, config.sensory_drive) if second % 2 else (400, config.advice_drive)
        current[first + 100 * sensed : first + 100 * (sensed + 1)] = amount
        network.advance(driven, current)
        spikes += int(network.advance(free, extend=True).sum())
        signs = [(1 if p.agrees else -1) * (p.sensor == sensed) if second % 3 else 1 for p in PROJECTIONS]
        network.release_dopamine(plasticity.dopamine_release * np.array(signs, float), delay_steps=delay)
        if second % 10 == 9 or second + 1 >= seconds:
            wrong = not_finite(network)
            if wrong:
                return f"BAD {', '.join(wrong)} after {second + 1} s"
            strongest = max(strongest, float(np.abs(network.eligibility).max()))
    return f"finite: {seconds} s, {spikes / seconds / 1000:.1f} spikes/s per neuron, eligibility to {strongest:.2g}"


def not_finite(network: Network) -> list[str]:
    """Return the names of what is not finite."""
    held = {**network.arrays._asdict(), "eligibility c": network.eligibility, "weights": network.weights}
    held |= {"dopamine now": network.dopamine, "means": network.mean_weights()}
    return [name for name, array in held.items() if array.dtype.kind == "f" and not np.isfinite(array).all()]


def drive_robot(case: Case, decisions: int) -> str:
    changed: dict[str, Any] = {}
    for section, values in case.values.items():
        changed |= {section: dataclasses.replace(getattr(RunConfig(), section), **values)} if section else values
    simulation = simulate(check(dataclasses.replace(RunConfig(seed=1), **changed)))
    outcomes: collections.Counter[str] = collections.Counter()
    for _ in range(decisions):
        move = simulation.step().move
        outcomes[move.outcome.value] += 1
        if not np.isfinite(move.trajectory).all() or not (move.fallen or np.isfinite(move.position_error_m)):
            return f"BAD {move}"
    automata = getattr(simulation.brain, "automata", None)
    if automata is not None and not np.allclose(automata.probabilities.sum(axis=2), 1.0):
        return "BAD probabilities do not sum to 1"
    return "finite: " + ", ".join(f"{count} {outcome}" for outcome, count in sorted(outcomes.items()))


def main() -> int:
    """Run the cases, print a line for each and the counts; return 1 if any was bad."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seconds", type=float)
    parser.add_argument("--log", type=Path)
    parser.add_argument("--dense", type=float, default=0.0, help="seconds of network time of the dense network")
    parser.add_argument("--moves", type=int, default=0, help="decisions with the real body")
    parser.add_argument("--only", default="", help="cases whose name holds this")
    options = parser.parse_args()
    done: dict[str, str] = {}
    if options.log and options.log.exists():
        done = {line["case"]: line["came"] for line in map(json.loads, options.log.read_text().splitlines())}
    counts: collections.Counter[str] = collections.Counter()
    for case in cases(bool(options.dense), bool(options.moves)):
        amount = {"lazy": options.seconds, "dense": options.dense, "moves": options.moves}[case.kind]
        name = f"{case.kind} {case.precision} {amount:g}: {case.name}"
        if options.only not in name:
            continue
        if name not in done:
            started = time.perf_counter()
            came = carried_out(case, amount)
            done[name] = f"{came} ({time.perf_counter() - started:.1f} s)"
            if options.log:
                with options.log.open("a") as log:
                    log.write(json.dumps({"case": name, "came": done[name]}) + "\n")
        counts[f"{case.kind} {done[name].split(':')[0].split()[0]}"] += 1
        print(f"{name}: {done[name]}", flush=True)
    print(f"{sum(counts.values())} cases: " + ", ".join(f"{number} {what}" for what, number in counts.items()))
    return int(any("BAD" in what for what in counts))


if __name__ == "__main__":
    sys.exit(main())
