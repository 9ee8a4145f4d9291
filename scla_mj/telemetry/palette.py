"""The dashboard's colours: a hue an action, and the projections' own, which the figures share."""

from typing import Final

from scla_mj.anatomy import INHIBITORY, MOTOR, POPULATIONS, SENSORY
from scla_mj.palette import PROJECTION_COLOURS, rgb
from scla_mj.signals import Outcome

RGB = tuple[int, int, int]

ACTION_COLORS: Final[tuple[RGB, ...]] = ((255, 190, 92), (92, 176, 255), (124, 222, 146), (244, 128, 190))
CEILING_COLOR: Final[RGB] = (150, 156, 168)
LEARNING_COLOR: Final[RGB] = (92, 132, 180)
EPOCH_COLOR: Final[RGB] = (255, 209, 102)
BACKGROUND: Final[RGB] = (16, 18, 24)
LABEL_COLOR: Final[RGB] = (178, 184, 196)
TILE_COLORS: Final[tuple[RGB, RGB]] = ((196, 200, 206), (178, 184, 192))
TRAIL_COLORS: Final[dict[Outcome, RGB]] = {
    Outcome.MOVED: (72, 202, 228),
    Outcome.BLOCKED: (239, 71, 111),
    Outcome.FAILED: (255, 0, 0),
}
HIT_COLOR: Final[RGB] = (255, 209, 102)


def _blend(color: RGB, towards: RGB, share: float) -> RGB:
    red, green, blue = (round((1 - share) * a + share * b) for a, b in zip(color, towards, strict=True))
    return red, green, blue


def _population_colors() -> dict[str, RGB]:
    colors: dict[str, RGB] = {}
    for group, towards, share in (
        (SENSORY, (0, 0, 0), 0.0),
        (MOTOR, (255, 255, 255), 0.35),
        (INHIBITORY, (0, 0, 0), 0.35),
    ):
        for population, color in zip(group, ACTION_COLORS, strict=True):
            colors[population.name] = _blend(color, towards, share)
    return colors


POPULATION_COLORS: Final = _population_colors()
PROJECTION_COLORS: Final[dict[str, RGB]] = {name: rgb(colour) for name, colour in PROJECTION_COLOURS.items()}
assert len(POPULATION_COLORS) == len(POPULATIONS)
