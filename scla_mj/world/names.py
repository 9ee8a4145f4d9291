"""Names of the compiled model's parts that Python refers to: the robot's carry its prefix, the arena's do not."""

from typing import Final

ROBOT_PREFIX: Final = "robot/"
CHASSIS: Final = ROBOT_PREFIX + "chassis"
ROOT_JOINT: Final = ROBOT_PREFIX + "root"
WHEELS: Final = (ROBOT_PREFIX + "wheel_left", ROBOT_PREFIX + "wheel_right")
"""Bodies and joints alike."""
WHEEL_CONTACTS: Final = (ROBOT_PREFIX + "wheel_left_collision", ROBOT_PREFIX + "wheel_right_collision")
CASTER_CONTACT: Final = ROBOT_PREFIX + "caster_collision"
BUMPERS: Final = (ROBOT_PREFIX + "bumper_front_collision", ROBOT_PREFIX + "bumper_rear_collision")
TOUCH_SENSORS: Final = (ROBOT_PREFIX + "touch_front", ROBOT_PREFIX + "touch_rear")

FLOOR: Final = "floor"
WALL_SIDES: Final = ("left", "right", "bottom", "top")
TARGET_DISC: Final = "target_disc"
TARGET_RING: Final = "target_ring"
TOP_CAMERA: Final = "top"
ANGLED_CAMERA: Final = "angled"

WALL_GROUP: Final = 1
VISUAL_GROUP: Final = 2
"""Groups of geoms, as assets/scene.xml has them: walls are seen and ranged, group 2 is only seen, 3 only touched."""
