"""Settings out of their range are refused by name; those within run."""

import dataclasses
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scla_mj import config as config_module
from scla_mj.config import RunConfig
from scla_mj.errors import SclaError
from scla_mj.limits import RANGES, flatten


def with_option(option: str, value: object) -> RunConfig:
    """Return the default configuration with one option, spelt as on the command line, set to a value."""
    *section, name = option.replace("-", "_").split(".")
    config = RunConfig()
    if not section and hasattr(config.grid, name):
        section = ["grid"]
    if not section:
        return dataclasses.replace(config, **{name: value})
    inner = dataclasses.replace(getattr(config, section[0]), **{name: value})
    return dataclasses.replace(config, **{section[0]: inner})


def test_the_defaults_are_the_papers_floor_and_are_sound():
    config = RunConfig()
    config.check()
    assert (config.grid.cells, config.grid.target, config.decisions) == ((5, 5), (3, 3), 1000)


def test_every_range_belongs_to_an_option_that_exists():
    assert RANGES.keys() <= flatten(RunConfig()).keys()


@pytest.mark.parametrize("option", sorted(RANGES))
def test_a_value_just_outside_its_range_is_refused_by_the_options_name(option):
    low, high = RANGES[option]
    outside = [low - 1, math.nextafter(low, -math.inf) if isinstance(flatten(RunConfig())[option], float) else low - 1]
    outside += [high * 1.001 + 1] if math.isfinite(high) else []
    for value in outside:
        with pytest.raises(SclaError) as caught:
            with_option(option, value).check()
        assert "\n" not in str(caught.value)
        assert f"--{option} " in str(caught.value)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_no_setting_takes_a_number_that_is_not_finite(value):
    for option, default in flatten(RunConfig()).items():
        if isinstance(default, float):
            with pytest.raises(SclaError):
                with_option(option, value).check()


@given(st.integers(1, 12), st.integers(1, 12), st.integers(-2, 14), st.integers(-2, 14))
def test_a_target_is_taken_exactly_when_it_lies_on_a_grid_with_room(width, height, x, y):
    config = dataclasses.replace(RunConfig(), grid=config_module.GridConfig((width, height), (x, y)))
    if 1 <= x <= width and 1 <= y <= height and width * height > 1:
        config.check()
    else:
        with pytest.raises(SclaError):
            config.check()


def test_initial_weights_must_be_ordered_and_lie_within_the_clip():
    for changes in ({"weight_low": 1.3}, {"weight_max": 1.1}):
        network = dataclasses.replace(RunConfig().network, **changes)
        with pytest.raises(SclaError, match="weight"):
            dataclasses.replace(RunConfig(), network=network).check()
