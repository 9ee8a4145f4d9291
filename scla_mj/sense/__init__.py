"""Sense: from the robot's pose to a percept."""
