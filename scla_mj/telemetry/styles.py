"""How each series looks, logged once: colours, names, line widths, the raster's labels."""

from __future__ import annotations

import numpy as np
import rerun as rr

from scla_mj.anatomy import POPULATIONS, PROJECTIONS
from scla_mj.grid import StartProtocol
from scla_mj.telemetry import names
from scla_mj.telemetry.blueprint import RASTER_HEIGHT_SCALE
from scla_mj.telemetry.palette import (
    CEILING_COLOR,
    EPOCH_COLOR,
    LABEL_COLOR,
    LEARNING_COLOR,
    POPULATION_COLORS,
    PROJECTION_COLORS,
    RGB,
)


def log_styles(stream: rr.RecordingStream, protocol: StartProtocol, label_x_ms: float) -> None:
    """Log every static style; `label_x_ms` is where the raster's labels stand, left of now."""
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
    _line(stream, names.EPOCH_HITS, EPOCH_COLOR, "epoch", 3.0)
    _line(stream, names.CEILING, CEILING_COLOR, f"ceiling of {protocol}", 1.5)
    stream.log(names.TRAJECTORY, rr.LineStrips3D.from_fields(radii=[0.004]), static=True)
    _raster(stream, label_x_ms)


def _line(stream: rr.RecordingStream, entity: str, color: RGB, name: str, width: float) -> None:
    stream.log(entity, rr.SeriesLines(colors=[color], names=[name], widths=[width]), static=True)


def _raster(stream: rr.RecordingStream, label_x_ms: float) -> None:
    stream.log(names.BRAIN, rr.Transform3D(scale=[1.0, RASTER_HEIGHT_SCALE, 1.0]), static=True)
    stream.log(names.WINDOWS, rr.Boxes2D.from_fields(radii=[rr.Radius.ui_points(0.5)]), static=True)
    middles = np.array([[label_x_ms, (population.start + population.stop) / 2] for population in POPULATIONS])
    labels = rr.Points2D(
        middles,
        labels=[population.name for population in POPULATIONS],
        colors=[LABEL_COLOR],
        radii=[rr.Radius.ui_points(0.0)],
        show_labels=True,
    )
    stream.log(names.RASTER_LABELS, labels, static=True)
