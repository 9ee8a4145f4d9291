"""Settings that cannot be run are refused by name from Python too, in one sentence."""

import dataclasses
import math
import typing

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from scla_mj.checked import CheckedConfig, check
from scla_mj.config import (
    AutomatonConfig,
    ClockConfig,
    GridConfig,
    NetworkConfig,
    PlasticityConfig,
    RunConfig,
    TaskConfig,
    flatten,
    option_of,
)
from scla_mj.disturbances import DisturbanceConfig
from scla_mj.errors import SclaError
from scla_mj.validation import bounds, hint_at

PATHS = {
    option_of(*path): path
    for section, kind in typing.get_type_hints(RunConfig).items()
    for path in (
        [(section, item.name) for item in dataclasses.fields(kind)] if dataclasses.is_dataclass(kind) else [(section,)]
    )
    if not section.startswith("__")
}
"""Every setting's option and the names that lead to it."""
WRONG = [None, "no", "many", object(), [], {}, (), b"1", 1j, math.nan, math.inf, -math.inf, 10**400, "1", [[1]], print]
"""Values of every wrong kind; whether one is wrong hangs on the setting."""


def with_value(option: str, value: object) -> RunConfig:
    """Return the default configuration with one setting replaced."""
    *section, name = PATHS[option]
    config = RunConfig()
    if not section:
        return dataclasses.replace(config, **{name: value})
    inner = dataclasses.replace(getattr(config, section[0]), **{name: value})
    return dataclasses.replace(config, **{section[0]: inner})


def refusal(config: object) -> str:
    with pytest.raises(SclaError) as caught:
        check(config)
    assert "\n" not in str(caught.value) and 10 < len(str(caught.value)) < 400
    return str(caught.value)


def ranged() -> list[str]:
    return sorted(option for option, path in PATHS.items() if any(map(math.isfinite, bounds(hint_at(RunConfig, path)))))


def test_the_defaults_are_the_papers_arena_and_are_sound():
    checked = check(RunConfig())
    assert checked.config == RunConfig()
    assert (checked.grid().cells, checked.grid().target, checked.config.decisions) == ((5, 5), (3, 3), 1000)
    assert checked.ceiling_hits_per_1000() == 400.0


def test_every_setting_is_listed_by_the_name_of_its_option():
    assert PATHS.keys() == flatten(RunConfig()).keys()
    assert len(ranged()) > 35  # that the ranges are seen at all


FREE = ("brain", "robot", "robot-sha256", "floor", "floor-text")
"""Texts that are no words of a list."""


@pytest.mark.parametrize("option", ranged())
def test_a_value_just_outside_its_range_is_refused_by_the_options_name(option):
    low, high = bounds(hint_at(RunConfig, PATHS[option]))
    whole = isinstance(flatten(RunConfig())[option], int)
    outside = [low - 1, math.nextafter(low, -math.inf) if not whole else low - 1]
    outside += [high + 1 if whole else math.nextafter(high, math.inf)] if math.isfinite(high) else []
    for value in outside:
        assert refusal(with_value(option, value)).startswith(f"--{option} is ")


@pytest.mark.parametrize("option", sorted(PATHS))
def test_a_value_of_the_wrong_kind_is_refused_by_the_settings_name_and_no_other_is_run(option):
    for value in WRONG:
        try:
            checked = check(with_value(option, value))
        except SclaError as error:
            assert str(error).startswith(f"--{option}") and "\n" not in str(error) and len(str(error)) < 400, value
        else:  # what is taken means what it says
            taken = flatten(checked.config)[option]
            assert taken == value or (list(taken) == list(value) and isinstance(value, list | tuple)), (option, value)


@given(st.sampled_from(sorted(PATHS)), st.recursive(st.none() | st.booleans() | st.integers() | st.floats() | st.text()
       | st.binary(), lambda inner: st.lists(inner) | st.tuples(inner, inner) | st.dictionaries(st.text(), inner),
       max_leaves=4))  # fmt: skip
@example("brain_settings".replace("_", "-"), {"a\nb": b""})
@example("automaton.bump-penalty", {"\n" * 9: {}})
@settings(max_examples=300, deadline=None, derandomize=True)
def test_whatever_stands_in_a_setting_is_taken_as_it_is_or_refused_with_a_sentence(option, value):
    try:
        checked = check(with_value(option, value))
    except SclaError as error:
        assert "\n" not in str(error) and len(str(error)) < 400
        return
    assert repr(flatten(checked.config)[option]) in (repr(value), repr(float(value)) if type(value) is int else "",
                                                     repr(tuple(value)) if isinstance(value, list) else "")  # fmt: skip


@pytest.mark.parametrize("option", [o for o in PATHS if isinstance(flatten(RunConfig())[o], str) and o not in FREE])
def test_a_wrong_word_is_answered_with_the_right_ones(option):
    said = refusal(with_value(option, "sensed"))
    assert said.startswith(f"--{option} is 'sensed': it must be one of ")
    assert str(flatten(RunConfig())[option]) in said


@pytest.mark.parametrize(
    ("config", "said"),
    [
        (RunConfig(grid=5), "--grid is 5: it must be an object of settings"),
        (RunConfig(network=TaskConfig()), "--network.action-noise is not a setting: known are precision"),
        (RunConfig(grid=GridConfig(cells=(5,))), "--cells is 5: it must hold 2 values"),
        (RunConfig(grid=GridConfig(closed_cells=((1, 2), (3,)))), "--closed-cells is 3: it must hold 2 values"),
        (RunConfig(automaton=AutomatonConfig(local_rule="no")), "--automaton.local-rule is 'no': it must be true or"),
        (RunConfig(seed=True), "--seed is True: it must be a whole number"),
        (RunConfig(seed=2**63), "--seed is 9223372036854775808: it must be 0 to 9223372036854775807"),
        ({"seed": 3}, "the configuration is {'seed': 3}: it must be a RunConfig"),
        (RunConfig(disturbance=DisturbanceConfig(friction_scale=(1.5, 0.3))), "wants its lower end first"),
    ],
)
def test_a_refusal_names_the_setting_the_value_and_what_would_be_right(config, said):
    assert said in refusal(config)


def test_numpys_numbers_and_lists_are_taken_for_what_they_are():
    grid = GridConfig(cells=[7, 7], closed_cells=np.array([[1, 2]]))
    given_ = RunConfig(seed=np.int64(3), grid=grid, automaton=AutomatonConfig(reward_rate=np.float64(0.25)))
    taken = check(given_).config
    assert (taken.seed, taken.grid.cells, taken.grid.closed_cells) == (3, (7, 7), ((1, 2),))
    assert type(taken.seed) is int and type(taken.automaton.reward_rate) is float


@given(st.integers(1, 12), st.integers(1, 12), st.integers(-2, 14), st.integers(-2, 14))
def test_a_target_is_taken_exactly_when_it_lies_on_a_grid_with_room(width, height, x, y):
    config = RunConfig(grid=GridConfig((width, height), (x, y)))
    if 1 <= x <= width and 1 <= y <= height and width * height > 1:
        assert check(config).grid().target == (x, y)
    else:
        refusal(config)


def test_initial_weights_must_be_ordered_and_lie_within_the_clip():
    for changes in ({"weight_low": 1.3}, {"weight_max": 1.1}):
        assert "weight" in refusal(RunConfig(network=NetworkConfig(**changes)))


@pytest.mark.parametrize(
    ("changes", "wanted"),
    [
        ({"task": TaskConfig(jump_target=(2, 2))}, "--task.jump-epoch"),
        ({"automaton": AutomatonConfig(epsilon=0.2)}, "--automaton.scheme reward-epsilon-penalty"),
        ({"automaton": AutomatonConfig(scheme="reward-inaction", penalty_rate=0.1)}, "another scheme"),
        ({"automaton": AutomatonConfig(local_rule=False, discount=0.5)}, "--automaton.local-rule"),
        ({"automaton": AutomatonConfig(distal_reward=False, trace_tau_moves=2.0)}, "--automaton.distal-reward"),
    ],
)
def test_a_setting_that_nothing_would_read_is_refused(changes, wanted):
    assert f"which nothing reads: leave it out or choose {wanted}" in refusal(RunConfig(**changes))


def test_grid_and_ceiling_follow_the_target_over_the_epochs():
    checked = check(RunConfig(epochs=3, task=TaskConfig(jump_epoch=2, jump_target=(1, 1))))
    assert [tuple(checked.grid(epoch).target) for epoch in (1, 2, 3)] == [(3, 3), (1, 1), (1, 1)]
    assert [checked.ceiling_hits_per_1000(epoch) for epoch in (1, 2, 3)] == pytest.approx([400.0, 240.0, 240.0])
    assert checked.grid(3) is checked.grid(2) is not checked.grid()
    assert "--task.jump-epoch is 4: the run ends after epoch 3" in refusal(
        RunConfig(epochs=3, task=TaskConfig(jump_epoch=4))
    )


def test_the_wheels_are_crossed_from_their_epoch_on_and_the_arena_stays_as_it_is():
    checked = check(RunConfig(epochs=3, task=TaskConfig(crossed_epoch=2)))
    assert [checked.has_crossed(epoch) for epoch in (1, 2, 3)] == [False, True, True]
    assert checked.grid(3) is checked.grid() and checked.ceiling_hits_per_1000(3) == pytest.approx(400.0)
    assert not check(RunConfig()).has_crossed(1)
    assert "--task.crossed-epoch is 4: the run ends after epoch 3" in refusal(
        RunConfig(epochs=3, task=TaskConfig(crossed_epoch=4))
    )


def test_a_checked_configuration_is_checked_once_and_its_clock_is_that_of_its_settings():
    checked = check(RunConfig(clock=ClockConfig(thinking_window_ms=100.0), plasticity=PlasticityConfig()))
    assert check(checked) is checked and isinstance(checked, CheckedConfig)
    assert checked.clock.thinking_controls == 10
