from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import rerun as rr
from synthetic_run import open_recorder, record_run, records, snapshot

from scla_mj.anatomy import POPULATIONS, PROJECTION_NAMES
from scla_mj.config import RunConfig, TaskConfig
from scla_mj.errors import SclaError
from scla_mj.signals import Outcome, Snapshot
from scla_mj.telemetry.reading.chunks import open_recording


def read(path: Path, entity: str, component: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return an entity's values, and the simulated time and the decision of every row."""
    values, times, decisions = [], [], []
    with open_recording(path, untrusted=False) as file:
        for chunk in file.chunks([f"/{entity}"]):
            if chunk.has(component) and "sim_time" in chunk.rows.schema.names:
                values.append(chunk.values(component))
                times.append(chunk.time_s)
                decisions.append(chunk.decision)
    return np.concatenate(values), np.concatenate(times), np.concatenate(decisions)


def spikes_by_decision(path: Path, population: str) -> list[np.ndarray]:
    rows = []
    with open_recording(path, untrusted=False) as file:
        for chunk in file.chunks([f"/brain/spikes/{population}"]):
            if chunk.has("Points2D:positions"):
                cuts = np.cumsum(chunk.lengths("Points2D:positions"))[:-1]
                rows += np.split(chunk.values("Points2D:positions"), cuts)
    return rows


@pytest.mark.parametrize("mode", ["light", "full"])
def test_every_spike_is_read_back_as_it_was_written(tmp_path, mode):
    run = list(records(epochs=2, decisions=130, spikes=900, thinking_spikes=120))
    record_run(tmp_path / "r.rrd", mode, run)
    for population in (POPULATIONS[0], POPULATIONS[6], POPULATIONS[11]):
        rows = spikes_by_decision(tmp_path / "r.rrd", population.name)
        assert len(rows) == len(run)
        for number, (points, record) in enumerate(zip(rows, run, strict=True)):
            activity = record.activity
            kept = activity.thinking_spikes if mode == "light" else len(activity.spike_step)
            neuron, step = activity.spike_neuron[:kept], activity.spike_step[:kept]
            mine = (neuron >= population.start) & (neuron < population.stop)
            origin_ms = 50 * number if mode == "light" else round(1000 * record.time_s)
            assert np.array_equal(points, np.column_stack([origin_ms + step[mine], neuron[mine]]))


def test_light_drops_only_the_spikes_outside_the_thinking_windows(tmp_path):
    run = list(records(epochs=1, decisions=12, spikes=500))
    for mode in ("light", "full"):
        record_run(tmp_path / f"{mode}.rrd", mode, run, snapshot(np.random.default_rng(0)))
    entities: dict[str, dict[str, int]] = {}
    for mode in ("light", "full"):
        with open_recording(tmp_path / f"{mode}.rrd", untrusted=False) as file:
            entities[mode] = {}
            for chunk in file.chunks():
                size = sum(len(column.flatten()) for column in chunk.rows.columns if hasattr(column, "flatten"))
                entities[mode][chunk.entity] = entities[mode].get(chunk.entity, 0) + size
    assert entities["light"].keys() == entities["full"].keys()
    different = {entity for entity in entities["light"] if entities["light"][entity] != entities["full"][entity]}
    spiking = {f"brain/spikes/{population.name}" for population in POPULATIONS}
    assert spiking <= different <= spiking | {"brain/spikes"}  # the raster itself scrolls more often in full


def test_poses_are_kept_at_twenty_hertz_and_with_the_last_of_every_move(tmp_path):
    run = list(records(epochs=1, decisions=30, spikes=10, thinking_spikes=5))
    record_run(tmp_path / "r.rrd", "light", run)
    position, time_s, decision = read(tmp_path / "r.rrd", "world/robot", "Transform3D:translation")
    turn, _, _ = read(tmp_path / "r.rrd", "world/robot", "Transform3D:quaternion")
    wheels = [
        read(tmp_path / "r.rrd", f"world/robot/wheel_{side}/spin", "Transform3D:quaternion")[0]
        for side in ("left", "right")
    ]
    first = 0
    for number, record in enumerate(run, 1):
        rows = record.move.trajectory
        kept = rows[[*range(0, len(rows), 5)] + ([len(rows) - 1] if (len(rows) - 1) % 5 else [])]
        if number == 1:  # it stands there from the start
            kept = np.concatenate([kept[:1], kept])
            kept[0, 0] = record.time_s
        here = slice(first, first + len(kept))
        assert np.array_equal(position[here], kept[:, 1:4].astype(np.float32))
        assert np.array_equal(turn[here], kept[:, [5, 6, 7, 4]].astype(np.float32))
        assert np.allclose(time_s[here], kept[:, 0], atol=1e-9)
        assert (decision[here] == number).all()
        # A turn about +y by theta takes +x to (cos theta, 0, -sin theta).
        for wheel, angle in zip(wheels, kept[:, 8:10].T, strict=True):
            x, y, z, w = wheel[here].T.astype(float)
            assert np.allclose(1 - 2 * (y * y + z * z), np.cos(angle), atol=1e-6)
            assert np.allclose(2 * (x * z - w * y), -np.sin(angle), atol=1e-6)
        first += len(kept)
    assert first == len(position)


def test_rates_are_spikes_a_neuron_and_second(tmp_path):
    run = list(records(epochs=1, decisions=5, spikes=2000))
    record_run(tmp_path / "r.rrd", "light", run)
    for population in POPULATIONS:
        thinking, _, _ = read(tmp_path / "r.rrd", f"brain/rates/{population.name}", "Scalars:scalars")
        whole, _, _ = read(tmp_path / "r.rrd", f"brain/rates_whole_decision/{population.name}", "Scalars:scalars")
        for number, record in enumerate(run):
            activity = record.activity
            mine = (activity.spike_neuron >= population.start) & (activity.spike_neuron < population.stop)
            in_window = np.count_nonzero(mine & (activity.spike_step < 50))
            assert thinking[number] == pytest.approx(in_window / population.size / 0.050)
            assert whole[number] == pytest.approx(np.count_nonzero(mine) / population.size / (activity.steps / 1000))


def test_weights_dopamine_and_errors_are_read_back_to_the_bit(tmp_path):
    run = list(records(epochs=2, decisions=150, spikes=10, thinking_spikes=5))
    record_run(tmp_path / "r.rrd", "light", run)
    ends = np.array([record.move.trajectory[-1, 0] for record in run])
    for number, name in enumerate(PROJECTION_NAMES):
        weights, time_s, decision = read(tmp_path / "r.rrd", f"brain/weights/{name}", "Scalars:scalars")
        dopamine, _, released = read(tmp_path / "r.rrd", f"brain/dopamine/{name}", "Scalars:scalars")
        assert np.array_equal(weights, [record.activity.mean_weights[number] for record in run])
        everywhere = dict.fromkeys(range(1, 301), 0.0) | dict(zip(released.tolist(), dopamine, strict=True))
        assert list(everywhere.values()) == [record.activity.dopamine[number] for record in run]
        assert np.allclose(time_s, ends, atol=1e-9) and np.array_equal(decision, np.arange(1, 301))
    errors, _, _ = read(tmp_path / "r.rrd", "decisions/position_error_m", "Scalars:scalars")
    assert np.array_equal(errors, [record.move.position_error_m for record in run])


def test_a_trail_strip_follows_its_move(tmp_path):
    run = list(records(epochs=1, decisions=3, spikes=10, thinking_spikes=5))
    record_run(tmp_path / "r.rrd", "light", run)
    with open_recording(tmp_path / "r.rrd", untrusted=False) as file:
        strips = [
            np.array(row[0])
            for chunk in file.chunks(["/world/trajectory"])
            if chunk.has("LineStrips3D:strips")
            for row in chunk.rows.column("LineStrips3D:strips").to_pylist()
        ]
    assert len(strips) == 3
    for strip, record in zip(strips, run, strict=True):
        assert np.allclose(strip[[0, -1], :2], record.move.trajectory[[0, -1], 1:3], atol=1e-6)


def test_the_scene_draws_what_is_seen_and_places_the_wheels_on_the_chassis(tmp_path):
    record_run(tmp_path / "r.rrd", "light", [])
    with open_recording(tmp_path / "r.rrd", untrusted=False) as file:
        static = {chunk.entity: chunk for chunk in file.chunks(["/world/**"])}
    wall = static["world/wall/boxes3d"]
    assert np.allclose(wall.values("Boxes3D:half_sizes"), [[0.01, 0.75, 0.05]])
    assert np.allclose(wall.values("Boxes3D:centers"), [[-0.76, 0, 0.05]])
    assert static["world/robot/plate/boxes3d"].values("Boxes3D:colors").tolist() == [0xFF8040FF]
    assert static["world/robot/wheel_left/spin/tyre/cylinders3d"].values("Cylinders3D:lengths") == pytest.approx(
        [0.018]
    )
    assert np.allclose(static["world/robot/wheel_right"].values("Transform3D:translation"), [[0, -0.08, 0]])
    # The bar runs along y from -0.09 to 0.09: a Rerun capsule starts at one end of that.
    assert abs(static["world/robot/bumper/bumper/capsules3d"].values("Capsules3D:translations")[0, 1]) == pytest.approx(
        0.09
    )
    assert len(static["world/tiles"].values("Boxes3D:centers")) == 25
    assert not any("unseen" in entity for entity in static)


def test_the_policy_is_drawn_as_arrows_to_the_neighbours(tmp_path):
    probabilities = np.zeros((5, 5, 4))
    probabilities[..., 0] = 1.0  # always up...
    probabilities[4, 0] = [0, 0, 1, 0]  # ...but to the left in the cell (5, 1), whose centre is at (0.6, -0.6)
    with open_recorder(tmp_path / "r.rrd") as recorder:
        recorder.close(Snapshot(None, probabilities))
    vectors, _, _ = read(tmp_path / "r.rrd", "world/policy", "Arrows3D:vectors")
    origins, _, _ = read(tmp_path / "r.rrd", "world/policy", "Arrows3D:origins")
    turned = vectors[:, 0] != 0
    assert len(vectors) == 24 and turned.sum() == 1
    assert np.allclose(origins[turned, :2], [[0.6, -0.6]]) and vectors[turned, 0] < -0.05
    assert (vectors[~turned, 1] > 0.05).all() and (vectors[:, 2] == 0).all()


def test_the_dashboard_is_in_the_file(tmp_path):
    record_run(tmp_path / "r.rrd", "light", list(records(epochs=1, decisions=2, spikes=10, thinking_spikes=5)))
    reader = rr.chunk.RrdReader(tmp_path / "r.rrd")
    (blueprint,) = reader.blueprints()
    classes = [
        name
        for chunk in reader.stream(store=blueprint)
        if "ViewBlueprint:class_identifier" in chunk.to_record_batch().schema.names
        for name in chunk.to_record_batch().column("ViewBlueprint:class_identifier").flatten().to_pylist()
    ]
    axes = [
        axis
        for chunk in reader.stream(store=blueprint)
        if "TimeAxis:view_range" in chunk.to_record_batch().schema.names
        for axis in chunk.to_record_batch().column("TimeAxis:view_range").flatten().to_pylist()
    ]
    # An axis that ends at a time is empty on the other timelines.
    assert axes and all(axis == {"start": None, "end": None} for axis in axes)
    assert {"3D", "2D", "TimeSeries", "TextDocument", "TextLog"} <= set(classes)


@pytest.mark.parametrize(("mode", "bytes_a_decision", "bytes_a_spike"), [("light", 8000, 0), ("full", 8000, 6)])
def test_a_recording_is_small(tmp_path, mode, bytes_a_decision, bytes_a_spike):
    run = list(records(epochs=1, decisions=200))
    record_run(tmp_path / "r.rrd", mode, run)
    record_run(tmp_path / "none.rrd", mode, [])
    size = (tmp_path / "r.rrd").stat().st_size - (tmp_path / "none.rrd").stat().st_size
    driving = sum(len(record.activity.spike_step) - record.activity.thinking_spikes for record in run)
    assert size < bytes_a_decision * len(run) + bytes_a_spike * driving


def test_what_the_run_does_with_its_arrays_later_changes_nothing(tmp_path):
    run = list(records(epochs=1, decisions=4, spikes=50, thinking_spikes=20))
    record_run(tmp_path / "kept.rrd", "full", run)
    with open_recorder(tmp_path / "reused.rrd", "full") as recorder:
        for record in run:
            recorder.write(record)
            activity = record.activity
            for array in (record.move.trajectory, activity.spike_step, activity.spike_neuron, activity.mean_weights):
                array[:] = -1
    for entity, component in (
        ("world/robot", "Transform3D:translation"),
        ("brain/spikes/MU", "Points2D:positions"),
        ("brain/weights/SUtoMU", "Scalars:scalars"),
    ):
        kept, reused = (read(tmp_path / f"{name}.rrd", entity, component)[0] for name in ("kept", "reused"))
        assert np.array_equal(kept, reused)


def test_a_brain_without_neurons_is_recorded_too(tmp_path):
    run = [record._replace(activity=None) for record in records(epochs=1, decisions=3, spikes=10, thinking_spikes=5)]
    record_run(tmp_path / "r.rrd", "light", run)
    hits, _, _ = read(tmp_path / "r.rrd", "decisions/hit", "Scalars:scalars")
    assert hits.tolist() == [float(record.hit) for record in run]


def test_a_failed_move_without_a_trajectory_is_recorded_and_named_in_the_log(tmp_path):
    (record,) = records(epochs=1, decisions=1, spikes=10, thinking_spikes=5)
    failed = record.move._replace(outcome=Outcome.FAILED, trajectory=np.empty((0, 12)))
    record_run(tmp_path / "r.rrd", "light", [record._replace(move=failed, hit=False)])
    with open_recording(tmp_path / "r.rrd", untrusted=False) as file:
        texts = [text for chunk in file.chunks(["/decisions/log"]) for text in chunk.values("TextLog:text")]
    assert any("failed" in text for text in texts)


def test_a_recorder_refuses_to_overwrite_and_names_a_place_that_cannot_be_written(tmp_path):
    (tmp_path / "r.rrd").write_bytes(b"mine")
    with pytest.raises(SclaError, match="exists already"):
        open_recorder(tmp_path / "r.rrd")
    assert (tmp_path / "r.rrd").read_bytes() == b"mine"
    with pytest.raises(SclaError, match="cannot be written"):
        open_recorder(tmp_path / "nowhere" / "r.rrd")


def test_looking_for_room_leaves_nothing_even_if_it_is_killed(tmp_path, monkeypatch):
    monkeypatch.setattr(Path, "unlink", lambda *_, **__: None)  # as if it never came to that
    open_recorder(tmp_path / "r.rrd").close()
    assert [file.name for file in tmp_path.iterdir()] == ["r.rrd"]


def test_a_target_that_jumps_is_drawn_in_its_new_cell_and_ends_the_epoch_once(tmp_path):
    run = list(records(epochs=2, decisions=20, spikes=10, thinking_spikes=5))
    config = RunConfig(task=TaskConfig(jump_epoch=2, jump_target=(1, 5)))
    with open_recorder(tmp_path / "r.rrd", config=config) as recording:
        for record in run:
            recording.write(record)
            if record.decision == 20:
                recording.end_epoch(hits=5, decisions=20)
    offset, time_s, _ = read(tmp_path / "r.rrd", "world/target", "Transform3D:translation")
    np.testing.assert_allclose(offset, [[-0.6, 0.6, 0.0]], atol=1e-6)
    assert run[19].time_s < time_s[0] <= run[20].time_s + 1e-6
    ceiling, _, decision = read(tmp_path / "r.rrd", "learning/ceiling", "Scalars:scalars")
    assert list(zip(decision.tolist(), ceiling.ravel().tolist(), strict=True)) == [
        (1, 400.0), (20, 400.0), (21, 240.0), (40, 240.0),
    ]  # fmt: skip
    earned, _, decision = read(tmp_path / "r.rrd", "learning/epoch", "Scalars:scalars")
    assert list(zip(decision.tolist(), earned.ravel().tolist(), strict=True)) == [(20, 250.0), (40, 250.0)]
    said, _, _ = read(tmp_path / "r.rrd", "decisions/log", "TextLog:text")
    assert said.tolist() == [
        "epoch 1: 5 hits in 20 decisions, 62.5 % of the ceiling",
        "the target jumps to cell (1, 5)",
        "epoch 2: 5 hits in 20 decisions, 104.2 % of the ceiling",
    ]
