"""The report's chapters, one per module: each takes the study and returns what the template needs, as plain data."""
