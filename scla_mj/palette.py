"""Colours and marks that pictures share: of figures as hex, on light or on dark; of the dashboard as red green blue."""

import itertools
import math
from collections.abc import Sequence
from typing import Final

from scla_mj.anatomy import INHIBITORY_ROLE, MOTOR_ROLE, PROJECTIONS, Population, Projection
from scla_mj.signals import Outcome

RGB = tuple[int, int, int]

TARGET_COLOUR: Final = "#cc3311"

PROJECTION_COLOURS: Final = {projection.name: str(projection.colour) for projection in PROJECTIONS}
"""By projection of the paper: a colour for each direction of the sensor; opposite projections are dashed."""
LINE_COLOURS: Final = ("#bc8800", "#5489fc", "#5e6363", "#6c2cff", "#ac8c5e", "#4c98c3")
"""For curves that nobody coloured: distinct for colour-blind readers too, and 3 : 1 on white and on dark."""
_LINES: Final = ("-", "--", ":", "-.")
_ALIKE: Final = 80.0
"""Colours, red green blue, that are no further apart are taken for each other on thin lines."""


def projection_styles(projections: Sequence[Projection]) -> dict[str, tuple[str, str]]:
    """Return each projection's colour and line style, by name: its own, or the next that no other is like."""
    taken = [rgb(projection.colour) for projection in projections if projection.colour]
    free = [colour for colour in LINE_COLOURS if all(math.dist(rgb(colour), other) > _ALIKE for other in taken)]
    styles, cycle = {}, itertools.cycle(itertools.product(_LINES, free or LINE_COLOURS))
    for projection in projections:
        line, colour = ("-", projection.colour) if projection.colour else next(cycle)
        styles[projection.name] = colour, "--" if projection.dashed else line
    return styles


def rgb(colour: str) -> RGB:
    """Return a colour's red, green and blue, each 0 to 255."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


def on_either(colour: RGB) -> RGB:
    """Return a colour, darkened as far as needed, for a line or point on white as on dark (3 : 1, WCAG 2.1)."""
    red, green, blue = colour
    while 0.2126 * (red / 255) ** 2.2 + 0.7152 * (green / 255) ** 2.2 + 0.0722 * (blue / 255) ** 2.2 > _BRIGHTEST:
        red, green, blue = (int(0.97 * part) for part in (red, green, blue))
    return red, green, blue


_BRIGHTEST: Final = 0.29
"""Luminance that still stands out from white at 3 : 1."""
BACKGROUND: Final[RGB] = (16, 18, 24)
TRAIL_S: Final = 12.0
"""How much of the last moves is drawn on the floor."""
TRAIL_HEIGHT_M: Final = 0.006
HIT_COLOUR: Final[RGB] = (255, 209, 102)
OUTCOME_COLOURS: Final[dict[Outcome, RGB]] = {
    Outcome.MOVED: (72, 202, 228),
    Outcome.BLOCKED: (239, 71, 111),
    Outcome.FAILED: (255, 0, 0),
}
ACTION_COLOURS: Final[tuple[RGB, ...]] = ((255, 190, 92), (92, 176, 255), (124, 222, 146), (244, 128, 190))


def _blend(colour: RGB, towards: RGB, share: float) -> RGB:
    red, green, blue = (round((1 - share) * a + share * b) for a, b in zip(colour, towards, strict=True))
    return red, green, blue


_HUES: Final[tuple[RGB, ...]] = (*ACTION_COLOURS, (205, 255, 223), (73, 233, 255), (252, 220, 36), (240, 105, 79))
"""The four actions' first, then such as are distinct from them and from each other, for colour-blind readers too."""
_SHADES: Final[dict[str, tuple[RGB, float]]] = {MOTOR_ROLE: ((255,) * 3, 0.35), INHIBITORY_ROLE: ((0,) * 3, 0.35)}


def population_colours(populations: Sequence[Population]) -> dict[str, RGB]:
    """Return each population's colour on the dashboard, by name: its own, or the next hue.

    Roles with as many populations as there are motor ones share their hues. So the paper's have the colour of their
    action: motor populations lighter, inhibitory ones darker.
    """
    colours: dict[str, RGB] = {}
    motors = sum(population.role == MOTOR_ROLE for population in populations)
    others = itertools.cycle((*_HUES[motors:], *_HUES[:motors]))
    for role in {population.role: None for population in populations}:
        group = [population for population in populations if population.role == role]
        for population, hue in zip(group, itertools.cycle(_HUES) if len(group) == motors else others, strict=False):
            towards, share = _SHADES.get(role, (hue, 0.0))
            colours[population.name] = rgb(population.colour) if population.colour else _blend(hue, towards, share)
    return colours
