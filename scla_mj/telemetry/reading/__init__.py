"""Reads a run's recording back, by itself or compared with the run's other files; nothing here writes."""
