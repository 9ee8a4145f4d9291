"""Colours and marks that every picture shares, whichever part of the package draws it: as hex, on light or on dark."""

from typing import Final

from scla_mj.anatomy import PROJECTIONS

TARGET_COLOUR: Final = "#cc3311"
TARGET_MARKER: Final = "*"
"""The target's mark on a map of a policy, as matplotlib names it: a star."""

# Mid tones: each stands out at 3 : 1 or more (WCAG 2.1's bound for graphics) on white and on the dashboard's dark.
_WARM: Final = ("#e03131", "#d9690a", "#b8860b", "#d6409f")
_COOL: Final = ("#2b7bd6", "#1098ad", "#7f66d9", "#2b9a66")


def _projection_colours() -> dict[str, str]:
    warm, cool = iter(_WARM), iter(_COOL)
    return {projection.name: next(warm if projection.agrees else cool) for projection in PROJECTIONS}


PROJECTION_COLOURS: Final = _projection_colours()
"""By projection: warm for those that agree, cool for opposite ones."""


def rgb(colour: str) -> tuple[int, int, int]:
    """Return a colour's red, green and blue, each 0 to 255."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue
