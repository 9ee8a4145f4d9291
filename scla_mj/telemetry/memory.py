"""What is recorded at intervals: weight matrices, action probabilities, and the policy as arrows on the floor."""

from __future__ import annotations

from typing import Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from scla_mj.anatomy import PROJECTION_NAMES
from scla_mj.grid import Action, Grid
from scla_mj.signals import Snapshot
from scla_mj.telemetry import names
from scla_mj.telemetry.palette import ACTION_COLORS

_ARROW_REACH: Final = 0.40
"""Length, in cells, of the arrow of an action that is certain."""
_ARROW_HEIGHT_M: Final = 0.004
_FAINT: Final = 0.02
"""Arrows of less probable actions are not drawn."""


def log_snapshot(stream: rr.RecordingStream, snapshot: Snapshot, grid: Grid, weight_max: float) -> None:
    """Log a brain's memory at the time that is set, to the bit."""
    if snapshot.weights is not None:
        for name, matrix in zip(PROJECTION_NAMES, snapshot.weights, strict=True):
            tensor = rr.Tensor(matrix, dim_names=("sensor", "motor"), value_range=[0.0, weight_max])
            stream.log(f"{names.WEIGHT_MATRIX}/{name}", tensor)
    if snapshot.probabilities is not None:
        tensor = rr.Tensor(snapshot.probabilities, dim_names=("x", "y", "action"), value_range=[0.0, 1.0])
        stream.log(names.PROBABILITIES, tensor)
        stream.log(names.POLICY, policy_arrows(snapshot.probabilities, grid))


def policy_arrows(probabilities: NDArray[np.float64], grid: Grid) -> rr.Arrows3D:
    """Return an arrow a cell and action, as long and as bright as the action is probable."""
    cells = [cell for cell in grid.open_cells() if cell != grid.target]
    rows = np.array([[cell.x - 1, cell.y - 1] for cell in cells])
    centres = np.array([[*grid.centre_m(cell), _ARROW_HEIGHT_M] for cell in cells])
    steps = np.array([[*action.step, 0] for action in Action], float)
    chances = probabilities[rows[:, 0], rows[:, 1]]
    cell, action = np.nonzero(chances >= _FAINT)
    chance = chances[cell, action][:, np.newaxis]
    colors = np.array(ACTION_COLORS)[action] * (0.45 + 0.55 * chance)
    return rr.Arrows3D(
        origins=centres[cell],
        vectors=steps[action] * chance * _ARROW_REACH * grid.cell_size_m,
        radii=0.003 + 0.006 * chance[:, 0],
        colors=colors.astype(np.uint8),
    )
