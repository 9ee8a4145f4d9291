"""One clock: whole multiples give whole counts, everything else is refused."""

import dataclasses

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scla_mj.checked import check
from scla_mj.clock import resolve_clock
from scla_mj.config import ClockConfig, RunConfig
from scla_mj.errors import SclaError


def test_the_default_window_is_fifty_neural_steps_in_five_control_periods():
    clock = resolve_clock(ClockConfig())
    assert (clock.thinking_steps, clock.thinking_controls) == (50, 5)
    assert clock.thinking_window_s == pytest.approx(0.050)


counts = st.integers(1, 50)


@given(st.sampled_from([0.1, 0.125, 0.2, 0.25, 0.5, 1.0]), counts, counts, counts, counts)
def test_whole_multiples_give_exactly_their_counts(base_ms, neural, physics, control, thinking):
    """Neural time, physics time and the window are the same time, counted in three ways."""
    neural_ms, physics_ms = neural * base_ms, physics * base_ms
    control_ms = neural * physics * control * base_ms
    clock = resolve_clock(ClockConfig(base_ms, neural_ms, physics_ms, control_ms, thinking * control_ms))
    assert clock.neural_steps_per_control == physics * control
    assert clock.physics_steps_per_control == neural * control
    assert clock.thinking_steps == thinking * physics * control
    assert clock.neural_steps_per_control * clock.neural_step_ms / 1000 == pytest.approx(clock.control_period_s)
    assert clock.physics_steps_per_control * clock.physics_step_s == pytest.approx(clock.control_period_s)


@given(
    st.sampled_from(["neural_step_ms", "physics_step_ms", "control_period_ms", "thinking_window_ms"]),
    st.integers(0, 200),
    st.floats(0.001, 0.999),
)
def test_a_period_between_two_base_steps_is_refused_and_a_possible_one_named(name, whole, rest):
    config = dataclasses.replace(ClockConfig(), **{name: whole + rest})
    with pytest.raises(SclaError, match=r"is not an integer multiple of --clock\.\S+ \S+: choose \S+, or another"):
        resolve_clock(config)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"base_step_ms": 0.0}, "--clock.base-step-ms is 0.0: it must be 1e-06 to 1"),
        ({"base_step_ms": -1.0}, "must be 1e-06 to 1"),
        ({"base_step_ms": float("nan")}, "must be a finite number"),
        ({"neural_step_ms": 0.0}, "--clock.neural-step-ms"),
        ({"physics_step_ms": -10.0}, "--clock.physics-step-ms"),
        ({"physics_step_ms": float("nan")}, "--clock.physics-step-ms"),
        ({"thinking_window_ms": float("inf")}, "--clock.thinking-window-ms"),
        (
            {"physics_step_ms": 4.0},
            "control-period-ms 10 is not an integer multiple of --clock.physics-step-ms 4: choose 8",
        ),
        (
            {"base_step_ms": 0.1, "neural_step_ms": 0.3},
            r"control-period-ms 10 is not an integer multiple of --clock.neural-step-ms 0\.3",
        ),
        (
            {"thinking_window_ms": 55.0},
            "thinking-window-ms 55 is not an integer multiple of --clock.control-period-ms 10",
        ),
    ],
)
def test_periods_that_do_not_divide_are_refused_in_one_sentence(changes, said):
    with pytest.raises(SclaError, match=said) as caught:
        check(RunConfig(clock=dataclasses.replace(ClockConfig(), **changes)))
    assert "\n" not in str(caught.value)
