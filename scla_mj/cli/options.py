"""Options from dataclasses, and one sentence for whatever is wrong with them."""

from __future__ import annotations

import contextlib
import difflib
import io
import itertools
import re
import sys
from collections.abc import Mapping
from typing import Any, Final

import tyro

from scla_mj.config import RunConfig
from scla_mj.disturbances import ALL, SETS, figures_of
from scla_mj.errors import SclaError
from scla_mj.limits import flatten

EXIT_BAD_INPUT: Final = 2
_DISTURB: Final = "--disturb"
_FRAME: Final = "╭╮╰╯│─- "
_WANTED: Final = {
    re.compile(r"Error parsing (\S+): invalid literal for int\(\) with base 10: ('.*')"): "a whole number",
    re.compile(r"Error parsing (\S+): could not convert string to float: ('.*')"): "a number",
    re.compile(r"Error parsing (\S+): Could not find valid parse for arguments: (.*)"): "pairs of whole numbers",
}
_MISSING: Final = re.compile(r"Missing from (.*?): (\S+) (.*?) \(required\)")
_UNKNOWN: Final = re.compile(r"Unrecognized options: (\S+)")


def parse(verbs: Mapping[str, Any], arguments: list[str], *, prog: str) -> Any:
    """Return the options object of the verb that the arguments name.

    Raises:
        SclaError: an option is unknown, missing or of the wrong kind.
        SystemExit: help was asked for and printed.
    """
    arguments = _with_figures(arguments)
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            return tyro.extras.subcommand_cli_from_dict(dict(verbs), prog=prog, args=arguments)
    except SystemExit as stop:
        if stop.code != EXIT_BAD_INPUT:
            sys.stderr.write(complaint.getvalue())
            raise
        raise SclaError(_plain(_sentence(complaint.getvalue()), verbs)) from None


def _with_figures(arguments: list[str]) -> list[str]:
    """Put the figures that `--disturb` stands for behind it, but for settings that are typed themselves."""
    if _DISTURB not in arguments:
        return arguments
    after = arguments[arguments.index(_DISTURB) + 1 :]
    names = list(itertools.takewhile(lambda word: not word.startswith("-"), after))
    unknown = [name for name in names if name not in (*SETS, ALL)]
    if unknown or not names:
        what = f"{_DISTURB} {unknown[0]}: a set" if unknown else f"{_DISTURB} names nothing: it"
        raise SclaError(f"{what} must be one of {', '.join((*SETS, ALL))}; RUN goes before it")
    figures = []
    for setting, value in figures_of(names).items():
        option = f"--disturbance.{setting.replace('_', '-')}"
        if not any(word.replace("_", "-").split("=")[0] == option for word in arguments):
            figures += [option, *map(str, value if isinstance(value, tuple) else (value,))]
    return arguments + figures


def _sentence(box: str) -> str:
    """Take the message out of what tyro draws around it: a frame with a title, or in ASCII a line for it; rules."""
    blocks: list[list[str]] = [[]]
    for line in box.strip().splitlines():
        text = line.strip(_FRAME)
        if line.startswith(("╭", "╰")):
            continue
        if text:
            blocks[-1].append(line.strip("│ ").removeprefix("• ").removeprefix("* "))
        else:
            blocks.append([])
    framed = box.lstrip().startswith("╭")
    return " ".join(blocks[0] if framed or len(blocks) == 1 else blocks[1])


def _plain(sentence: str, verbs: Mapping[str, Any]) -> str:
    """Say in a user's words what tyro says in a programmer's."""
    for pattern, wanted in _WANTED.items():
        found = pattern.search(sentence)
        if found:
            return f"{found[1]} wants {wanted}, not {found[2]}"
    missing = _MISSING.match(sentence)
    if missing:
        return f"{missing[1]} wants {missing[2]}: {missing[3]}"
    unknown = _UNKNOWN.match(sentence)
    if not unknown:
        return sentence
    word = unknown[1].rstrip(",")
    if not word.startswith("-"):
        return f"{word} is no verb: choose {', '.join(verbs)}"
    near = difflib.get_close_matches(word.lstrip("-"), flatten(RunConfig()), n=1)
    return f"{word} is no option: " + (f"did you mean --{near[0]}?" if near else "see --help of the verb")
