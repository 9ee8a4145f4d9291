"""Options from dataclasses, and one sentence for whatever is wrong with them."""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Mapping
from typing import Any, Final

import tyro

from scla_mj.errors import SclaError

EXIT_BAD_INPUT: Final = 2
_FRAME: Final = "╭╮╰╯│─ "


def parse(verbs: Mapping[str, Any], arguments: list[str], *, prog: str) -> Any:
    """Return the options object of the verb that the arguments name.

    Raises:
        SclaError: an option is unknown, missing or of the wrong kind.
        SystemExit: help was asked for and printed.
    """
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            return tyro.extras.subcommand_cli_from_dict(dict(verbs), prog=prog, args=arguments)
    except SystemExit as stop:
        if stop.code != EXIT_BAD_INPUT:
            sys.stderr.write(complaint.getvalue())
            raise
        raise SclaError(_sentence(complaint.getvalue())) from None


def _sentence(box: str) -> str:
    """Take the message out of the frame that tyro draws around it; the frame's rule ends the message."""
    words: list[str] = []
    for line in box.splitlines():
        if line.startswith(("╭", "╰")):
            continue
        text = line.strip(_FRAME)
        if not text:
            break
        words.append(text.removeprefix("• "))
    return " ".join(words)
