"""How each series looks, logged once: colours, names, line widths, the raster's labels."""

from __future__ import annotations

from typing import Final

import numpy as np
import rerun as rr

from scla_mj.anatomy import INHIBITORY, MOTOR, NEURON_COUNT, POPULATIONS, PROJECTIONS, SENSORY, Population
from scla_mj.grid import StartProtocol
from scla_mj.telemetry import names
from scla_mj.telemetry.blueprint import RasterLayout
from scla_mj.telemetry.palette import (
    BACKGROUND,
    CEILING_COLOR,
    EPOCH_COLOR,
    LABEL_COLOR,
    LEARNING_COLOR,
    POPULATION_COLORS,
    PROJECTION_COLORS,
    RGB,
)

_LABEL_RISE: Final = 35.0
"""Rerun draws a label below its point: by about this many neurons."""
_MARGIN: Final = 3000.0
"""Far beyond any view's edge."""


def log_styles(stream: rr.RecordingStream, protocol: StartProtocol, layout: RasterLayout) -> None:
    """Log every static style."""
    for population in POPULATIONS:
        color = POPULATION_COLORS[population.name]
        _line(stream, f"{names.RATES}/{population.name}", color, population.name, 1.2)
        _line(stream, f"{names.RATES_WHOLE}/{population.name}", color, population.name, 1.2)
        look = rr.Points2D.from_fields(colors=[color], radii=[rr.Radius.ui_points(1.3)])
        stream.log(f"{names.SPIKES}/{population.name}", look, static=True)
    for projection in PROJECTIONS:
        color = PROJECTION_COLORS[projection.name]
        _line(stream, f"{names.WEIGHTS}/{projection.name}", color, projection.name, 2.0)
        _line(stream, f"{names.DOPAMINE}/{projection.name}", color, projection.name, 1.2)
    _line(stream, names.ROLLING_HITS, LEARNING_COLOR, "last 100 decisions", 1.0)
    _line(stream, names.EPOCH_HITS, EPOCH_COLOR, "epoch", 2.5)
    dots = rr.SeriesPoints(colors=[EPOCH_COLOR], names=["epoch"], markers="circle", marker_sizes=[5.0])
    stream.log(names.EPOCH_HITS, dots, static=True)
    _line(stream, names.CEILING, CEILING_COLOR, f"ceiling of {protocol}", 1.5)
    stream.log(names.TRAJECTORY, rr.LineStrips3D.from_fields(radii=[0.004]), static=True)
    _raster(stream, layout)


def _line(stream: rr.RecordingStream, entity: str, color: RGB, name: str, width: float) -> None:
    stream.log(entity, rr.SeriesLines(colors=[color], names=[name], widths=[width]), static=True)


def _raster(stream: rr.RecordingStream, layout: RasterLayout) -> None:
    stream.log(names.BRAIN, rr.Transform3D(scale=[1.0, layout.height_scale, 1.0]), static=True)
    stream.log(names.WINDOWS, rr.Boxes2D.from_fields(radii=[rr.Radius.ui_points(0.5)]), static=True)
    # What the robot has not lived through yet lies right of x = 0; a full recording knows it at a decision's start.
    margin = np.full((1, 1, 3), BACKGROUND, np.uint8)
    stream.log(names.RASTER_MARGIN, rr.Image(margin, draw_order=50.0), static=True)
    cover = rr.Transform3D(translation=[0.0, -_MARGIN, 0.0], scale=[_MARGIN, NEURON_COUNT + 2 * _MARGIN, 1.0])
    stream.log(names.RASTER_MARGIN, cover, static=True)
    labelled = [*SENSORY, *MOTOR, Population("I", INHIBITORY[0].start, INHIBITORY[-1].stop)]
    middles = [(layout.labels_ms, (group.start + group.stop) / 2 - _LABEL_RISE) for group in labelled]
    labels = rr.Points2D(
        middles,
        labels=[group.name for group in labelled],
        colors=[LABEL_COLOR],
        radii=[rr.Radius.ui_points(0.0)],
        show_labels=True,
    )
    stream.log(names.RASTER_LABELS, labels, static=True)
