"""All weights as one picture, and their distribution, at some ninety instants of 10,000 decisions."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from scla_mj.anatomy import Projection
from scla_mj.palette import BACKGROUND, projection_styles, rgb
from scla_mj.signals import Snapshot
from scla_mj.telemetry.views import base
from scla_mj.telemetry.views.learned import is_pictured

_PICTURE: Final = "brain/weight_picture"
_HISTOGRAM: Final = "brain/weight_histogram"
_LEAST_SIDE, _MOST_SIDE = 100, 120
"""Pixels of a projection's picture: smaller matrices are enlarged, to the width of a name; of larger ones neighbours
are averaged."""
_GAP: Final = 6
_CAPTION: Final = 26
_BINS: Final = 40
_AGREEING_COLOUR, _OPPOSITE_COLOUR = (224, 164, 58), (86, 138, 236)


class WeightPicture(base.View):
    """Every projection's weights next to each other, and how they are distributed."""

    def __init__(self, stream: rr.RecordingStream, run: base.RecordedRun) -> None:
        super().__init__(stream, run)
        has_weights = run.anatomy is not None and run.memory.weights is not None
        self._projections = sorted(run.projections if has_weights else (), key=lambda own: own.dashed)
        self._corners, self._shape = _layout(self._projections)
        self._groups: dict[str, list[Projection]] = {}
        for own in self._projections:
            group = ("opposite" if own.dashed else "agreeing") if _are_paired(self._projections) else "all"
            self._groups.setdefault(group, []).append(own)

    def panels(self) -> list[base.Panel]:
        """Return the picture and the histogram."""
        if not self._projections:
            return []
        height, width = self._shape
        paired = ", those that agree above" if "opposite" in self._groups else ""
        ranges = {own.weight_range for own in self._projections}
        span = next(iter(ranges)) if len(ranges) == 1 else None
        shades = f", {span[0]:g} mV dark, {span[1]:g} mV bright" if span else ""
        count = sum(math.prod(own.shape) for own in self._projections)
        picture = rrb.Spatial2DView(
            origin=f"/{_PICTURE}",
            name=f"All {count:,} weights{shades}{paired}; a row per presynaptic neuron",
            visual_bounds=rrb.VisualBounds2D(x_range=[-_GAP, width + _GAP], y_range=[-_GAP, height + _GAP]),
            background=list(BACKGROUND),
        )
        histogram = rrb.BarChartView(
            origin=f"/{_HISTOGRAM}",
            name="Weights, % per bin of mV",
            plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop, visible=len(self._groups) > 1),
        )
        return [
            base.Panel(base.Place.LEARNING_MIDDLE, picture, rank=1, share=2),
            base.Panel(base.Place.LEARNING_MIDDLE, histogram, rank=2),
        ]

    def log_static(self) -> None:
        """Log the picture's format, and each projection's name and frame."""
        if not self._projections:
            return
        height, width = self._shape
        form = rr.components.ImageFormat(width=width, height=height, channel_datatype="U8", color_model="L")
        look = rr.DepthImage.from_fields(format=form, colormap="inferno", depth_range=[0, 255])
        self.stream.log(f"{_PICTURE}/weights", look, static=True)
        styles = projection_styles(self._projections)
        sizes = [_size(own) for own in self._projections]
        frames = rr.Boxes2D(
            mins=[(left - 1, top - 1) for top, left in self._corners],
            sizes=[(columns + 2, rows + 2) for rows, columns in sizes],
            colors=[rgb(styles[own.name][0]) for own in self._projections],
            radii=[rr.Radius.ui_points(0.75)],
        )
        self.stream.log(f"{_PICTURE}/frames", frames, static=True)
        differ = len({own.source for own in self._projections}) > 1
        captions = rr.Points2D(
            [
                (left + columns / 2, top - _CAPTION - 2)
                for (top, left), (_, columns) in zip(self._corners, sizes, strict=True)
            ],
            labels=[f"{own.source * differ} → {own.target}".strip() for own in self._projections],
            colors=[base.LABEL_COLOUR],
            radii=[rr.Radius.ui_points(0.0)],
            show_labels=True,
        )
        self.stream.log(f"{_PICTURE}/names", captions, static=True)

    def remember(self, snapshot: Snapshot, decision: int, *, last: bool = False) -> None:
        """Log picture and histogram, densely while most is learnt."""
        if not self._projections or snapshot.weights is None or self.run.anatomy is None:
            return
        if not (last or is_pictured(decision)):
            return
        weights = self.run.anatomy.by_projection(snapshot.weights)
        low, high = _range(self._projections, weights)
        picture = np.zeros(self._shape, np.uint8)
        for own, (top, left) in zip(self._projections, self._corners, strict=True):
            tile = np.clip((_tile(own, weights[own.name]) - low) * np.float32(255 / (high - low)), 0, 255)
            picture[top : top + len(tile), left : left + tile.shape[1]] = tile
        self.stream.log(f"{_PICTURE}/weights", rr.DepthImage.from_fields(buffer=picture.tobytes()))
        edges = np.linspace(low, high, _BINS + 1)
        middles, widths = (edges[:-1] + edges[1:]) / 2, np.diff(edges)
        for name, group in self._groups.items():
            counts = np.sum([np.histogram(weights[own.name], edges)[0] for own in group], axis=0)
            colour = _OPPOSITE_COLOUR if name == "opposite" else _AGREEING_COLOUR
            bars = rr.BarChart(100.0 * counts / counts.sum(), abscissa=middles, widths=widths, color=colour)
            self.stream.log(f"{_HISTOGRAM}/{name}", bars)


def _are_paired(projections: list[Projection]) -> bool:
    """Return whether some are dashed, as the paper's opposite ones are, and others not."""
    return len({own.dashed for own in projections}) == 2


def _range(projections: list[Projection], weights: dict[str, NDArray[Any]]) -> tuple[float, float]:
    """Return what the picture spans: the declared ranges, or that of the weights."""
    spans = [own.weight_range or (min(0.0, float(w.min())), float(w.max()))
             for own in projections for w in [weights[own.name]]]  # fmt: skip
    low, high = min(low for low, _ in spans), max(high for _, high in spans)
    return low, max(high, low + 1e-9)


def _matrix_shape(projection: Projection) -> tuple[int, int]:
    """Return rows and columns: those of a matrix, of blocks below each other, of a list about a square."""
    shape = projection.shape
    if len(shape) > 1:
        return math.prod(shape[:-1]), shape[-1]
    columns = math.isqrt(shape[0] - 1) + 1
    return -(-shape[0] // columns), columns


def _side(neurons: int) -> int:
    """Return a side's pixels."""
    return min(_MOST_SIDE, neurons * -(-_LEAST_SIDE // neurons))


def _size(projection: Projection) -> tuple[int, int]:
    rows, columns = _matrix_shape(projection)
    return _side(rows), _side(columns)


def _tile(projection: Projection, weights: NDArray[Any]) -> NDArray[np.float32]:
    """Return a projection's weights as so many pixels."""
    rows, columns = _matrix_shape(projection)
    flat = np.full(rows * columns, weights.min(), np.float32)
    flat[: weights.size] = weights.reshape(-1)
    tile = flat.reshape(rows, columns)
    for axis, side in enumerate(_size(projection)):
        length = tile.shape[axis]
        if side >= length:
            tile = np.repeat(tile, side // length, axis=axis)
        else:
            starts = np.arange(side) * length // side
            counts = np.diff(np.append(starts, length)).reshape((-1, 1) if axis == 0 else (1, -1))
            tile = (np.add.reduceat(tile, starts, axis=axis) / counts).astype(np.float32)
    return tile


def _layout(projections: list[Projection]) -> tuple[list[tuple[int, int]], tuple[int, int]]:
    """Return each picture's top left corner in rows of equal length, and the whole's height and width."""
    in_row = max(1, math.ceil(math.sqrt(2 * len(projections)))) if projections else 1
    corners: list[tuple[int, int]] = []
    top = width = 0
    for first in range(0, len(projections), in_row):
        sizes = [_size(own) for own in projections[first : first + in_row]]
        lefts = np.cumsum([0, *(columns + _GAP for _, columns in sizes)]).tolist()
        top += _CAPTION + _GAP
        corners += [(top, left) for left in lefts[:-1]]
        top += max(rows for rows, _ in sizes)
        width = max(width, lefts[-1] - _GAP)
    return corners, (max(top, 1), max(width, 1))
