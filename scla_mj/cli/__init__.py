"""The command line: one module per command, options from dataclasses, heavy imports only once a command runs."""
