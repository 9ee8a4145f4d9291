"""Whether the python that was named for the peers is one, and has what they import."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Final

from benchmarks.peers import INSTALL, MODULES
from scla_mj.errors import SclaError

_ASK: Final = (
    "import importlib.util, json, sys; "
    "print(json.dumps([name for name in sys.argv[1:] if importlib.util.find_spec(name) is None]))"
)
_LONGEST_S: Final = 60.0
"""Finding a few packages takes a tenth of a second, on a cold disk some seconds."""


def require_peers_python(python: Path) -> None:
    """Ask the interpreter which of the peers' packages it lacks; nothing is imported.

    Raises:
        SclaError: it is not a file, no Python, or lacks one; the sentence says how the environment is made.
    """
    if python == Path():
        raise SclaError(f"--peers is empty or a folder: name the peers' own python, made by {INSTALL}")
    if not python.is_file():
        raise SclaError(f"--peers {python} is not a file: it must be the peers' own python, made by {INSTALL}")
    try:
        answer = subprocess.run(
            [str(python.absolute()), "-c", _ASK, *MODULES],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=True,
            timeout=_LONGEST_S,
        )
        missing = json.loads(answer.stdout)
    except OSError as error:
        raise SclaError(
            f"--peers {python} cannot be started: {error.strerror}; name the peers' own python, made by {INSTALL}"
        ) from error
    except (subprocess.SubprocessError, ValueError):
        raise SclaError(f"--peers {python} is not a Python: name the peers' own, made by {INSTALL}") from None
    if missing:
        raise SclaError(f"--peers {python} lacks {', '.join(missing)}: make the peers' environment by {INSTALL}")
