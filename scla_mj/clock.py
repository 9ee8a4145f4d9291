"""One clock for neurons, wheels and control: every period is a whole number of base steps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from scla_mj.errors import SclaError

if TYPE_CHECKING:
    from scla_mj.config import ClockConfig

_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Clock:
    """The periods of a run, each known to divide the next: base <= neural, physics <= control and thinking window."""

    base_step_s: float
    neural_step_ms: float
    physics_step_s: float
    control_period_s: float
    neural_steps_per_control: int
    physics_steps_per_control: int
    thinking_controls: int

    @property
    def thinking_steps(self) -> int:
        """Neural steps in one thinking window."""
        return self.thinking_controls * self.neural_steps_per_control

    @property
    def thinking_window_s(self) -> float:
        """Length of the thinking window."""
        return self.thinking_controls * self.control_period_s


def resolve_clock(config: ClockConfig) -> Clock:
    """Check that every period is an integer multiple of what it is made of, and return the counts.

    Raises:
        SclaError: a period is not positive, or not an integer multiple of the base step, or the control period is not
            one of the neural and physics steps, or the thinking window is not one of the control period.
    """
    base = config.base_step_ms
    if not 0 < base < math.inf:
        raise SclaError(f"the base step is {base} ms: it must be above 0 and finite")
    for name, period_ms in (
        ("neural step", config.neural_step_ms),
        ("physics step", config.physics_step_ms),
        ("control period", config.control_period_ms),
        ("thinking window", config.thinking_window_ms),
    ):
        _multiple(name, period_ms, "base step", base)
    control = config.control_period_ms
    return Clock(
        base_step_s=base / 1000,
        neural_step_ms=config.neural_step_ms,
        physics_step_s=config.physics_step_ms / 1000,
        control_period_s=control / 1000,
        neural_steps_per_control=_multiple("control period", control, "neural step", config.neural_step_ms),
        physics_steps_per_control=_multiple("control period", control, "physics step", config.physics_step_ms),
        thinking_controls=_multiple("thinking window", config.thinking_window_ms, "control period", control),
    )


def _multiple(name: str, period_ms: float, of_name: str, of_ms: float) -> int:
    ratio = period_ms / of_ms
    if not 0 < ratio < math.inf:
        raise SclaError(f"the {name} is {period_ms} ms: it must be above 0 and finite")
    count = round(ratio)
    if count < 1 or abs(ratio - count) > _TOLERANCE * max(count, 1):
        raise SclaError(
            f"the {name} of {period_ms:g} ms is not an integer multiple of the {of_name} of {of_ms:g} ms: "
            f"choose {max(count, 1) * of_ms:g} ms"
        )
    return count
