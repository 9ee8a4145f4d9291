"""What a setting may be: every option's range, and the sentence that refuses what lies outside."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any, Final

from scla_mj.errors import SclaError

if TYPE_CHECKING:
    from scla_mj.config import RunConfig

_TINY: Final = 1e-6
RANGES: Final[dict[str, tuple[float, float]]] = {
    "epochs": (1, math.inf),
    "decisions": (1, math.inf),
    "seed": (0, math.inf),
    "cell-size-m": (0.27, 3.0),  # turning in place sweeps a circle of 0.133 m about the axle
    "task.action-noise": (0.0, 0.75),  # at 3/4 a decision says nothing about the direction any more
    "task.jump-epoch": (0, math.inf),
    "clock.base-step-ms": (_TINY, 100.0),
    "clock.neural-step-ms": (0.05, 1.0),  # shorter steps are no more exact in float32, and a second takes minutes
    "clock.physics-step-ms": (0.1, 20.0),  # at 0.1 the slowest move that is allowed, 600 s, still ends in a minute
    "clock.control-period-ms": (1.0, 100.0),  # the longest move, a row a period, still fits into 60 MB
    "clock.thinking-window-ms": (_TINY, 10_000.0),
    "network.weight-low": (0.0, math.inf),
    "network.weight-max": (0.0, 100.0),
    "network.sensory-drive": (-100.0, 100.0),  # 15 already drives a neuron to 30 Hz
    "network.advice-drive": (-100.0, 100.0),
    "network.sensory-noise": (0.0, 100.0),
    "network.motor-noise": (0.0, 100.0),
    "network.inhibitory-noise": (0.0, 100.0),
    "network.motor-to-inhibitory": (-100.0, 100.0),
    "network.inhibitory-to-motor": (-100.0, 100.0),
    "plasticity.stdp-potentiation": (-10.0, 10.0),
    "plasticity.stdp-depression": (-10.0, 10.0),
    "plasticity.stdp-tau-ms": (_TINY, math.inf),
    "plasticity.eligibility-tau-ms": (1.0, math.inf),  # the longest neural step: a shorter trace bridges nothing
    "plasticity.dopamine-tau-ms": (_TINY, math.inf),
    "plasticity.dopamine-release": (-10.0, 10.0),
    "plasticity.dopamine-delay-s": (0.0, 60.0),
    "plasticity.learning-rate-per-ms": (0.0, 10.0),
    "automaton.reward-rate": (0.0, 1.0),
    "automaton.penalty-rate": (0.0, 1.0),
    "automaton.epsilon": (0.0, 1.0),
    "automaton.discount": (0.0, 1.0),
    "automaton.trace-tau-moves": (_TINY, math.inf),
    "q-learning.learning-rate": (0.0, 1.0),
    "q-learning.discount": (0.0, 1.0),
    "q-learning.epsilon": (0.0, 1.0),
    "q-learning.initial-value": (-1000.0, 1000.0),
    "controller.max-speed-m-s": (0.01, 0.8),
    "controller.forward-acceleration-m-s2": (0.01, 2.5),
    "controller.backward-acceleration-m-s2": (0.01, 3.0),
    "controller.max-turn-rate-rad-s": (0.1, 8.0),
    "controller.max-turn-acceleration-rad-s2": (0.1, 50.0),
    "controller.position-tolerance-m": (_TINY, 0.05),
    "controller.heading-tolerance-rad": (_TINY, 0.2),
    "controller.reaim-fraction": (0.005, 0.5),
    "controller.reaim-limit": (0, 100),
    "controller.timeout-s": (0.1, 600.0),
    "disturbance.friction-scale": (0.05, 5.0),
    "disturbance.mass-scale": (0.2, 5.0),
    "disturbance.wheel-mismatch": (0.0, 0.2),
    "disturbance.command-noise": (0.0, 2.0),
    "disturbance.push-n-per-kg": (0.0, 100.0),  # ten times its weight
    "disturbance.latency-periods": (0, 100),
    "disturbance.tilt-deg": (0.0, 20.0),  # beyond, a robot at rest is close to what counts as fallen
}


def check_limits(config: RunConfig) -> None:
    """Refuse a setting that is not finite or out of its range.

    Raises:
        SclaError: the sentence names the option, the value and the range.
    """
    values = flatten(config)
    for option, value in values.items():
        if any(isinstance(part, float) and not math.isfinite(part) for part in _parts(value)):
            raise SclaError(f"--{option} is {_shown(value)}: it must be a finite number")
    for option, (low, high) in RANGES.items():
        value = values[option]
        if not all(low <= part <= high for part in _parts(value)):
            bound = f"{low:g} or more" if high == math.inf else f"{low:g} to {high:g}"
            raise SclaError(f"--{option} is {_shown(value)}: it must be {bound}")
        if list(_parts(value)) != sorted(_parts(value)):
            raise SclaError(f"--{option} is {_shown(value)}: a range wants its lower end first")
    if config.network.weight_low > config.network.weight_high:
        raise SclaError("--network.weight-low is above --network.weight-high: swap them")
    if config.network.weight_high > config.network.weight_max:
        raise SclaError("--network.weight-high is above --network.weight-max: initial weights must lie within the clip")


def _parts(value: Any) -> tuple[Any, ...]:
    """Return a range's two ends, or the one value there is."""
    return value if isinstance(value, tuple) else (value,)


def _shown(value: Any) -> str:
    return " ".join(map(str, _parts(value)))


def flatten(config: RunConfig) -> dict[str, Any]:
    """Return every setting by its option's name, as the command line spells it."""
    flat: dict[str, Any] = {}
    for section in dataclasses.fields(config):
        value = getattr(config, section.name)
        if not dataclasses.is_dataclass(value):
            flat[section.name] = value
            continue
        prefix = "" if section.name == "grid" else f"{section.name}."
        for item in dataclasses.fields(value):
            flat[(prefix + item.name).replace("_", "-")] = getattr(value, item.name)
    return flat
