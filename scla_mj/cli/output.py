"""The command's own output: what cannot be written is lost, which the exit code tells, but it never ends a run."""

from __future__ import annotations

import errno
import io
import os
import sys
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from rich.console import Console

EXIT_UNWRITTEN: Final = 74
"""As sysexits.h has it for an error of input or output."""
EXIT_BROKEN_PIPE: Final = 141
"""As a shell reports a command that SIGPIPE has ended."""

_NARROWEST: Final = 80


class Output(io.FileIO):
    """A file descriptor that takes whatever is written; `fault` is the first error that it met."""

    fault: OSError | None = None

    def write(self, data: Any, /) -> int:
        """Write what can be written, and nothing more once an error was met."""
        if self.fault is None:
            try:
                return super().write(data) or 0
            except OSError as error:
                self.fault = error
        return memoryview(data).nbytes


def make_harmless() -> None:
    """Make `sys.stdout` and `sys.stderr` take whatever is written, in characters that they can show.

    A standard stream that is closed becomes the null device: else the next file to be opened would be taken for it.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.dup2(os.open(os.devnull, os.O_RDWR), number)
            os.set_inheritable(number, True)
    sys.stdout, sys.stderr = _harmless(sys.stdout, 1), _harmless(sys.stderr, 2)


def exit_code(code: int) -> int:
    """Return the exit code of a command that has ended with `code`, after its last output was written."""
    out, error = (_fault(stream) for stream in (sys.stdout, sys.stderr))
    if any(fault is not None and fault.errno == errno.EPIPE for fault in (out, error)):
        return EXIT_BROKEN_PIPE
    if out is None or code:
        return code
    print(f"scla-mj: the output cannot be written: {out.strerror}; all else is done", file=sys.stderr)
    return EXIT_UNWRITTEN


def wide_console(**how: Any) -> Console:
    """Return rich's console on stdout, wide enough for our tables whatever the terminal or COLUMNS says."""
    from rich.console import Console

    return Console(width=max(_NARROWEST, Console().width), **how)


def _harmless(stream: Any, number: int) -> Any:
    if stream is not None and type(getattr(stream.buffer, "raw", stream.buffer)) is not io.FileIO:
        return stream  # the console of Windows, or what a program has put there
    below = io.BufferedWriter(Output(number, "w", closefd=False))
    encoding = None if stream is None else stream.encoding
    return io.TextIOWrapper(below, encoding, "backslashreplace", line_buffering=number == 2 or below.isatty())


def _fault(stream: Any) -> OSError | None:
    stream.flush()
    below = getattr(getattr(stream, "buffer", None), "raw", None)
    return below.fault if isinstance(below, Output) else None
