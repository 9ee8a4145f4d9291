"""Take a picture of the robot in its arena, off screen (needs OpenGL through EGL, OSMesa or a display)."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from matplotlib.image import imsave

from scla_mj.checked import check
from scla_mj.config import GridConfig, RunConfig
from scla_mj.errors import SclaError
from scla_mj.grid import Cell
from scla_mj.world import names
from scla_mj.world.picture import Renderer
from scla_mj.world.robot import robot_of
from scla_mj.world.world import World


@dataclass(frozen=True)
class ArenaPicture:
    """Take a picture of the robot in its arena."""

    output: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="PNG")]
    """Picture to write; refused if it exists."""
    cell: tuple[int, int] = (2, 2)
    """Where the robot stands."""
    heading_deg: float = 30.0
    """Where it looks, from +x towards +y."""
    size: tuple[int, int] = (1200, 800)
    """Width and height in pixels."""
    robot: str = "burger"
    """What stands there: burger, mouse or an MJCF file (docs/robot.md)."""
    grid: Annotated[GridConfig, tyro.conf.arg(name="")] = field(default_factory=GridConfig)


def take(options: ArenaPicture) -> None:
    """Render and write the picture.

    Raises:
        SclaError: the picture exists, or the grid or the cell is not possible.
    """
    if options.output.exists():
        raise SclaError(f"{options.output} exists already: choose another name")
    config = RunConfig(grid=options.grid, robot=options.robot)
    checked = check(config)
    world = World(checked.grid(), checked.clock, robot_of(checked))
    world.spawn(Cell(*options.cell), math.radians(options.heading_deg))
    picture = Renderer(world).render(names.ANGLED_CAMERA, *options.size)
    imsave(options.output, np.ascontiguousarray(picture))


if __name__ == "__main__":
    try:
        take(tyro.cli(ArenaPicture))
    except SclaError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
