"""The arena's cells from above: how good the brain finds them, how often the robot was there, and the policy."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from scla_mj.palette import BACKGROUND
from scla_mj.signals import DecisionRecord, Snapshot
from scla_mj.telemetry import names
from scla_mj.telemetry.views import base
from scla_mj.telemetry.views.learned import is_pictured

_VALUE: Final = "maps/value"
_VISITS: Final = "maps/visits"
_MOST_LABELS: Final = 150
"""Cells of which each still has room for a number."""
_LABEL_RISE: Final = 0.2
"""Rerun draws a label below its point: by about this part of a cell."""
_PATCH: Final = 0.5
"""Height of the dark patch behind a number, by a cell's: the light theme's labels are white on bright cells."""


class Maps(base.View):
    """A square per cell. Visits are counted where decisions are made."""

    def __init__(self, stream: rr.RecordingStream, run: base.RecordedRun) -> None:
        super().__init__(stream, run)
        self._cells = run.grid.cells
        self._visits = np.zeros(self._cells, np.int64)
        cells = run.grid.open_cells()
        self._labelled = cells if len(cells) <= _MOST_LABELS else []
        self._centres = [(cell.x - 0.5, self._cells[1] - cell.y + 0.5) for cell in self._labelled]
        self._has_values, self._has_policy = run.memory.values is not None, run.memory.probabilities is not None

    def panels(self) -> list[base.Panel]:
        """Return a map for each that there is."""
        maps = [self._map(_VALUE, "How good the brain finds each cell")] if self._has_values else []
        maps.append(self._map(_VISITS, "Where the robot decided, % of decisions so far"))
        if self._has_policy:
            reach_m = max(self._cells) * self.run.grid.cell_size_m
            shown = [f"/{path}/**" for path in (f"{names.WORLD}/tiles", names.POLICY, names.TARGET)]
            eye = rrb.EyeControls3D(position=(0.0, 0.0, 1.1 * reach_m), look_target=(0.0, 0.0, 0.0), eye_up=(0, 1, 0))
            policy = rrb.Spatial3DView(
                origin=f"/{names.WORLD}",
                contents=shown,
                name="Policy: an arrow as long as the action is probable",
                line_grid=False,
                eye_controls=eye,
                background=list(BACKGROUND),
            )
            maps.append(policy)
        return [base.Panel(base.Place.LEARNING_BOTTOM, panel, rank=rank) for rank, panel in enumerate(maps)]

    def log_static(self) -> None:
        """Log how the maps look."""
        width, height = self._cells
        form = rr.components.ImageFormat(width=width, height=height, channel_datatype="U8", color_model="L")
        bars = [[(x - 0.13, y), (x + 0.13, y)] for x, y in self._centres]
        for entity, colormap in ((_VALUE, "viridis"), (_VISITS, "inferno")):
            if entity == _VISITS or self._has_values:
                look = rr.DepthImage.from_fields(format=form, colormap=colormap, depth_range=[0, 255])
                self.stream.log(f"{entity}/cells", look, static=True)
                patches = rr.LineStrips2D(bars, radii=[_PATCH / 2], colors=[BACKGROUND])
                self.stream.log(f"{entity}/patches", patches, static=True)

    def add(self, record: DecisionRecord, decision: int) -> None:
        """Count where the decision was made."""
        x, y = record.move.before
        self._visits[x - 1, y - 1] += 1

    def remember(self, snapshot: Snapshot, decision: int, *, last: bool = False) -> None:
        """Log the maps as they are now, densely while most is learnt."""
        if not (last or is_pictured(decision)):
            return
        if self._has_values and snapshot.values is not None:
            self._log(_VALUE, snapshot.values, "{:.2f}")
        self._log(_VISITS, 100.0 * self._visits / max(1, int(self._visits.sum())), "{:.0f}")

    def state(self) -> dict[str, Any]:
        """Return the counts."""
        return {"visits": self._visits.copy()}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a `state`."""
        self._visits[:] = state["visits"]

    def _map(self, entity: str, name: str) -> rrb.Spatial2DView:
        width, height = self._cells
        bounds = rrb.VisualBounds2D(x_range=[-0.1, width + 0.1], y_range=[-0.1, height + 0.1])
        return rrb.Spatial2DView(origin=f"/{entity}", name=name, visual_bounds=bounds, background=list(BACKGROUND))

    def _log(self, entity: str, values: NDArray[np.float64], form: str) -> None:
        """Log a map, (W, H), with y upwards, and a number in every open cell."""
        shades = np.clip(values * (255 / max(float(values.max()), 1e-9)), 0, 255).astype(np.uint8)
        self.stream.log(f"{entity}/cells", rr.DepthImage.from_fields(buffer=shades.T[::-1].tobytes()))
        if self._labelled:
            labels = rr.Points2D(
                [(x, y - _LABEL_RISE) for x, y in self._centres],
                labels=[form.format(values[cell.x - 1, cell.y - 1]) for cell in self._labelled],
                colors=[base.LABEL_COLOUR],
                radii=[rr.Radius.ui_points(0.0)],
                show_labels=True,
            )
            self.stream.log(f"{entity}/labels", labels)
