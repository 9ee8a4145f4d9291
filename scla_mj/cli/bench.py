"""`scla-mj bench`: the benchmarks are not part of the package; run from a checkout, the command hands over to them."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NoReturn

from scla_mj.errors import SclaError

_CHECKOUT: Final = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Bench:
    """Time a run and its bare parts, other simulators and larger networks; only from a checkout."""

    @classmethod
    def start(cls, words: Sequence[str]) -> NoReturn:
        """Refuse, whatever the options: an installed package has no benchmarks."""
        raise SclaError("the benchmarks are not installed with the package: run this command from a git checkout")


def bench_command() -> Any:
    """Return the benchmarks' own command if this package lies in a checkout, else the one that says where they are."""
    if not (_CHECKOUT / "benchmarks" / "command.py").is_file():
        return Bench
    if str(_CHECKOUT) not in sys.path:
        sys.path.append(str(_CHECKOUT))
    return importlib.import_module("benchmarks.command").Bench
