"""What is recorded at intervals: weight matrices, action probabilities, and the policy as arrows in the arena."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from scla_mj.grid import Action, Grid
from scla_mj.palette import ACTION_COLOURS
from scla_mj.signals import Snapshot
from scla_mj.telemetry import names
from scla_mj.telemetry.views import base

_POLICY: Final = f"{names.WORLD}/policy"
_ARROW_REACH: Final = 0.40
"""Length, in cells, of the arrow of an action that is certain."""
_ARROW_HEIGHT_M: Final = 0.004
_FAINT: Final = 0.02
"""Arrows of less probable actions are not drawn."""


class Learned(base.View):
    """The brain's memory."""

    def __init__(self, stream: rr.RecordingStream, run: base.RecordedRun) -> None:
        super().__init__(stream, run)
        self._logged: dict[str, int] = {}

    def panels(self) -> list[base.Panel]:
        """Return the weight matrices, if there are any; the policy is drawn in the arena."""
        mapping = rrb.TensorScalarMapping(colormap="inferno", mag_filter="nearest")
        matrices = [
            rrb.TensorView(origin=f"/{names.WEIGHT_MATRIX}/{name}", name=name, view_fit="fill", scalar_mapping=mapping)
            for name, _, _, shape, *_ in self.run.projections
            if len(shape) > 1
        ]
        if not matrices:
            return []
        grid = rrb.Grid(*matrices, grid_columns=4, name="Weight matrices, last epoch's end")
        return [base.Panel(base.Place.TABS, grid, rank=1)]

    def remember(self, snapshot: Snapshot, decision: int) -> None:
        """Log each part once per decision, to the bit: nothing learns between a decision's end and the run's."""
        if snapshot.weights is not None and self._is_fresh("weights", decision):
            weights = {} if self.run.anatomy is None else self.run.anatomy.by_projection(snapshot.weights)
            for projection in self.run.projections:
                matrix, ends = weights[projection.name], (projection.source, projection.target)
                dimensions = [*("block" for _ in matrix.shape[2:]), *ends][-matrix.ndim :]
                tensor = rr.Tensor(matrix, dim_names=dimensions, value_range=projection.weight_range)
                self.stream.log(f"{names.WEIGHT_MATRIX}/{projection.name}", tensor)
        if snapshot.probabilities is not None and self._is_fresh("probabilities", decision):
            tensor = rr.Tensor(snapshot.probabilities, dim_names=("x", "y", "action"), value_range=[0.0, 1.0])
            self.stream.log(names.PROBABILITIES, tensor)
            self.stream.log(_POLICY, _policy_arrows(snapshot.probabilities, self.run.grid))

    def state(self) -> dict[str, Any]:
        """Return after which decision each part was logged last."""
        return dict(self._logged)

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a `state`."""
        self._logged = dict(state)

    def _is_fresh(self, part: str, decision: int) -> bool:
        before, self._logged[part] = self._logged.get(part), decision
        return before != decision


def _policy_arrows(probabilities: NDArray[np.float64], grid: Grid) -> rr.Arrows3D:
    """Return an arrow per cell and action, as long and as bright as the action is probable."""
    cells = [cell for cell in grid.open_cells() if cell != grid.target]
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
