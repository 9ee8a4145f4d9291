"""`scla-mj COMMAND`: parse, run the command, turn a user's error into one sentence and exit code 2."""

from __future__ import annotations

import io
import logging
import os
import signal
import sys
from typing import Final

from scla_mj import __version__
from scla_mj.cli.bench import Bench, bench_command
from scla_mj.cli.inspect import Inspect
from scla_mj.cli.options import EXIT_BAD_INPUT, parse
from scla_mj.cli.reproduce import Reproduce
from scla_mj.cli.resume import Resume
from scla_mj.cli.rollout import Rollout
from scla_mj.collector import collect_rarely
from scla_mj.engine.interrupts import Terminated
from scla_mj.errors import SclaError

COMMANDS: Final = {"rollout": Rollout, "resume": Resume, "inspect": Inspect, "reproduce": Reproduce, "bench": Bench}
_EXIT_BROKEN_PIPE: Final = 141


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit code.

    0 done, 2 bad input, 129 terminal closed, 130 interrupted, 141 nobody reads the output any more, 143 terminated.
    """
    collect_rarely()
    _say_what_the_package_logs()
    if arguments is None:  # this process is the command's own
        _escape_what_cannot_be_printed()
    try:
        try:
            return _run(arguments)
        finally:
            print(end="", flush=True)  # here, where a closed pipe can be caught, rather than as Python ends
    except BrokenPipeError:
        _silence()
        return _EXIT_BROKEN_PIPE


def _run(arguments: list[str] | None) -> int:
    try:
        words = sys.argv[1:] if arguments is None else arguments
        if words[:1] in (["--version"], ["-V"]):
            print(f"scla-mj {__version__}")
            return 0
        commands = COMMANDS | {"bench": bench_command()} if words[:1] == ["bench"] else COMMANDS
        command = parse(commands, words, prog="scla-mj")
        return int(command.run())
    except SclaError as error:
        print(f"scla-mj: {_one_line(str(error))}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt as stop:
        number = stop.args[0] if isinstance(stop, Terminated) else signal.SIGINT
        how = "interrupted" if number == signal.SIGINT else "terminated"
        print(f"scla-mj: {how}; what was complete is on disk", file=sys.stderr)
        return 128 + int(number)


def _one_line(sentence: str) -> str:
    """Escape what a user's words may hold: a sentence is one line, and no terminal obeys it."""
    return "".join(mark if mark.isprintable() else mark.encode("unicode_escape").decode() for mark in sentence)


class _Saying(logging.Handler):
    """Prints on the stderr of the moment, above a progress bar if there is one."""

    def emit(self, record: logging.LogRecord) -> None:
        print(f"scla-mj: {_one_line(record.getMessage())}", file=sys.stderr)


def _say_what_the_package_logs() -> None:
    """Print what takes long, and what was put right: from Python it is for the caller's `logging` to show."""
    log = logging.getLogger("scla_mj")
    log.handlers = [_Saying()]
    log.setLevel(logging.INFO)


def _escape_what_cannot_be_printed() -> None:
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _silence() -> None:
    """Let what is still to be flushed end nowhere, as the note on SIGPIPE in Python's `signal` documentation has it."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            os.dup2(nowhere, stream.fileno())


if __name__ == "__main__":
    sys.exit(main())
