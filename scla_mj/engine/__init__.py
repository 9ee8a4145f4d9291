"""The engine: carries out one run, from its configuration to a finished, resumable folder."""
