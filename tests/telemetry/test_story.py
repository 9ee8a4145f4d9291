"""What the dashboard tells of a decision, and that it tells nothing before it happened."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import rerun as rr
from synthetic_run import open_recorder, record_run, records, snapshot

from scla_mj.anatomy import PAPER_ANATOMY, Anatomy, stacked
from scla_mj.checked import check
from scla_mj.config import GridConfig, RunConfig, TaskConfig
from scla_mj.grid import Action
from scla_mj.signals import Outcome, Snapshot
from scla_mj.telemetry import names
from scla_mj.telemetry.reading.chunks import open_recording
from scla_mj.telemetry.views.base import RecordedRun
from scla_mj.telemetry.views.hits import Hits
from scla_mj.telemetry.views.learned import is_pictured
from scla_mj.telemetry.views.text import _about
from scla_mj.telemetry.views.votes import _motors

WINDOW_S = 0.05


@pytest.fixture(scope="module")
def run():
    return list(records(epochs=1, decisions=30, spikes=60, thinking_spikes=20))


@pytest.fixture(scope="module")
def path(run, tmp_path_factory):
    path = tmp_path_factory.mktemp("story") / "r.rrd"
    record_run(path, "light", run, memory=snapshot(np.random.default_rng(0)))
    return path


def rows(path: Path, entity: str, component: str) -> list[tuple[float, object]]:
    """Return the time and the content of every row that is not static."""
    found = []
    with open_recording(path, untrusted=False) as file:
        for chunk in file.chunks([f"/{entity}"]):
            if chunk.has(component) and chunk.has(names.SIM_TIME):
                found += zip(chunk.time_s.tolist(), chunk.rows.column(component).to_pylist(), strict=True)
    return sorted(found, key=lambda row: row[0])


def test_the_text_says_what_to_do_then_why_and_only_at_the_end_what_came_of_it(run, path):
    (start_s, (guide,)), *told = rows(path, "story/explanation", "TextDocument:text")
    assert start_s == 0.0 and "Press space to play" in guide
    assert len(told) == 2 * len(run)
    for record, (decided_s, (why,)), (end_s, (whole,)) in zip(run, told[::2], told[1::2], strict=True):
        assert decided_s == pytest.approx(record.time_s + WINDOW_S)
        assert end_s == pytest.approx(record.move.trajectory[-1, 0])
        x, y = record.percept.cell
        assert f"cell ({x}, {y})" in why and "on its way" in why and record.chosen.action.label in why
        ending = "hit" if record.hit else "bumped" if record.move.outcome is Outcome.BLOCKED else "moved to cell"
        assert ending in whole and ending not in why


@pytest.mark.parametrize(
    ("entity", "component", "time"),
    [
        ("world/trajectory", "LineStrips3D:strips", "end"),
        ("story/lanes/ends", "Points2D:positions", "end"),
        ("brain/spikes/windows", "Boxes2D:centers", "end"),
        ("story/lanes/moves", "Arrows2D:vectors", "decided"),
        ("world/votes", "Arrows3D:vectors", "decided"),
        ("world/beam", "LineStrips3D:strips", "start"),
    ],
)
def test_nothing_is_drawn_before_it_happened(run, path, entity, component, time):
    happened = {
        "start": [record.time_s for record in run],
        "decided": [record.time_s + WINDOW_S for record in run],
        "end": [record.move.trajectory[-1, 0] for record in run],
    }
    np.testing.assert_allclose([when_s for when_s, _ in rows(path, entity, component)], happened[time], atol=1e-9)


def test_arrows_point_where_the_robot_goes_and_beams_where_the_target_is(run, path):
    for record, (_, (vector,)) in zip(run, rows(path, "story/lanes/moves", "Arrows2D:vectors"), strict=True):
        dx, dy = record.chosen.action.step
        assert np.allclose(np.sign(vector), [dx, -dy])  # y points down there
    for record, (_, strips) in zip(run, rows(path, "world/beam", "LineStrips3D:strips"), strict=True):
        assert len(strips) == (record.percept.sensed is not None)
        if strips:
            assert np.allclose(np.array(strips[0][1][:2]), 0.0, atol=1e-6)  # the target is in the arena's centre


def test_votes_are_known_by_the_motor_populations_names_or_not_shown():
    def motors(*labels):
        return _motors(Anatomy(stacked(("retina", 9, "sensory"), *((label, 5, "motor") for label in labels))))

    assert motors("MD", "MU", "ML", "MR") == [1, 0, 2, 3]
    assert motors("actor_up", "actor_down", "actor_left", "actor_right") == list(Action)
    assert motors("one", "two", "three", "four") == [] == motors("MU", "MD") == _motors(None)


def test_weights_are_pictured_densely_while_they_are_learnt():
    pictured = [decision for decision in range(1, 10_001) if is_pictured(decision)]
    assert pictured[:11] == [*range(1, 11), 20] and len(pictured) == 81
    assert max(np.diff(pictured)) == 250


def test_a_brain_has_views_only_of_what_it_has(tmp_path, run):
    with open_recorder(tmp_path / "r.rrd") as recorder:
        kinds = {type(view).__name__: len(view.panels()) for view in recorder._views}
    assert kinds["WeightPicture"] == kinds["Potentials"] == 0 and kinds["Maps"] == 1  # its memory is not known
    assert kinds["Raster"] == 2


def test_the_page_about_a_recording_names_the_run_and_speaks_of_nothing_that_its_brain_lacks():
    parts = ("Spikes", "votes", "Arrows on the floor", "Weights", "Dopamine", "policy", "Greener")
    paper = RecordedRun(check(RunConfig(seed=3)), None, PAPER_ANATOMY, snapshot(np.random.default_rng(0)))
    page = _about(paper)
    assert "`scla`, seed 3, 10 x 1000 decisions" in page
    assert [part for part in parts if part not in page] == ["Greener"]
    bare = _about(RecordedRun(check(RunConfig(brain="q-learning")), None, None, Snapshot()))
    assert "`q-learning`" in bare and not [part for part in parts if part in bare]


def test_the_learning_curve_has_room_for_the_best_ceiling_where_the_target_jumps():
    jumps = check(RunConfig(grid=GridConfig(target=(1, 1)), task=TaskConfig(jump_epoch=2, jump_target=(3, 3))))
    first, second = (jumps.ceiling_hits_per_1000(epoch) for epoch in (1, 2))
    view = Hits(rr.RecordingStream("test"), RecordedRun(jumps, None, None, Snapshot()))
    ((_, top),) = view.panels()[0].content.properties["ScalarAxis"].range.as_arrow_array().to_pylist()
    assert top > second > first
