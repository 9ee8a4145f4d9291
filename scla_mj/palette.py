"""Colours and marks that pictures share: of figures as hex, on light or on dark; of the dashboard as red green blue."""

from typing import Final

from scla_mj.anatomy import INHIBITORY, MOTOR, PROJECTIONS, SENSORY
from scla_mj.signals import Outcome

RGB = tuple[int, int, int]

TARGET_COLOUR: Final = "#cc3311"

PROJECTION_COLOURS: Final = {projection.name: str(projection.colour) for projection in PROJECTIONS}
"""By projection of the paper: warm for those that agree, cool for opposite ones."""


def rgb(colour: str) -> RGB:
    """Return a colour's red, green and blue, each 0 to 255."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


BACKGROUND: Final[RGB] = (16, 18, 24)
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


POPULATION_COLOURS: Final[dict[str, RGB]] = {
    population.name: _blend(colour, towards, share)
    for group, towards, share in ((SENSORY, (0, 0, 0), 0.0), (MOTOR, (255,) * 3, 0.35), (INHIBITORY, (0, 0, 0), 0.35))
    for population, colour in zip(group, ACTION_COLOURS, strict=True)
}
"""In the colour of their action: motor populations lighter, inhibitory ones darker."""
