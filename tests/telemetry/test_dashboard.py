"""The dashboard as Rerun's own viewer draws it, without a screen: every view at once, on both timelines.

Rerun's headless viewer has its dark theme only.
"""

from __future__ import annotations

import importlib.util
import io
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import rerun.blueprint as rrb
from matplotlib import image

from scla_mj import RunConfig, simulate
from scla_mj.errors import SclaError
from scla_mj.telemetry import names, recording
from scla_mj.telemetry.recording import RerunRecorder

DECISIONS = 60
WINDOW = (2400, 1500)
_SPEC = importlib.util.spec_from_file_location("screenshot", Path(__file__).parents[2] / "scripts" / "screenshot.py")


@pytest.fixture(scope="module")
def screenshot():
    module = importlib.util.module_from_spec(_SPEC)
    sys.modules["screenshot"] = module  # dataclasses look their module up
    _SPEC.loader.exec_module(module)
    yield module
    del sys.modules["screenshot"]


def every_panel(panels):
    """The panels next to each other instead of in tabs."""
    panel_time = rrb.TimePanel(state="hidden", timeline=names.SIM_TIME, play_state="paused")
    sides = rrb.SelectionPanel(state="hidden"), rrb.BlueprintPanel(state="hidden")
    grid = rrb.Grid(*(panel.content for panel in panels), grid_columns=5)
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


def is_empty(picture, view_class):
    """Whether a view shows nothing: its data are coloured, a text is as bright as the view's title is not alone."""
    pixels = image.imread(io.BytesIO(picture), format="png")[..., :3]
    if view_class.startswith("Text"):
        return np.count_nonzero(pixels.max(axis=2) > 0.5) < 500
    return np.count_nonzero(np.ptp(pixels, axis=2) > 0.2) < 8


def test_no_view_reports_anything_and_none_is_empty(recorded, screenshot):
    path, end_s = recorded
    moments = [(names.SIM_TIME, {"duration": share * end_s}) for share in (0.05, 0.5, 1.0)]
    moments += [(names.DECISION, {"sequence": number}) for number in (2, DECISIONS // 2, DECISIONS)]
    try:
        with screenshot._viewer(path, WINDOW) as viewer:
            t0 = time.time()
            for timeline, moment in moments:
                viewer.set_time(timeline, **moment, play_state="paused")
                views = viewer.get_state().views
                assert len(views) >= 18
                waiting = list(views)
                deadline = time.monotonic() + 60
                while waiting and time.monotonic() < deadline:  # they load as they are shown
                    shots = {view.view_id: viewer.take_screenshot(view_id=view.view_id) for view in waiting}
                    waiting = [view for view in waiting if is_empty(shots[view.view_id], view.view_class)]
                print(timeline, moment, time.time() - t0, [v.name for v in waiting])
                assert not waiting, f"at {moment} {waiting[0].name} is empty"
                assert not [report for view in viewer.get_state().views for report in view.reports]
    except SclaError as error:
        if "did not start" not in str(error):
            raise
        pytest.skip(str(error))
