"""The one exception that the user is meant to read."""


class SclaError(Exception):
    """Something the user can put right: one sentence says what was wrong and what would be right.

    The command line prints it and exits with code 2; a library user catches it like any other exception.
    """
