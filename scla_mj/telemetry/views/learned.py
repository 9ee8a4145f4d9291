"""What is recorded at intervals to the bit, weights and action probabilities; and the policy as arrows in the arena."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from scla_mj.grid import Action, Grid
from scla_mj.palette import ACTION_COLOURS
from scla_mj.signals import Snapshot
from scla_mj.telemetry import names
from scla_mj.telemetry.views import base

_WEIGHTS_EVERY: Final = 100
"""Decisions for which one copy of all weights is enough, some 90 kB on the disk: this bounds short epochs."""
_PROBABILITIES_EVERY: Final = 50
_ARROW_REACH: Final = 0.40
"""Length, in cells, of the arrow of an action that is certain."""
_ARROW_HEIGHT_M: Final = 0.004
_FAINT: Final = 0.02
"""Arrows of less probable actions are not drawn."""


def is_pictured(decision: int) -> bool:
    """Return whether the weights after this decision of the run are a picture: densely first, when most is learnt."""
    apart = next((apart for limit, apart in ((10, 1), (200, 10), (1000, 50)) if decision <= limit), 250)
    return decision % apart == 0


def is_remembered(decision: int, of_epoch: int, length: int) -> bool:
    """Return whether the brain's memory is recorded after a decision of the run, the `of_epoch`-th of `length`."""
    return of_epoch == length or is_pictured(decision) or decision % _PROBABILITIES_EVERY == 0


class Learned(base.View):
    """The brain's memory."""

    def __init__(self, stream: rr.RecordingStream, run: base.RecordedRun) -> None:
        super().__init__(stream, run)
        self._logged: dict[str, int] = {}

    def remember(self, snapshot: Snapshot, decision: int, *, last: bool = False) -> None:
        """Log each part once per decision, to the bit: nothing learns between a decision's end and the run's.

        Weights are logged after the first decision and each epoch (of short ones some), and at the end.
        """
        if snapshot.weights is not None and (last or self._ends(decision)) and self._is_fresh("weights", decision):
            weights = {} if self.run.anatomy is None else self.run.anatomy.by_projection(snapshot.weights)
            for projection in self.run.projections:
                matrix, ends = weights[projection.name], (projection.source, projection.target)
                dimensions = [*("block" for _ in matrix.shape[2:]), *ends][-matrix.ndim :]
                tensor = rr.Tensor(matrix, dim_names=dimensions, value_range=projection.weight_range)
                self.stream.log(f"{names.WEIGHT_MATRIX}/{projection.name}", tensor)
        if snapshot.probabilities is not None and self._is_fresh("probabilities", decision):
            tensor = rr.Tensor(snapshot.probabilities, dim_names=("x", "y", "action"), value_range=[0.0, 1.0])
            self.stream.log(names.PROBABILITIES, tensor)
            self.stream.log(names.POLICY, _policy_arrows(snapshot.probabilities, self.run.grid))

    def state(self) -> dict[str, Any]:
        """Return after which decision each part was logged last."""
        return dict(self._logged)

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a `state`."""
        self._logged = dict(state)

    def _ends(self, decision: int) -> bool:
        """Return whether it is the first decision, or an epoch's last and the weights were not logged just before."""
        length = self.run.config.decisions
        ends = decision > 0 and decision % length == 0
        return decision == 1 or (ends and decision // _WEIGHTS_EVERY > (decision - length) // _WEIGHTS_EVERY)

    def _is_fresh(self, part: str, decision: int) -> bool:
        before, self._logged[part] = self._logged.get(part), decision
        return before != decision


def _policy_arrows(probabilities: NDArray[np.float64], grid: Grid) -> rr.Arrows3D:
    """Return an arrow per cell and action, as long and as bright as the action is probable."""
    cells = [cell for cell in grid.open_cells() if cell not in grid.targets]
    rows = np.array([[cell.x - 1, cell.y - 1] for cell in cells])
    centres = np.array([[*grid.centre_m(cell), _ARROW_HEIGHT_M] for cell in cells])
    steps = np.array([[*action.step, 0] for action in Action], float)
    chances = probabilities[rows[:, 0], rows[:, 1]]
    cell, action = np.nonzero(chances >= _FAINT)
    chance = chances[cell, action][:, np.newaxis]
    colours = np.array(ACTION_COLOURS)[action] * (0.45 + 0.55 * chance)
    return rr.Arrows3D(
        origins=centres[cell],
        vectors=steps[action] * chance * _ARROW_REACH * grid.cell_size_m,
        radii=0.003 + 0.006 * chance[:, 0],
        colors=colours.astype(np.uint8),
    )
