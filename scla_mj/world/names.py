"""Names of the arena's parts that Python refers to, and its groups of geoms; the robot's are in robot.py."""

from typing import Final

FLOOR: Final = "floor"
WALL_SIDES: Final = ("left", "right", "bottom", "top")
TARGET_DISC: Final = "target_disc"
TARGET_RING: Final = "target_ring"
TOP_CAMERA: Final = "top"
ANGLED_CAMERA: Final = "angled"

WALL_GROUP: Final = 1
VISUAL_GROUP: Final = 2
"""Groups of geoms, as assets/scene.xml has them: walls are seen and ranged, group 2 is only seen, 3 only touched."""


def of_target(part: str, number: int) -> str:
    """Return the name of a part of a target: as it is of the first, number 0, else with the target's, from 2."""
    kind, _, what = part.partition("_")
    return f"{kind}{number + 1 if number else ''}_{what}"
