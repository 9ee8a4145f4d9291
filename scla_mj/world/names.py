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
