"""The dashboard as Rerun's viewer draws it, without a screen: every view, on both timelines, dark and light."""

from __future__ import annotations

import io
import time

import numpy as np
import pytest
import rerun.blueprint as rrb
from matplotlib import image

from scla_mj import RunConfig, simulate
from scla_mj.errors import SclaError
from scla_mj.telemetry import names, recording
from scla_mj.telemetry.recording import RerunRecorder

DECISIONS = 60
MENU_PX, TITLE_PX = 36, 28
WINDOW, COLUMNS = (1800, 1000), 5


def every_panel(panels):
    """The panels next to each other instead of in tabs."""
    panel_time = rrb.TimePanel(state="hidden", timeline=names.SIM_TIME, play_state="paused")
    sides = rrb.SelectionPanel(state="hidden"), rrb.BlueprintPanel(state="hidden")
    contents = [panel.content for panel in panels]
    views = [view for own in contents for view in (own.contents if isinstance(own, rrb.Tabs) else [own])]
    grid = rrb.Grid(*views, grid_columns=COLUMNS)
    return rrb.Blueprint(grid, panel_time, *sides, auto_views=False, auto_layout=False)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A recording of some decisions, and its length in seconds."""
    path = tmp_path_factory.mktemp("dashboard") / "recording.rrd"
    simulation = simulate(RunConfig(epochs=2, decisions=DECISIONS // 2))
    brain, model = simulation.brain, simulation.world.drawable_model()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recording, "build_dashboard", every_panel)
        recorder = RerunRecorder(
            path, simulation.config, anatomy=brain.anatomy, model=model, run_id="test", memory=brain.snapshot()
        )
    for _ in range(DECISIONS):
        record = simulation.step()
        recorder.write(record, brain.snapshot() if recorder.wants_memory(record) else None)
        if record.decision == DECISIONS // 2:
            recorder.end_epoch(hits=5, decisions=DECISIONS // 2)
    recorder.close(brain.snapshot())
    return path, simulation.time_s


def cells(picture, count):
    """The views of a grid, row by row, without the viewer's menu bar and their own title bars."""
    pixels = image.imread(io.BytesIO(picture), format="png")[..., :3]
    rows = -(-count // COLUMNS)
    height, width = (pixels.shape[0] - MENU_PX) / rows, pixels.shape[1] / COLUMNS
    for number in range(count):
        top, left = MENU_PX + number // COLUMNS * height, number % COLUMNS * width
        yield pixels[round(top + TITLE_PX) : round(top + height) - 2, round(left) + 2 : round(left + width) - 2]


def is_empty(pixels):
    """Whether a view shows neither data, which are coloured, nor a text, which stands out from what is behind it."""
    shades = pixels.max(axis=2)
    coloured, text = np.ptp(pixels, axis=2) > 0.15, np.abs(shades - np.median(shades)) > 0.5
    return np.count_nonzero(coloured) < 8 and np.count_nonzero(text) < 500


def menu(picture):
    """How bright the viewer's own menu bar is, 0 to 1."""
    return np.median(image.imread(io.BytesIO(picture), format="png")[:MENU_PX, ..., :3])


@pytest.mark.parametrize(("theme", "brightness"), [("dark", 0.0), ("light", 1.0)])
def test_no_view_reports_anything_and_none_is_empty(recorded, screenshot, theme, brightness):
    path, end_s = recorded
    moments = [(names.SIM_TIME, {"duration": share * end_s}) for share in (0.05, 0.5, 1.0)]
    moments += [(names.DECISION, {"sequence": number}) for number in (2, DECISIONS // 2, DECISIONS)]
    try:
        with screenshot.open_viewer(path, WINDOW, theme) as viewer:
            for timeline, moment in moments:
                viewer.set_time(timeline, **moment, play_state="paused")
                state = viewer.get_state()
                deadline, empty = time.monotonic() + 60, [0]
                while empty and time.monotonic() < deadline:  # they load as they are shown
                    picture = viewer.take_screenshot(max_size=WINDOW[0])
                    empty = [n for n, view in enumerate(cells(picture, len(state.views))) if is_empty(view)]
                assert not empty, f"at {moment} the views {empty} are empty"
                assert not [report for view in viewer.get_state().views for report in view.reports]
            assert len(state.views) >= 18
            assert menu(picture) == pytest.approx(brightness, abs=0.1)
    except SclaError as error:
        if not any(missing in str(error) for missing in ("did not start", "Xvfb is not installed")):
            raise
        pytest.skip(str(error))
