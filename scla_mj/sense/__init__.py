"""Sense: from the robot's pose to what a brain is told."""
