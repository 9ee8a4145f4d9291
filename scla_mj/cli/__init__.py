"""The command line: one module per command, options from dataclasses, heavy imports only once a command runs.

Its words decide what a command does, not the environment, whose variables are hidden before any library is imported.
"""

from scla_mj.environment import hide_all

hide_all()
