"""A run that can be exported: complete, sound and recorded."""

from __future__ import annotations

import shlex
from pathlib import Path

from scla_mj.engine.stored_run import StoredRun, load_run
from scla_mj.errors import SclaError
from scla_mj.runs.seal import check_seal


def exportable(path: Path) -> StoredRun:
    """Return the run of a folder, each of its files as it was left.

    Raises:
        SclaError: there is none, it is unfinished or damaged, or nothing of it was recorded.
    """
    run = load_run(path)
    if not run.is_complete:
        raise SclaError(f"{path} is unfinished: `scla-mj resume {shlex.quote(str(path))}` finishes it")
    check_seal(run.path)
    if "spikes" in run.lacks:
        again = f"scla-mj rollout NEW --config {shlex.quote(str(path))} --telemetry light"
        raise SclaError(f"{path} has no recording (--telemetry off), so no spikes or poses: `{again}` makes one")
    return run
