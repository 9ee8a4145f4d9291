"""Options from dataclasses, and one sentence for whatever is wrong with them."""

from __future__ import annotations

import contextlib
import difflib
import io
import itertools
from collections.abc import Mapping
from typing import Any, Final

import tyro

from scla_mj.cli.words import HELP, sort_words, syntax_of
from scla_mj.errors import SclaError

EXIT_BAD_INPUT: Final = 2
_ABOUT: Final = (
    "Spiking-based Cellular Learning Automata on a robot in MuJoCo. --version prints the version; "
    "--tyro-print-completion bash, zsh or fish a completion script for the shell."
)
_COMPLETION: Final = "--tyro-print-completion"


def parse(commands: Mapping[str, Any], words: list[str], *, prog: str) -> Any:
    """Return the options object of the command that the first word names.

    Raises:
        SclaError: an option is unknown, missing, given twice or of the wrong kind.
        SystemExit: help or a shell's completion was asked for and printed.
    """
    first = words[0] if words else ""
    if first in HELP or (first == _COMPLETION and words[1:] in (["bash"], ["zsh"], ["fish"])):
        return tyro.extras.subcommand_cli_from_dict(dict(commands), prog=prog, description=_ABOUT, args=words)
    if first not in commands:
        raise SclaError(_no_command(first, commands, prog))
    command, words, default = commands[first], words[1:], None
    if hasattr(command, "start"):
        command, default = command.start(words)
    call: dict[str, Any] = {"prog": f"{prog} {first}", "default": default or tyro.MISSING_NONPROP}
    if any(word in HELP for word in itertools.takewhile(lambda word: word != "--", words)):
        return tyro.cli(command, args=HELP[:1], **call)
    syntax = syntax_of(command)
    line = sort_words(syntax._replace(remarks=getattr(default, "remarks", syntax.remarks)), words)
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            options = tyro.cli(command, args=line.words(), config=(tyro.conf.DisallowNone,), **call)
    except SystemExit:
        raise SclaError(" ".join(complaint.getvalue().split())) from None
    return options.finish(line.options) if hasattr(options, "finish") else options


def require_speed(speed: float) -> None:
    """Refuse a --speed that cannot be shown.

    Raises:
        SclaError: it is not 0.01 to 1000.
    """
    if not 0.01 <= speed <= 1000:
        raise SclaError(f"--speed is {speed}: it must be 0.01 to 1000, simulated seconds per second")


def _no_command(word: str, commands: Mapping[str, Any], prog: str) -> str:
    choice = f"choose {', '.join(commands)}; {prog} --help describes them"
    if not word:
        return f"a command is missing: {choice}"
    if word.startswith("-"):
        return f"{word} stands before the command: options go after it; {choice}"
    near = difflib.get_close_matches(word, commands, n=1)
    return f"{word} is not a command: " + (f"did you mean {near[0]}?" if near else choice)
