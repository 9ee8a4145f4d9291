"""The arena in 3D: a compiled MuJoCo model's visible geoms, drawn once, the poses that move, and the trail.

The model is handed in and read through its arrays alone. Bodies nest as they do in the model, so a wheel needs nothing
but its own spin angle. The floor's plane is drawn as the grid's tiles.
"""

from __future__ import annotations

import re
from collections import defaultdict
from typing import Any, Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from scla_mj.grid import Cell, Grid
from scla_mj.palette import BACKGROUND, TRAIL_HEIGHT_M, TRAIL_S
from scla_mj.signals import TRAJECTORY_COLUMNS, DecisionRecord, Snapshot
from scla_mj.telemetry import names
from scla_mj.telemetry.views import base
from scla_mj.telemetry.views.learned import is_pictured

_TRAIL: Final = f"{names.WORLD}/trajectory"
_TILE_THICKNESS_M: Final = 0.002
_TILES: Final = f"{names.WORLD}/tiles"
_NUMBERS: Final = f"{names.WORLD}/numbers"
_TILE_COLOURS: Final = ((196, 200, 206), (178, 184, 192))
_WORTH_COLOUR: Final = (56, 176, 112)
_MOST_NUMBERS: Final = 12
"""Columns or rows that still have room for a number each."""
_NUMBERS_OUTSIDE: Final = 1.0
"""How far outside of the outermost cells' centres the numbers stand, in cells."""
_WORTH_SHARE: Final = 0.65
"""How far the best cell's tile is tinted."""

_TIME: Final = TRAJECTORY_COLUMNS.index("time_s")
_POSITION: Final = slice(TRAJECTORY_COLUMNS.index("x_m"), TRAJECTORY_COLUMNS.index("z_m") + 1)
_QUATERNION: Final = slice(TRAJECTORY_COLUMNS.index("qw"), TRAJECTORY_COLUMNS.index("qz") + 1)
_WHEELS: Final = [TRAJECTORY_COLUMNS.index(f"wheel_{side}_rad") for side in ("left", "right")]

# mjtGeom and mjtJoint of MuJoCo's mjmodel.h.
_SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX = 2, 3, 4, 5, 6
_FREE_JOINT, _HINGE_JOINT = 0, 3

_FIRST_HIDDEN_GROUP: Final = 3
"""Groups 0 to 2 are seen, 3 and above are for collision only (MuJoCo's own viewer hides them too)."""
_DEFAULT_RGBA: Final = (0.5, 0.5, 0.5, 1.0)
"""MuJoCo's geom colour when none is set: its material's colour then counts."""


class Arena(base.View):
    """The robot in its arena, and the trail of its last moves.

    The model has one free body, the chassis, and a hinged wheel on either side of it.
    """

    def __init__(self, stream: rr.RecordingStream, run: base.RecordedRun) -> None:
        super().__init__(stream, run)
        self._first_targets = run.grid.targets
        self._chassis = int(run.model.jnt_bodyid[np.flatnonzero(run.model.jnt_type == _FREE_JOINT)[0]])
        self._paths = _body_paths(run.model, self._chassis)
        self._wheels = _wheels(run.model, self._chassis)
        self._poses, self._counts = self.gather(np.float64, len(TRAJECTORY_COLUMNS)), self.gather(np.int64)
        self._stands = False

    def panels(self) -> list[base.Panel]:
        """Return the arena from above and in front."""
        grid = self.run.grid
        reach_m = max(grid.cells) * grid.cell_size_m
        eye = rrb.EyeControls3D(
            position=(0.0, -0.77 * reach_m, 0.86 * reach_m), look_target=(0.0, -0.05 * reach_m, 0.0), eye_up=(0, 0, 1)
        )
        panel = rrb.Spatial3DView(
            origin=f"/{names.WORLD}",
            name=f"Arena: the last {TRAIL_S:g} s"
            + ", action probabilities" * (self.run.memory.probabilities is not None)
            + ", worth of cells in green" * self._tinted,
            line_grid=False,
            overrides={f"/{_TRAIL}": rrb.VisibleTimeRanges(base.last(TRAIL_S))},
            eye_controls=eye,
            background=list(BACKGROUND),
        )
        return [base.Panel(base.Place.NOW_LEFT, panel, rank=1, share=4)]

    def log_static(self) -> None:
        """Log every visible geom as static shapes, every fixed body's pose, the tiles, and how wide the trail is."""
        model, paths = self.run.model, self._paths
        for body, path in paths.items():
            if body not in (0, self._chassis):
                mount = rr.Transform3D(translation=model.body_pos[body], quaternion=_xyzw(model.body_quat[body]))
                self.stream.log(path, mount, static=True)
        _log_geoms(self.stream, model, paths | {wheel: self._spin(wheel) for wheel in self._wheels})
        _log_tiles(self.stream, self.run.grid, coloured=not self._tinted)
        _log_numbers(self.stream, self.run.grid)
        self.stream.log(_TRAIL, rr.LineStrips3D.from_fields(radii=[0.004]), static=True)

    def add(self, record: DecisionRecord, decision: int) -> None:
        """Keep the poses, and in the first decision that it stands there from the start."""
        trajectory = record.move.trajectory
        kept = base.kept_poses(len(trajectory), self.run.clock.control_period_s)
        poses = trajectory.take(kept, axis=0)
        if len(kept) and not self._stands:
            poses = np.concatenate([poses[:1], poses])
            poses[0, _TIME], self._stands = record.time_s, True
        self._poses.extend(poses)
        self._counts.append(len(poses))

    def send(self, rows: base.Rows) -> None:
        """Send the chassis' poses, the wheels' turns, and a line strip per decision that moved."""
        poses, counts = self._poses.rows, self._counts.rows
        if not len(poses):
            return
        index = base.at_poses(rows, poses[:, _TIME], counts)
        position_m = poses[:, _POSITION].astype(np.float32)
        quaternion = _xyzw(poses[:, _QUATERNION]).astype(np.float32)
        chassis = rr.Transform3D.columns(translation=position_m, quaternion=quaternion)
        self.stream.send_columns(self._paths[self._chassis], index, chassis)
        for wheel, column in zip(self._wheels, _WHEELS, strict=True):
            turn = rr.Transform3D.columns(quaternion=_turn_about_y(poses[:, column]))
            self.stream.send_columns(self._spin(wheel), index, turn)
        moved = rows[counts > 0]
        position_m = position_m.copy()
        position_m[:, 2] = TRAIL_HEIGHT_M
        trail = rr.LineStrips3D.columns(
            strips=base.line_strips(position_m, counts[counts > 0]), colors=base.outcome_colours(moved)
        )
        self.stream.send_columns(_TRAIL, base.at(moved, "end_s"), trail)

    def remember(self, snapshot: Snapshot, decision: int, *, last: bool = False) -> None:
        """Tint the tiles by how good the brain finds the cells, densely while most is learnt."""
        if self._tinted and snapshot.values is not None and (last or is_pictured(decision)):
            worth = np.clip(snapshot.values / max(float(snapshot.values.max()), 1e-9), 0.0, 1.0).reshape(-1, 1)
            plain, share = _tile_colours(self.run.grid), _WORTH_SHARE * worth
            tinted = (1.0 - share) * plain + share * np.array(_WORTH_COLOUR)
            self.stream.log(_TILES, rr.Boxes3D.from_fields(colors=tinted.astype(np.uint8)))

    def move_target(self) -> None:
        """Move the targets' shapes to their new cells."""
        grid = self.run.grid
        for number, cells in enumerate(zip(self._first_targets, grid.targets, strict=True), 1):
            old, new = map(grid.centre_m, cells)
            path = names.TARGET if number == 1 else f"{names.TARGET}{number}"
            self.stream.log(path, rr.Transform3D(translation=(new[0] - old[0], new[1] - old[1], 0.0)))

    @property
    def _tinted(self) -> bool:
        return self.run.memory.values is not None

    def state(self) -> dict[str, Any]:
        """Return whether the pose of the start is known."""
        return {"stands": self._stands}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a `state`."""
        self._stands = state["stands"]

    def _spin(self, wheel: int) -> str:
        return f"{self._paths[wheel]}/{names.SPIN}"


def _turn_about_y(angle_rad: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the quaternions x y z w of turns about +y, the wheels' axle."""
    quaternion = np.zeros((len(angle_rad), 4), np.float32)
    quaternion[:, 1] = np.sin(angle_rad / 2)
    quaternion[:, 3] = np.cos(angle_rad / 2)
    return quaternion


def _xyzw(quaternion_wxyz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return quaternions (..., 4) in Rerun's order of the parts; MuJoCo puts w first."""
    return np.roll(quaternion_wxyz, -1, axis=-1)


def _wheels(model: Any, chassis: int) -> tuple[int, int]:
    """Return the hinged bodies furthest to the left (+y) and to the right."""
    hinged = [
        int(body) for body in model.jnt_bodyid[model.jnt_type == _HINGE_JOINT] if model.body_parentid[body] == chassis
    ]
    across = sorted(hinged, key=lambda body: float(model.body_pos[body, 1]))
    return across[-1], across[0]


def _body_paths(model: Any, chassis: int) -> dict[int, str]:
    """Return every body's entity path; a body's number is above its parent's."""
    paths = {0: names.WORLD}
    for body in range(1, model.nbody):
        name = model.body(body).name or f"body_{body}"
        paths[body] = names.ROBOT if body == chassis else f"{paths[int(model.body_parentid[body])]}/{name}"
    return paths


def _log_geoms(stream: rr.RecordingStream, model: Any, paths: dict[int, str]) -> None:
    """Log geoms of one body, one kind of name and one shape together: 25 tiles are one entity."""
    batches: defaultdict[tuple[str, int], list[int]] = defaultdict(list)
    for geom in range(model.ngeom):
        if model.geom_group[geom] < _FIRST_HIDDEN_GROUP and _rgba(model, geom)[3] > 0:
            kind = re.match(r"[a-z0-9]*", model.geom(geom).name.lower())
            label = kind[0] if kind and kind[0] else "geoms"
            batches[f"{paths[int(model.geom_bodyid[geom])]}/{label}", int(model.geom_type[geom])].append(geom)
    for (path, shape), geoms in batches.items():
        drawn = _shapes(model, shape, np.array(geoms))
        if drawn is not None:
            stream.log(f"{path}/{type(drawn).__name__.lower()}", drawn, static=True)


def _tile_colours(grid: Grid) -> NDArray[np.float64]:
    """Return a chequerboard's colours, (cells, 3)."""
    return np.array([_TILE_COLOURS[(cell.x + cell.y) % 2] for cell in grid.all_cells()], float)


def _log_tiles(stream: rr.RecordingStream, grid: Grid, *, coloured: bool) -> None:
    """Log thin boxes whose tops lie at z = 0; colours that change must never be static."""
    cells = grid.all_cells()
    half_m = grid.cell_size_m / 2
    tiles = rr.Boxes3D(
        half_sizes=[(half_m, half_m, _TILE_THICKNESS_M / 2)] * len(cells),
        centers=[(*grid.centre_m(cell), -_TILE_THICKNESS_M / 2) for cell in cells],
        colors=_tile_colours(grid).astype(np.uint8) if coloured else None,
        fill_mode="solid",
    )
    stream.log(_TILES, tiles, static=True)


def _log_numbers(stream: rr.RecordingStream, grid: Grid) -> None:
    """Log the columns' numbers behind the arena and the rows' at its left."""
    (columns, rows), beside_m = grid.cells, _NUMBERS_OUTSIDE * grid.cell_size_m
    if max(columns, rows) > _MOST_NUMBERS:
        return
    left_m, back_m = grid.centre_m(Cell(1, rows))
    behind = [(grid.centre_m(Cell(x, 1))[0], back_m + beside_m, 0.0) for x in range(1, columns + 1)]
    left = [(left_m - beside_m, grid.centre_m(Cell(1, y))[1], 0.0) for y in range(1, rows + 1)]
    numbers = rr.Points3D(
        behind + left,
        labels=[f"x = {x}" if x == 1 else str(x) for x in range(1, columns + 1)]
        + [f"y = {y}" if y == rows else str(y) for y in range(1, rows + 1)],
        colors=[base.LABEL_COLOUR],
        radii=[rr.Radius.ui_points(0.0)],
        show_labels=True,
    )
    stream.log(_NUMBERS, numbers, static=True)


def _rgba(model: Any, geom: int) -> NDArray[np.float64]:
    material = int(model.geom_matid[geom])
    own = np.asarray(model.geom_rgba[geom], float)
    return np.asarray(model.mat_rgba[material], float) if material >= 0 and np.allclose(own, _DEFAULT_RGBA) else own


def _shapes(model: Any, shape: int, geoms: NDArray[np.int64]) -> Any | None:
    """Return the archetype that draws these geoms of one shape, or None for one that is not drawn (plane, mesh)."""
    size, where, turn = model.geom_size[geoms], model.geom_pos[geoms], _xyzw(model.geom_quat[geoms])
    colours = np.array([np.round(255 * _rgba(model, geom)) for geom in geoms], np.uint8)
    look: dict[str, Any] = {"quaternions": turn, "colors": colours, "fill_mode": "solid"}
    if shape == _BOX:
        return rr.Boxes3D(half_sizes=size, centers=where, **look)
    if shape == _CYLINDER:
        return rr.Cylinders3D(radii=size[:, 0], lengths=2 * size[:, 1], centers=where, **look)
    if shape == _SPHERE:
        return rr.Ellipsoids3D(radii=size[:, 0], centers=where, **look)
    if shape == _ELLIPSOID:
        return rr.Ellipsoids3D(half_sizes=size, centers=where, **look)
    if shape == _CAPSULE:
        # Rerun's capsule starts at its origin and runs along +z; MuJoCo's is centred.
        start = where - size[:, 1:2] * _z_axis(model.geom_quat[geoms])
        return rr.Capsules3D(radii=size[:, 0], lengths=2 * size[:, 1], translations=start, **look)
    return None


def _z_axis(quaternion_wxyz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the third column of each rotation matrix."""
    w, x, y, z = np.moveaxis(quaternion_wxyz, -1, 0)
    return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=-1)
