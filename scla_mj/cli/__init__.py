"""The command line: one module a verb, options from one dataclass, heavy imports only once a verb runs."""
