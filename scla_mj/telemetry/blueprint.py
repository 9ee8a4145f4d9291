"""The dashboard that a recording opens as: arena and raster on the left, learning, weights and rates on the right."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import rerun as rr
import rerun.blueprint as rrb

from scla_mj.anatomy import INHIBITORY, MOTOR, NEURON_COUNT, PROJECTION_NAMES, SENSORY, Population
from scla_mj.clock import Clock
from scla_mj.config import Telemetry
from scla_mj.grid import Grid
from scla_mj.telemetry import names
from scla_mj.telemetry.palette import BACKGROUND

_WINDOWS_SHOWN: Final = 13
_FULL_SHOWN_MS: Final = 1300.0
"""A full recording's raster shows a whole decision, a light one's the last thinking windows."""
_RASTER_ASPECT: Final = 0.46
"""Height of the raster by its width, as its place in the dashboard wants it."""
_LABELS_SHARE: Final = 0.07
"""Room for the populations' names right of now, by the raster's width."""
_TRAIL_S: Final = 12.0
_DECISION_S: Final = 0.7
"""About how long a decision takes: turns a range of seconds into one of decisions, for the other timeline."""
_SCROLL_S: Final = 60.0

_cursor = rrb.TimeRangeBoundary.cursor_relative
_WHOLE_RUN: Final = rrb.TimeAxis(
    view_range=rr.TimeRange(start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.infinite())
)


class RasterLayout(NamedTuple):
    """Time in view in ms, the scale that makes 1000 neurons fit, and where their populations' names stand, in ms."""

    width_ms: float
    height_scale: float
    labels_ms: float


def raster_layout(mode: Telemetry, clock: Clock) -> RasterLayout:
    """Return the raster's measures: the last thinking windows side by side, or the last stretch of simulated time."""
    width_ms = _WINDOWS_SHOWN * clock.thinking_window_s * 1000 if mode == "light" else _FULL_SHOWN_MS
    return RasterLayout(width_ms, _RASTER_ASPECT * width_ms / NEURON_COUNT, _LABELS_SHARE / 2 * width_ms)


def build_blueprint(
    mode: Telemetry, grid: Grid, clock: Clock, ceiling_hits_per_1000: float, weight_max: float
) -> rrb.Blueprint:
    """Return the whole dashboard."""
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(_arena(grid), _raster(mode, clock), row_shares=[3, 2]),
            rrb.Vertical(
                rrb.Horizontal(_learning(ceiling_hits_per_1000), _weights(weight_max), column_shares=[1, 1]),
                rrb.Horizontal(_rates(MOTOR, "Motor rates"), _dopamine(), column_shares=[1, 1]),
                rrb.Tabs(_matrices(), _other_rates(), _log(), _about(), active_tab=0),
                row_shares=[4, 3, 4],
            ),
            column_shares=[1, 1],
        ),
        rrb.TimePanel(state="collapsed", timeline=names.SIM_TIME, play_state="playing"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        auto_views=False,
        auto_layout=False,
    )


def _last(seconds: float) -> list[rrb.VisibleTimeRange]:
    """The stretch before the cursor, on either timeline: without the second, switching to it costs seconds a frame."""
    decisions = max(1, round(seconds / _DECISION_S))
    return [
        rrb.VisibleTimeRange(names.SIM_TIME, start=_cursor(seconds=-seconds), end=_cursor()),
        rrb.VisibleTimeRange(names.DECISION, start=_cursor(seq=-decisions), end=_cursor()),
    ]


def _arena(grid: Grid) -> rrb.Spatial3DView:
    reach_m = max(grid.cells) * grid.cell_size_m
    return rrb.Spatial3DView(
        origin=f"/{names.WORLD}",
        name="Arena: robot, trail and each cell's action probabilities",
        line_grid=False,
        overrides={f"/{names.TRAJECTORY}": rrb.VisibleTimeRanges(_last(_TRAIL_S))},
        eye_controls=rrb.EyeControls3D(
            position=(0.0, -0.72 * reach_m, 0.80 * reach_m), look_target=(0.0, -0.05 * reach_m, 0.0), eye_up=(0, 0, 1)
        ),
        background=list(BACKGROUND),
    )


def _raster(mode: Telemetry, clock: Clock) -> rrb.Spatial2DView:
    layout = raster_layout(mode, clock)
    height = layout.height_scale * NEURON_COUNT
    bounds = rrb.VisualBounds2D(
        x_range=[-layout.width_ms, 2 * layout.labels_ms], y_range=[-0.02 * height, 1.02 * height]
    )
    seconds = _WINDOWS_SHOWN * 2.0 if mode == "light" else 3.0
    what = f"last {_WINDOWS_SHOWN} thinking windows" if mode == "light" else f"last {layout.width_ms:g} ms"
    return rrb.Spatial2DView(
        origin="/",
        contents=[f"/{names.SPIKES}/**", f"/{names.RASTER_LABELS}", f"/{names.RASTER_MARGIN}"],
        name=f"Spikes of 1000 neurons, {what}",
        visual_bounds=bounds,
        time_ranges=_last(seconds),
        background=list(BACKGROUND),
    )


def _series(contents: list[str], name: str, **more: Any) -> rrb.TimeSeriesView:
    legend = rrb.PlotLegend(corner=more.pop("corner", rrb.Corner2D.LeftTop), visible=more.pop("legend", True))
    return rrb.TimeSeriesView(origin="/", contents=contents, name=name, plot_legend=legend, **more)


def _scrolling(contents: list[str], name: str, **more: Any) -> rrb.TimeSeriesView:
    window = rrb.TimeAxis(view_range=rr.TimeRange(start=_cursor(seconds=-_SCROLL_S), end=_cursor()))
    return _series(contents, name, axis_x=window, time_ranges=_last(_SCROLL_S), **more)


def _learning(ceiling_hits_per_1000: float) -> rrb.TimeSeriesView:
    return _series(
        [f"/{names.LEARNING}/**"],
        "Hits per 1000 decisions",
        axis_x=_WHOLE_RUN,
        axis_y=rrb.ScalarAxis(range=(0.0, 1.2 * ceiling_hits_per_1000)),
        corner=rrb.Corner2D.RightBottom,
    )


def _weights(weight_max: float) -> rrb.TimeSeriesView:
    return _series(
        [f"/{names.WEIGHTS}/**"],
        "Mean weights: agreeing warm, opposite cool",
        axis_x=_WHOLE_RUN,
        axis_y=rrb.ScalarAxis(range=(0.0, 1.05 * weight_max)),
        corner=rrb.Corner2D.RightTop,
    )


def _rates(populations: tuple[Population, ...], name: str) -> rrb.TimeSeriesView:
    return _scrolling([f"/{names.RATES}/{population.name}" for population in populations], f"{name} while thinking, Hz")


def _other_rates() -> rrb.Horizontal:
    views = [_rates(SENSORY, "Sensory rates"), _rates(INHIBITORY, "Inhibitory rates")]
    whole = _scrolling(
        [f"/{names.RATES_WHOLE}/{population.name}" for population in MOTOR], "Motor rates, whole decision, Hz"
    )
    return rrb.Horizontal(*views, whole, name="More rates")


def _dopamine() -> rrb.TimeSeriesView:
    return _scrolling([f"/{names.DOPAMINE}/**"], "Dopamine at each decision's end", legend=False)


def _matrices() -> rrb.Grid:
    mapping = rrb.TensorScalarMapping(colormap="inferno", mag_filter="nearest")
    views = [
        rrb.TensorView(origin=f"/{names.WEIGHT_MATRIX}/{name}", name=name, view_fit="fill", scalar_mapping=mapping)
        for name in PROJECTION_NAMES
    ]
    return rrb.Grid(*views, grid_columns=4, name="Weight matrices, last epoch's end")


def _about() -> rrb.TextDocumentView:
    return rrb.TextDocumentView(origin=f"/{names.ABOUT}", name="About")


def _log() -> rrb.TextLogView:
    return rrb.TextLogView(origin=f"/{names.LOG}", name="Log")
