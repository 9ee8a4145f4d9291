"""The shared colours can be seen on either background, and tell agreeing projections from opposite ones."""

import colorsys

import numpy as np
import pytest

from scla_mj.anatomy import PROJECTIONS
from scla_mj.palette import PROJECTION_COLOURS, TARGET_COLOUR, rgb

WHITE, DARK = (255, 255, 255), (16, 18, 24)


def luminance(colour):
    """Relative luminance by WCAG 2.1."""
    channels = np.array(colour) / 255
    return float(np.where(channels <= 0.03928, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
                 @ [0.2126, 0.7152, 0.0722])  # fmt: skip


@pytest.mark.parametrize("colour", [*PROJECTION_COLOURS.values(), TARGET_COLOUR])
def test_a_colour_stands_out_on_light_and_on_dark(colour):
    for background in (WHITE, DARK):
        darker, lighter = sorted([luminance(rgb(colour)), luminance(background)])
        assert (lighter + 0.05) / (darker + 0.05) >= 3


def test_agreeing_projections_are_warm_and_opposite_ones_cool():
    for projection in PROJECTIONS:
        hue, *_ = colorsys.rgb_to_hsv(*(part / 255 for part in rgb(PROJECTION_COLOURS[projection.name])))
        assert (hue < 1 / 6 or hue > 5 / 6 + 0.05) == projection.agrees
    assert len(set(PROJECTION_COLOURS.values())) == len(PROJECTIONS)
