"""The shared colours can be seen on either background, and tell directions apart for every reader."""

import itertools

import numpy as np
import pytest

from scla_mj.anatomy import POPULATIONS, PROJECTIONS, Projection, stacked
from scla_mj.palette import (
    ACTION_COLOURS,
    HIT_COLOUR,
    PROJECTION_COLOURS,
    TARGET_COLOUR,
    on_either,
    population_colours,
    projection_styles,
    rgb,
)

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


@pytest.mark.parametrize("colour", [*ACTION_COLOURS, HIT_COLOUR, *population_colours(POPULATIONS).values()])
def test_what_a_plot_draws_stands_out_on_a_light_and_on_a_dark_theme(colour):
    drawn = luminance(on_either(colour))
    assert (1 + 0.05) / (drawn + 0.05) >= 3
    assert (drawn + 0.05) / (luminance(DARK) + 0.05) >= (3 if drawn < luminance(colour) else 1)


# Machado, Oliveira and Fernandes (2009), severity 1, in linear RGB.
DEFICIENCIES = {
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
    "none": np.eye(3),
}
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
CIE76_AT_LEAST = 20
"""A difference of 2.3 is just noticeable side by side; thin lines far apart take several times that."""


def as_seen(colour, deficiency):
    """CIE L*a*b* of a colour as a colour-blind reader sees it."""
    channels = np.array(colour) / 255
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    xyz = XYZ @ np.clip(np.array(DEFICIENCIES[deficiency]) @ linear, 0, 1) / XYZ.sum(axis=1)
    x, y, z = np.where(xyz > (6 / 29) ** 3, np.cbrt(xyz), xyz / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("deficiency", DEFICIENCIES)
def test_directions_are_told_apart_by_colour_blind_readers_too_and_kinds_by_dashes(deficiency):
    by_direction = {projection.sensor: PROJECTION_COLOURS[projection.name] for projection in PROJECTIONS}
    seen = [as_seen(rgb(colour), deficiency) for colour in by_direction.values()]
    assert min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2)) > CIE76_AT_LEAST
    assert len(seen) == 4
    for projection in PROJECTIONS:
        assert PROJECTION_COLOURS[projection.name] == by_direction[projection.sensor]
        assert projection.dashed != projection.agrees


def test_projections_beyond_the_papers_have_colours_that_none_of_the_papers_is_like():
    added = [Projection(f"SUtoM{side}", "SU", f"M{side}", (100, 100)) for side in "LR"]
    styles = projection_styles([*PROJECTIONS, *added])
    papers = [as_seen(rgb(colour), "none") for colour in PROJECTION_COLOURS.values()]
    for own in (as_seen(rgb(styles[projection.name][0]), "none") for projection in added):
        assert min(np.linalg.norm(own - other) for other in papers) > CIE76_AT_LEAST
    assert len({styles[projection.name] for projection in added}) == 2


def test_the_papers_populations_have_their_actions_hues_and_another_brains_place_cells_that_of_no_action():
    papers = population_colours(POPULATIONS)
    assert tuple(papers[f"S{side}"] for side in "UDLR") == ACTION_COLOURS
    motors = [(name, 1, "motor") for name in ("up", "down", "left", "right")]
    own = population_colours(stacked(("place", 9, "sensory"), *motors, ("critic", 1, "critic")))
    assert len({*own.values(), *ACTION_COLOURS}) == 10
