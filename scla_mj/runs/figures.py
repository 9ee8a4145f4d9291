"""A run's three figures, drawn from its files: at its end, and again whenever they are wanted.

They can be drawn again at any time, so whatever keeps them from being drawn harms no run.
"""

from __future__ import annotations

import contextlib
import logging
import os
import shlex
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import Anatomy
from scla_mj.checked import CheckedConfig
from scla_mj.environment import hidden
from scla_mj.errors import SclaError
from scla_mj.paths import FIGURES
from scla_mj.runs.atomic import remove
from scla_mj.runs.brain import read_brain, read_weight_history
from scla_mj.runs.decisions import read_decisions
from scla_mj.runs.summary import Summary, read_summary
from scla_mj.signals import Snapshot, WeightCurve

_LOG: Final = logging.getLogger(__name__)
_SCRATCH: Final = ".figures."
"""Begins the name of the folder that they are drawn into: all of them become the run's, or none."""


def draw(folder: Path, checked: CheckedConfig, anatomy: Anatomy | None) -> None:
    """Draw the figures of a run from its summary, its decisions and its brain; those that were there are replaced.

    `anatomy` is its brain's.

    Raises:
        SclaError: a file is missing or damaged, or the figures cannot be drawn or written.
    """
    summary, hits = read_summary(folder), read_decisions(folder)["hit"].to_numpy()
    memory, curve = read_brain(folder, anatomy), read_weight_history(folder)
    for left in folder.glob(f"{_SCRATCH}*"):  # by a process that was killed
        shutil.rmtree(left, ignore_errors=True)
    try:
        with tempfile.TemporaryDirectory(prefix=_SCRATCH, dir=folder) as scratch:
            _draw(Path(scratch), checked, anatomy, summary, hits, memory, curve)
            for file in Path(scratch).iterdir():
                file.replace(folder / file.name)
    except SclaError:
        raise
    except Exception as error:  # of any kind, out of matplotlib or of what it cannot be imported without
        reason = (str(error).splitlines() or [""])[0]
        raise SclaError(f"the figures of {folder} cannot be drawn: {type(error).__name__}: {reason}") from error


def draw_if_possible(folder: Path, checked: CheckedConfig, anatomy: Anatomy | None) -> None:
    """Draw the figures or, where that cannot be, leave none and log how to draw them later.

    Raises:
        SclaError: what is left of them cannot be removed.
    """
    try:
        draw(folder, checked, anatomy)
    except SclaError as error:
        remove(*(folder / name for name in FIGURES))  # which may be damaged, or of fewer decisions
        command = f"scla-mj figures {shlex.quote(str(folder))}"
        _LOG.warning("%s; the run lacks nothing else, and `%s` draws them", error, command)


def _draw(
    folder: Path,
    checked: CheckedConfig,
    anatomy: Anatomy | None,
    summary: Summary,
    hits: NDArray[np.bool_],
    memory: Snapshot,
    curve: WeightCurve | None,
) -> None:
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # of a folder for its cache that it cannot write
    plots = import_plots()
    last = checked.grid(summary.epochs[-1].epoch)
    plots.plot_learning(folder, summary, hits[: plots.epoch_ends(summary)[-1]])
    if curve is not None and anatomy is not None:
        plots.plot_weights(folder, curve, anatomy.projections, summary)
    if memory.probabilities is not None:
        plots.plot_policy(folder, last, memory.probabilities, summary)


def import_plots() -> Any:
    """Import matplotlib, which is slow, even where the backend that the environment names is not there."""
    first, backend = "matplotlib" not in sys.modules, os.environ.get("MPLBACKEND")
    with hidden("MPLBACKEND"):
        import matplotlib as mpl

        from scla_mj.runs import plots
    if first and backend:  # of a program of the user's own, such as a notebook
        with contextlib.suppress(ValueError):
            mpl.rcParams["backend"] = backend
    return plots
