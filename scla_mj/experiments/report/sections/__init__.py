"""The report's chapters, one a module: each takes the study and returns a section."""
