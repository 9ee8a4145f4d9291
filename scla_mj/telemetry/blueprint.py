"""The dashboard that a recording opens as: arena and raster on the left, learning, weights and rates on the right."""

from __future__ import annotations

from typing import Any, Final

import rerun as rr
import rerun.blueprint as rrb

from scla_mj.anatomy import INHIBITORY, MOTOR, NEURON_COUNT, PROJECTION_NAMES, SENSORY, Population
from scla_mj.clock import Clock
from scla_mj.config import Telemetry
from scla_mj.grid import Grid
from scla_mj.telemetry import names

RASTER_HEIGHT_SCALE: Final = 0.3
"""The raster is drawn flatter than one unit a neuron, so that its width is some ten thinking windows."""

_WINDOWS_SHOWN: Final = 12
_FULL_SHOWN_MS: Final = 600.0
_TRAIL_S: Final = 12.0
_DECISION_S: Final = 0.7
"""About how long a decision takes: turns a range of seconds into one of decisions, for the other timeline."""
_SCROLL_S: Final = 60.0

_cursor = rrb.TimeRangeBoundary.cursor_relative
_WHOLE_RUN: Final = rrb.TimeAxis(
    view_range=rr.TimeRange(start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.infinite())
)


def raster_width_ms(mode: Telemetry, clock: Clock) -> float:
    """Return how much of the raster is in view: the last thinking windows, or the last stretch of simulated time."""
    return _WINDOWS_SHOWN * clock.thinking_window_s * 1000 if mode == "light" else _FULL_SHOWN_MS


def build_blueprint(mode: Telemetry, grid: Grid, clock: Clock) -> rrb.Blueprint:
    """Return the whole dashboard."""
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(_arena(grid), _raster(mode, clock), row_shares=[3, 2]),
            rrb.Vertical(
                rrb.Horizontal(_learning(), _weights(), column_shares=[1, 1]),
                rrb.Horizontal(_rates(MOTOR, "Motor rates"), _dopamine(), column_shares=[1, 1]),
                rrb.Tabs(_matrices(), _other_rates(), _log(), active_tab=0),
                row_shares=[4, 3, 4],
            ),
            column_shares=[1, 1],
        ),
        rrb.TimePanel(state="collapsed", timeline=names.SIM_TIME, play_state="paused"),
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
            position=(0.0, -0.95 * reach_m, 1.05 * reach_m), look_target=(0.0, -0.03 * reach_m, 0.0), eye_up=(0, 0, 1)
        ),
        background=[16, 18, 24],
    )


def _raster(mode: Telemetry, clock: Clock) -> rrb.Spatial2DView:
    width_ms = raster_width_ms(mode, clock)
    height = RASTER_HEIGHT_SCALE * NEURON_COUNT
    seconds = _WINDOWS_SHOWN * 2.0 if mode == "light" else 3.0
    what = f"last {_WINDOWS_SHOWN} thinking windows" if mode == "light" else f"last {width_ms:g} ms"
    return rrb.Spatial2DView(
        origin="/",
        contents=[f"/{names.SPIKES}/**", f"/{names.RASTER_LABELS}"],
        name=f"Spikes of 1000 neurons, {what}",
        visual_bounds=rrb.VisualBounds2D(
            x_range=[-1.05 * width_ms, 0.01 * width_ms], y_range=[-0.02 * height, 1.02 * height]
        ),
        time_ranges=_last(seconds),
        background=[16, 18, 24],
    )


def _series(contents: list[str], name: str, **more: Any) -> rrb.TimeSeriesView:
    legend = rrb.PlotLegend(corner=more.pop("corner", rrb.Corner2D.LeftTop), visible=more.pop("legend", True))
    return rrb.TimeSeriesView(origin="/", contents=contents, name=name, plot_legend=legend, **more)


def _scrolling(contents: list[str], name: str, **more: Any) -> rrb.TimeSeriesView:
    window = rrb.TimeAxis(view_range=rr.TimeRange(start=_cursor(seconds=-_SCROLL_S), end=_cursor()))
    return _series(contents, name, axis_x=window, time_ranges=_last(_SCROLL_S), **more)


def _learning() -> rrb.TimeSeriesView:
    return _series(
        [f"/{names.LEARNING}/**"], "Hits per 1000 decisions", axis_x=_WHOLE_RUN, corner=rrb.Corner2D.RightBottom
    )


def _weights() -> rrb.TimeSeriesView:
    return _series([f"/{names.WEIGHTS}/**"], "Mean weights: agreeing warm, opposite cool", axis_x=_WHOLE_RUN)


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
    return rrb.Grid(*views, grid_columns=4, name="Weight matrices")


def _log() -> rrb.TextLogView:
    return rrb.TextLogView(origin=f"/{names.LOG}", name="Log")
