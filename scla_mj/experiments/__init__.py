"""Runs as data: put the parts together, let them go on, keep what they did."""
