"""`scla-mj COMMAND`: parse, run the command, turn a user's error into one sentence and exit code 2."""

from __future__ import annotations

import logging
import signal
import sys
from typing import Final

from scla_mj import __version__
from scla_mj.cli.bench import Bench, bench_command
from scla_mj.cli.export import Export
from scla_mj.cli.figures import Figures
from scla_mj.cli.inspect import Inspect
from scla_mj.cli.options import EXIT_BAD_INPUT, parse
from scla_mj.cli.output import exit_code, make_harmless
from scla_mj.cli.render import Render
from scla_mj.cli.reproduce import Reproduce
from scla_mj.cli.resume import Resume
from scla_mj.cli.rollout import Rollout
from scla_mj.cli.sweep import Sweep
from scla_mj.cli.view import View
from scla_mj.collector import collect_rarely
from scla_mj.engine.interrupts import HANGUP, Terminated
from scla_mj.errors import SclaError

COMMANDS: Final = {
    "rollout": Rollout,
    "resume": Resume,
    "inspect": Inspect,
    "view": View,
    "render": Render,
    "figures": Figures,
    "export": Export,
    "reproduce": Reproduce,
    "sweep": Sweep,
    "bench": Bench,
}

_KEEP_NOTHING: Final = frozenset({"inspect", "render", "view"})


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit code.

    0 done, 2 bad input, 74 the output cannot be written, 129 terminal closed, 130 interrupted, 141 nobody reads the
    output, 143 terminated.
    """
    collect_rarely()
    _say_what_the_package_logs()
    if arguments is not None:
        return _run(arguments)
    make_harmless()  # this process is the command's own
    try:
        code = _run(sys.argv[1:])
    except SystemExit as end:  # tyro has printed what was asked for
        code = int(end.code or 0)
    return exit_code(code)


def _run(words: list[str]) -> int:
    try:
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
        how = {signal.SIGINT: "interrupted", HANGUP: "the terminal was closed"}.get(number, "terminated")
        kept = "" if _KEEP_NOTHING.issuperset(words[:1]) else "; what was complete is on disk"
        print(f"scla-mj: {how}{kept}", file=sys.stderr)
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


if __name__ == "__main__":
    sys.exit(main())
