"""Whole runs, on real parts: that they learn, that they are reproducible, that they say what happened."""

import dataclasses

import numpy as np
import pytest

from scla_mj.anatomy import PROJECTIONS
from scla_mj.brain.scla import SclaBrain
from scla_mj.checked import check
from scla_mj.config import GridConfig, RunConfig, TaskConfig
from scla_mj.engine.inspection import inspect_run
from scla_mj.engine.rollout import rollout
from scla_mj.grid import Action, Cell
from scla_mj.runs.brain import read_brain
from scla_mj.runs.decisions import read_decisions
from scla_mj.runs.plots import plot_policy
from scla_mj.runs.summary import read_summary
from scla_mj.signals import Snapshot
from scla_mj.telemetry.reading.reader import inspect_recording

QUICK = RunConfig(epochs=1, decisions=40, telemetry="off")


def run(config, path):
    return rollout(config, path, pictures=False)


def test_the_embodied_robot_learns_far_beyond_the_random_walk(tmp_path):
    summary = run(dataclasses.replace(QUICK, epochs=2, decisions=400), tmp_path / "run")
    assert summary.ceiling_hits_per_1000 == pytest.approx(400)
    # The random walk earns 31.58 a 1000, a brain that is perfect only next to the target 115.38.
    assert summary.epochs[1].hits_per_1000 > 320
    assert summary.transitions.failed == 0
    assert summary.max_position_error_m < 0.003
    means = summary.epochs[1].mean_weights
    agreeing = [mean for projection, mean in zip(PROJECTIONS, means, strict=True) if projection.agrees]
    opposite = [mean for projection, mean in zip(PROJECTIONS, means, strict=True) if not projection.agrees]
    assert min(agreeing) > max(opposite)


@pytest.mark.parametrize("telemetry", ["light", "full"])
def test_recording_changes_no_bit_of_a_run(telemetry, tmp_path):
    off = run(QUICK, tmp_path / "off")
    on = run(dataclasses.replace(QUICK, telemetry=telemetry), tmp_path / "on")
    assert off.epochs == on.epochs
    for name in ("decisions.parquet", "brain.npz"):
        assert (tmp_path / "off" / name).read_bytes() == (tmp_path / "on" / name).read_bytes()


def test_weights_are_drawn_for_every_brain_that_tells_its_mean_weights(tmp_path, monkeypatch):
    monkeypatch.setattr(SclaBrain, "snapshot", lambda _: Snapshot())
    rollout(dataclasses.replace(QUICK, decisions=9), tmp_path / "run")
    assert (tmp_path / "run" / "weights.png").exists()
    assert not (tmp_path / "run" / "policy.png").exists()


def test_another_seed_gives_another_run(tmp_path):
    run(QUICK, tmp_path / "first")
    run(dataclasses.replace(QUICK, seed=1), tmp_path / "second")
    assert not read_decisions(tmp_path / "first").equals(read_decisions(tmp_path / "second"))


def test_every_row_fits_the_grid_and_the_row_before(tmp_path):
    config = dataclasses.replace(QUICK, decisions=150, grid=GridConfig((4, 3), (2, 2)))
    run(config, tmp_path / "run")
    grid, before = check(config).grid(), None
    for row in read_decisions(tmp_path / "run").to_pylist():
        cell, after = Cell(row["x"], row["y"]), Cell(row["to_x"], row["to_y"])
        action = Action[row["action"].upper()]
        sensed = grid.sensed_from(cell)
        assert row["sensed"] == ("none" if sensed is None else sensed.label)
        assert (row["advised"] == "none") == (sensed is not None)
        assert after == grid.after(cell, action)
        assert row["outcome"] == ("blocked" if after == cell else "moved")
        assert row["hit"] == (after == grid.target)
        counts = [row[f"spikes_{name}"] for name in ("MU", "MD", "ML", "MR")]
        assert counts[action] == max(counts)
        if before is not None:
            assert row["time_s"] == pytest.approx(before["time_s"] + 0.05 + before["duration_s"])
            if not before["hit"]:
                assert cell == Cell(before["to_x"], before["to_y"])
        before = row


def test_a_jumping_target_is_hit_in_its_new_place_and_judged_by_its_new_ceiling(tmp_path):
    world = TaskConfig(jump_epoch=2, jump_target=(1, 5))
    summary = run(dataclasses.replace(QUICK, epochs=3, decisions=250, task=world), tmp_path / "run")
    rows = read_decisions(tmp_path / "run").to_pylist()
    assert {(r["to_x"], r["to_y"]) for r in rows if r["hit"] and r["epoch"] == 1} == {(3, 3)}
    assert {(r["to_x"], r["to_y"]) for r in rows if r["hit"] and r["epoch"] > 1} == {(1, 5)}
    assert [epoch.ceiling_hits_per_1000 for epoch in summary.epochs] == pytest.approx([400, 240, 240])


def test_wheels_that_are_crossed_from_an_epoch_on_are_recorded_as_they_were_driven(tmp_path):
    """The shortest way with wheels as they are is the longest with crossed ones."""
    config = dataclasses.replace(QUICK, protocol="sensed-start", brain="automaton", epochs=3, decisions=40)
    run(dataclasses.replace(config, task=TaskConfig(crossed_epoch=2)), tmp_path / "run")
    rows = read_decisions(tmp_path / "run").to_pylist()
    grid = check(config).grid()
    for row in rows:
        action, executed = (Action[row[name].upper()] for name in ("action", "executed"))
        assert executed == (action if row["epoch"] == 1 else action.opposite)
        assert (row["to_x"], row["to_y"]) == grid.after(Cell(row["x"], row["y"]), executed)
    assert any(row["hit"] for row in rows if row["epoch"] == 3)
    assert inspect_run(tmp_path / "run").verdict == "sound"


def test_direction_noise_sends_the_body_elsewhere_as_often_as_it_says(tmp_path):
    probability, decisions = 0.3, 400
    config = dataclasses.replace(QUICK, brain="random", decisions=decisions, task=TaskConfig(action_noise=probability))
    run(config, tmp_path / "run")
    rows = read_decisions(tmp_path / "run").to_pylist()
    astray = [row for row in rows if row["executed"] != row["action"]]
    margin = 5 * np.sqrt(decisions * probability * (1 - probability))
    assert abs(len(astray) - probability * decisions) < margin
    grid = check(config).grid()
    for row in rows:
        after = grid.after(Cell(row["x"], row["y"]), Action[row["executed"].upper()])
        assert (row["to_x"], row["to_y"]) == after


def test_closed_cells_block_the_robot_and_are_never_entered(tmp_path):
    closed = ((2, 3), (3, 2))
    config = dataclasses.replace(QUICK, brain="random", decisions=200, grid=GridConfig(closed_cells=closed))
    run(config, tmp_path / "run")
    rows = read_decisions(tmp_path / "run").to_pylist()
    assert not {(row["to_x"], row["to_y"]) for row in rows} & set(closed)
    grid = check(config).grid()
    into = [r for r in rows if (Cell(r["x"], r["y"]).after(Action[r["action"].upper()])) in grid.closed]
    assert into
    assert {row["outcome"] for row in into} == {"blocked"}


def test_a_run_that_is_interrupted_keeps_every_complete_decision(tmp_path):
    def stop(record, epoch):
        if record.decision == 17:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        rollout(QUICK, tmp_path / "run", watch=stop, pictures=False)
    assert read_decisions(tmp_path / "run").num_rows == 17
    assert read_summary(tmp_path / "run").epochs[0].decisions == 17
    assert read_brain(tmp_path / "run").weights is not None


def test_a_run_cut_before_its_target_jumps_draws_the_target_where_it_was(tmp_path):
    config = dataclasses.replace(QUICK, brain="automaton", epochs=2, task=TaskConfig(jump_epoch=2))

    def stop(record, epoch):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        rollout(config, tmp_path / "cut", watch=stop)
    probabilities, summary = read_brain(tmp_path / "cut").probabilities, read_summary(tmp_path / "cut")
    plot_policy(tmp_path, check(config).grid(1), probabilities, summary)
    assert (tmp_path / "cut" / "policy.png").read_bytes() == (tmp_path / "policy.png").read_bytes()


def test_a_recording_ends_with_the_weights_of_the_files_wherever_the_run_is_cut(tmp_path):
    def stop(record, epoch):
        if record.decision == 25:  # where the recording has just kept the probabilities alone
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        rollout(dataclasses.replace(QUICK, telemetry="light"), tmp_path / "run", watch=stop, pictures=False)
    weights = read_brain(tmp_path / "run").weights
    recorded = inspect_recording(tmp_path / "run" / "recording.rrd").weights
    assert np.array_equal(np.stack(list(recorded.values())), weights)


def test_short_epochs_make_no_longer_recording_and_the_last_weights_are_in_it(tmp_path):
    """Whole weights after each of 120 epochs would take ten megabytes more."""
    for decisions in (1, 120):
        config = dataclasses.replace(QUICK, epochs=120 // decisions, decisions=decisions, telemetry="light")
        rollout(config, tmp_path / f"{decisions}", pictures=False)
        recording = tmp_path / f"{decisions}" / "recording.rrd"
        weights = np.stack(list(inspect_recording(recording).weights.values()))
        assert np.array_equal(weights, read_brain(recording.parent).weights), "the last are recorded too"
    sizes = [(tmp_path / f"{decisions}" / "recording.rrd").stat().st_size for decisions in (1, 120)]
    assert sizes[0] < 1.3 * sizes[1]


@pytest.mark.parametrize("brain", ["automaton", "network", "random", "q-learning", "shortest-path"])
def test_every_brain_drives_the_robot(brain, tmp_path):
    summary = run(dataclasses.replace(QUICK, brain=brain), tmp_path / "run")
    assert summary.transitions.commanded == 40
    assert summary.transitions.failed == 0
    if brain == "shortest-path":
        # 40 decisions of 2.5 moves each, +- 5 deviations of 0.96 / sqrt(16) moves
        assert 12 <= summary.epochs[0].hits <= 22
