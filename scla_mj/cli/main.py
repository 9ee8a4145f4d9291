"""`scla-mj VERB`: parse, run the verb, turn what the user can put right into one sentence and exit code 2."""

from __future__ import annotations

import sys
from typing import Final

from scla_mj.cli.inspect import Inspect
from scla_mj.cli.options import EXIT_BAD_INPUT, parse
from scla_mj.cli.reproduce import Reproduce
from scla_mj.cli.rollout import Rollout
from scla_mj.errors import SclaError

VERBS: Final = {"rollout": Rollout, "inspect": Inspect, "reproduce": Reproduce}
_EXIT_INTERRUPTED: Final = 130


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit code: 0 done, 2 bad input, 130 interrupted."""
    try:
        verb = parse(VERBS, sys.argv[1:] if arguments is None else arguments, prog="scla-mj")
        return int(verb.run())
    except SclaError as error:
        print(f"scla-mj: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt:
        print("scla-mj: interrupted; what was complete is on disk", file=sys.stderr)
        return _EXIT_INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
