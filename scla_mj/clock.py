"""One clock for neurons, wheels and control: every period is a whole number of base steps."""

from __future__ import annotations

from dataclasses import dataclass

from scla_mj.config import ClockConfig
from scla_mj.errors import SclaError

_TOLERANCE = 1e-9
_BASE, _NEURAL, _PHYSICS, _CONTROL, _THINKING = (
    f"--clock.{period}-ms"
    for period in ("base-step", "neural-step", "physics-step", "control-period", "thinking-window")
)


@dataclass(frozen=True)
class Clock:
    """The periods of a run, each known to divide the next: base <= neural, physics <= control and thinking window."""

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
    """Check that every period, each in its range, is an integer multiple of what it is made of; return the counts.

    Raises:
        SclaError: a period is not an integer multiple of the base step, or the control period is not
            one of the neural and physics steps, or the thinking window is not one of the control period.
    """
    base, control = config.base_step_ms, config.control_period_ms
    for option, period_ms in (
        (_NEURAL, config.neural_step_ms),
        (_PHYSICS, config.physics_step_ms),
        (_CONTROL, control),
        (_THINKING, config.thinking_window_ms),
    ):
        _multiple(option, period_ms, _BASE, base)
    return Clock(
        neural_step_ms=config.neural_step_ms,
        physics_step_s=config.physics_step_ms / 1000,
        control_period_s=control / 1000,
        neural_steps_per_control=_multiple(_CONTROL, control, _NEURAL, config.neural_step_ms),
        physics_steps_per_control=_multiple(_CONTROL, control, _PHYSICS, config.physics_step_ms),
        thinking_controls=_multiple(_THINKING, config.thinking_window_ms, _CONTROL, control),
    )


def _multiple(option: str, period_ms: float, of_option: str, of_ms: float) -> int:
    ratio = period_ms / of_ms
    count = round(ratio)
    if count < 1 or abs(ratio - count) > _TOLERANCE * max(count, 1):
        raise SclaError(
            f"{option} {period_ms:g} is not an integer multiple of {of_option} {of_ms:g}: "
            f"choose {max(count, 1) * of_ms:g}, or another {of_option}"
        )
    return count
