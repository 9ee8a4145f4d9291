"""The named sets fill in the issue's figures; the neutral settings disturb nothing."""

import dataclasses
import math

import pytest

from scla_mj.checked import check
from scla_mj.config import RunConfig
from scla_mj.disturbances import ALL, SETS, DisturbanceConfig, with_sets
from scla_mj.errors import SclaError

NEUTRAL = DisturbanceConfig()


def test_the_sets_have_the_figures_that_were_asked_for():
    everything = with_sets(NEUTRAL, ["all"])
    assert everything == DisturbanceConfig((0.3, 1.5), (0.7, 1.3), 0.05, 0.30, 8.0, 1, 2.0)
    assert with_sets(NEUTRAL, list(SETS)) == everything


@pytest.mark.parametrize("name", SETS)
def test_a_set_fills_in_its_own_settings_and_no_other(name):
    filled = dataclasses.asdict(with_sets(NEUTRAL, [name]))
    changed = {item for item, value in filled.items() if value != getattr(NEUTRAL, item)}
    assert changed == SETS[name].keys()


def test_settings_that_no_set_names_stay_as_they_are():
    own = DisturbanceConfig(push_n_per_kg=3.0)
    assert with_sets(own, ["tilt"]) == dataclasses.replace(own, tilt_deg=2.0)
    assert with_sets(own, []) == own


def test_every_set_is_within_the_limits():
    for name in (*SETS, ALL):
        check(RunConfig(disturbance=with_sets(NEUTRAL, [name])))


@pytest.mark.parametrize(
    ("ends", "said"),
    [((1.5, 0.3), "lower end first"), ((math.nan, 1.0), "finite"), ((0.3, math.inf), "finite"), ((0.0, 1.0), "0.05")],
)
def test_a_range_is_two_finite_numbers_in_order(ends, said):
    with pytest.raises(SclaError, match=said) as caught:
        check(RunConfig(disturbance=DisturbanceConfig(friction_scale=ends)))
    assert "--disturbance.friction-scale is" in str(caught.value)


def test_only_what_is_not_neutral_changes_the_model():
    assert not NEUTRAL.model_changes
    assert not with_sets(NEUTRAL, ["noise", "pushes", "latency"]).model_changes
    for name in ("friction", "mass", "wheels", "tilt"):
        assert with_sets(NEUTRAL, [name]).model_changes
