"""The 3D scene: a compiled MuJoCo model's visible geoms, drawn once, and the entities whose poses move.

The model is handed in and read through its arrays alone. Bodies nest as they do in the model, so a wheel needs nothing
but its own spin angle. The floor's plane is drawn as the grid's tiles.
"""

from __future__ import annotations

import re
from collections import defaultdict
from typing import Any, Final, NamedTuple

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from scla_mj.grid import Grid
from scla_mj.telemetry import names
from scla_mj.telemetry.palette import TILE_COLORS

# mjtGeom and mjtJoint of MuJoCo's mjmodel.h.
_SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX = 2, 3, 4, 5, 6
_FREE_JOINT, _HINGE_JOINT = 0, 3

_FIRST_HIDDEN_GROUP: Final = 3
"""Groups 0 to 2 are seen, 3 and above are for collision only (MuJoCo's own viewer hides them too)."""
_DEFAULT_RGBA: Final = (0.5, 0.5, 0.5, 1.0)
"""MuJoCo's geom colour when none is set: its material's colour then counts."""
_TILE_THICKNESS_M: Final = 0.002


class RobotEntities(NamedTuple):
    """Entity paths whose poses change: the chassis, and what spins with the left and the right wheel."""

    chassis: str
    left_wheel: str
    right_wheel: str


def log_scene(stream: rr.RecordingStream, model: Any, grid: Grid) -> RobotEntities:
    """Log every visible geom as static shapes and every fixed body's pose, and name the bodies that move.

    Args:
        stream: where to log.
        model: a compiled `mujoco.MjModel` with one free body, the chassis, and a hinged wheel on either side of it.
        grid: the tiles to draw.
    """
    chassis = int(model.jnt_bodyid[np.flatnonzero(model.jnt_type == _FREE_JOINT)[0]])
    left, right = _wheels(model, chassis)
    paths = _body_paths(model, chassis)
    for body, path in paths.items():
        if body not in (0, chassis):
            mount = rr.Transform3D(translation=model.body_pos[body], quaternion=xyzw(model.body_quat[body]))
            stream.log(path, mount, static=True)
    for wheel in (left, right):
        paths[wheel] += "/spin"
    _log_geoms(stream, model, paths)
    _log_tiles(stream, grid)
    return RobotEntities(paths[chassis], paths[left], paths[right])


def xyzw(quaternion_wxyz: NDArray[np.float64]) -> NDArray[np.float64]:
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
            kind = re.match(r"[a-z]*", model.geom(geom).name.lower())
            label = kind[0] if kind and kind[0] else "geoms"
            batches[f"{paths[int(model.geom_bodyid[geom])]}/{label}", int(model.geom_type[geom])].append(geom)
    for (path, shape), geoms in batches.items():
        drawn = _shapes(model, shape, np.array(geoms))
        if drawn is not None:
            stream.log(f"{path}/{type(drawn).__name__.lower()}", drawn, static=True)


def _log_tiles(stream: rr.RecordingStream, grid: Grid) -> None:
    """Log the floor as a chequerboard of thin boxes whose tops lie at z = 0."""
    cells = grid.all_cells()
    centres = [(*grid.centre_m(cell), -_TILE_THICKNESS_M / 2) for cell in cells]
    half_m = grid.cell_size_m / 2
    colors = [TILE_COLORS[(cell.x + cell.y) % 2] for cell in cells]
    tiles = rr.Boxes3D(
        half_sizes=[(half_m, half_m, _TILE_THICKNESS_M / 2)] * len(cells),
        centers=centres,
        colors=colors,
        fill_mode="solid",
    )
    stream.log(f"{names.WORLD}/tiles", tiles, static=True)


def _rgba(model: Any, geom: int) -> NDArray[np.float64]:
    material = int(model.geom_matid[geom])
    own = np.asarray(model.geom_rgba[geom], float)
    return np.asarray(model.mat_rgba[material], float) if material >= 0 and np.allclose(own, _DEFAULT_RGBA) else own


def _shapes(model: Any, shape: int, geoms: NDArray[np.int64]) -> Any | None:
    """Return the archetype that draws these geoms of one shape, or None for one that is not drawn (plane, mesh)."""
    size, where, turn = model.geom_size[geoms], model.geom_pos[geoms], xyzw(model.geom_quat[geoms])
    colors = np.array([np.round(255 * _rgba(model, geom)) for geom in geoms], np.uint8)
    look: dict[str, Any] = {"quaternions": turn, "colors": colors, "fill_mode": "solid"}
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
