"""A film shows what the recording holds: the robot where it was, frame by frame, without a display."""

import dataclasses
import shutil
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from scla_mj import RunConfig, load_run, rollout, simulate
from scla_mj.cli.main import main
from scla_mj.config import TaskConfig
from scla_mj.render.film import Film, Frames, _with_history, drawn_model, frame_times
from scla_mj.render.overlay import Overlay
from scla_mj.render.poses import stored_poses
from scla_mj.render.replay import replay
from scla_mj.render.video import write_frames

CONFIG = RunConfig(brain="dyna-q", epochs=1, decisions=30, seed=2)
DECISIONS = range(11, 19)
DRAFT = Film("top", size=(320, 240), fps=10, draft=True)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("film") / "run"
    rollout(CONFIG, folder, pictures=False)
    return load_run(folder)


@pytest.fixture(scope="module")
def truth():
    """The trajectories of the shown decisions, every control period, as the simulation has them."""
    simulation = simulate(CONFIG)
    records = [simulation.step() for _ in range(DECISIONS.stop - 1)]
    return [record.move.trajectory for record in records[DECISIONS.start - 1 :]]


def test_the_robot_is_where_it_was_exactly_at_the_ends_of_decisions_and_nearly_between(run, truth):
    poses, _ = stored_poses(run, DECISIONS, drawn_model(run))
    for rows in truth:
        apart_m = [np.linalg.norm(poses.at(row[0])[:3] - row[1:4]) for row in rows]
        assert apart_m[-1] < 1e-6
        assert max(apart_m) < 2e-3
        assert np.mean(apart_m) < 2e-4
        wheels = poses.at(rows[-1, 0])[7:9] - rows[-1, 8:10]
        assert np.abs(np.sin(wheels / 2)).max() < 1e-5


def test_the_end_of_a_decision_counts_the_hit_that_it_shows(run):
    poses, _ = stored_poses(run, range(1, 31), drawn_model(run))
    overlay = Overlay(run, range(1, 31), None, (320, 240))
    hits = np.cumsum(run.decisions["hit"].to_pylist())
    for decision in range(1, 31):
        end_s = np.nextafter(poses.time_s[poses.decision == decision].max(), 0)  # as a sum may round it
        (where, _), (counted, _), *_ = overlay._lines(decision - 1, end_s)
        assert where.startswith(f"decision {decision} (epoch 1)")
        assert counted == f"{hits[decision - 1]} hits in this epoch"


def test_the_first_frame_has_the_trail_and_the_spikes_of_the_decisions_before(run):
    times_s = run.decisions["time_s"].to_numpy()
    known = _with_history(run, range(25, 27))
    assert known.stop == 27 and known.start <= 25 - 11
    assert times_s[known.start - 1] <= times_s[24] - 12
    assert _with_history(run, range(3, 5)) == range(1, 5)


def test_a_robot_that_is_put_down_elsewhere_is_never_seen_on_the_way(run):
    hits = np.flatnonzero(run.decisions["hit"].to_numpy(zero_copy_only=False)) + 1
    decision = next(int(hit) for hit in hits if hit < 30)
    poses, _ = stored_poses(run, range(decision, decision + 2), drawn_model(run))
    (jump,) = np.flatnonzero(poses.jumps)
    before, after = poses.time_s[jump : jump + 2]
    for time_s in np.linspace(before, after, 20)[:-1]:
        np.testing.assert_allclose(poses.at(time_s), poses.qpos[jump])
    np.testing.assert_allclose(poses.at(after), poses.qpos[jump + 1])


def test_a_run_without_a_recording_is_simulated_again_to_the_same_places(run, tmp_path):
    rollout(dataclasses.replace(CONFIG, telemetry="off"), tmp_path / "off", pictures=False)
    unrecorded = load_run(tmp_path / "off")
    recorded, _ = stored_poses(run, DECISIONS, drawn_model(run))
    again, _ = stored_poses(unrecorded, DECISIONS, drawn_model(unrecorded))
    for time_s, qpos in zip(recorded.time_s, recorded.qpos, strict=True):
        np.testing.assert_allclose(again.at(time_s)[:7], qpos[:7], atol=1e-6)


def test_the_robot_stands_in_the_picture_where_the_trajectory_has_it_at_every_decisions_end(run, truth):
    poses, _ = stored_poses(run, DECISIONS, drawn_model(run))
    frames = Frames(run, DECISIONS, poses, DRAFT, drawn_model(run))
    try:
        times_s = [rows[-1, 0] for rows in truth]
        pictures = np.array([frames.draw(time_s) for time_s in times_s], float)
    finally:
        frames.close()
    dark = pictures.sum(axis=3) < 200  # nothing else is as dark as its body
    rows_of, columns = np.indices(dark.shape[1:])
    seen = np.array([(columns[one].mean(), -rows_of[one].mean()) for one in dark])
    there = np.array([rows[-1, 1:3] for rows in truth])
    metres_per_pixel = np.linalg.norm(np.ptp(there, axis=0)) / np.linalg.norm(np.ptp(seen, axis=0))
    placed = (seen - seen.mean(axis=0)) * metres_per_pixel + there.mean(axis=0)
    assert np.abs(placed - there).max() < 0.05  # its height leans it outwards, seen from one point


@pytest.mark.parametrize("kind", ["mp4", "gif", "png"])
def test_every_frame_of_a_film_can_be_decoded_again(kind, run, tmp_path, capsys):
    if kind == "mp4":
        av = pytest.importorskip("av")
    file = tmp_path / f"film.{kind}"
    options = ["--from", "11", "--to", "13", "--size", "160", "120", "--fps", "10", "--draft"]
    assert main(["render", str(run.path), str(file), *options]) == 0
    poses, _ = stored_poses(run, range(11, 14), drawn_model(run))
    expected = len(frame_times(run, range(11, 14), poses, Film("top", fps=10)))
    said = "the end of decision 13" if kind == "png" else f"{expected} frames, decisions 11 to 13"
    assert capsys.readouterr().out == f"Written:  {file}, {said}\n"
    if kind == "mp4":
        with av.open(str(file)) as container:
            sizes = [(frame.width, frame.height) for frame in container.decode(video=0)]
        assert sizes == [(160, 120)] * expected
    else:
        with Image.open(file) as picture:
            assert picture.size == (160, 120)
            assert getattr(picture, "n_frames", 1) == (expected if kind == "gif" else 1)
    before = file.read_bytes()
    assert main(["render", str(run.path), str(file), *options]) == 2
    assert "is there already: choose another name, or --overwrite" in capsys.readouterr().err
    assert file.read_bytes() == before


@pytest.mark.parametrize("fps", [24, 30, 60])
def test_a_gif_lasts_as_long_as_its_frames(fps, tmp_path):
    frames = np.random.default_rng(0).integers(0, 255, (2 * fps, 8, 8, 3), np.uint8)
    write_frames(tmp_path / "film.gif", ".gif", frames, fps=fps)
    with Image.open(tmp_path / "film.gif") as picture:
        assert picture.n_frames == 2 * fps
        lasting_ms = [picture.seek(number) or picture.info["duration"] for number in range(picture.n_frames)]
    assert sum(lasting_ms) == 2000


def test_mujocos_viewer_shows_the_target_where_it_is_in_each_epoch(tmp_path, monkeypatch):
    task = TaskConfig(jump_epoch=2, jump_target=(1, 5))
    rollout(RunConfig(brain="random", epochs=2, decisions=2, task=task), tmp_path / "run", pictures=False)
    run, seen, shown = load_run(tmp_path / "run"), [], SimpleNamespace(is_running=lambda: True, close=lambda: None)

    def launch(model, data, **how):
        shown.sync = lambda: seen.append(tuple(data.geom("target_disc").xpos[:2].round(6)))
        return shown

    monkeypatch.setattr("mujoco.viewer", SimpleNamespace(launch_passive=launch), raising=False)
    monkeypatch.setattr("scla_mj.world.window.opens_windows", lambda: True)
    monkeypatch.setenv("DISPLAY", ":0")
    replay(run, range(1, 5), speed=1000.0, stay=False)
    assert set(seen) == {run.checked.grid(epoch).centre_m(run.checked.grid(epoch).target) for epoch in (1, 2)}


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["film.avi"], "must end in .mp4, .gif or .png"),
        (["film.png", "--from", "29", "--to", "31"], "--to is 31: "),
        (["film.png", "--from", "31"], "--from is 31: "),
        (["film.png", "--from", "0"], "has made decisions 1 to 30\n"),
        (["film.png", "--epoch", "2"], "has made epochs 1 to 1\n"),
        (["nodir/film.png"], "cannot write "),
        (["film.gif", "--from", "9", "--to", "3"], "--to 3 is before decision 9, the first to show"),
        (["film.mp4", "--size", "161", "120"], "both must be even for .mp4"),
        (["film.png", "--size", "4000", "3000"], "cannot be drawn: at most"),
        (["film.png", "--fps", "0"], "--fps is 0"),
        (["film.png", "--speed", "0"], "--speed is 0.0"),
    ],
)
def test_what_cannot_be_shown_is_said_in_one_sentence_and_nothing_is_left(words, sentence, run, tmp_path, capsys):
    assert main(["render", str(run.path), str(tmp_path / words[0]), *words[1:]]) == 2
    said = capsys.readouterr().err
    assert sentence in said
    assert said.startswith("scla-mj: ") and said.count("\n") == 1  # no bar of a film that there will not be
    assert not list(tmp_path.iterdir())


def test_a_killed_run_is_shown_as_far_as_it_was_recorded(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("scla_mj.telemetry.recording._DECISIONS_A_FLUSH", 4)

    def copy(record, account):
        if account.decisions == 7:
            shutil.copytree(tmp_path / "run", tmp_path / "killed")

    rollout(dataclasses.replace(CONFIG, epochs=4, decisions=2), tmp_path / "run", watch=copy, pictures=False)
    words = ["render", str(tmp_path / "killed"), str(tmp_path / "film.png"), "--draft"]
    assert main(words) == 2
    assert "is unfinished and its recording ends with decision 4: give --to 4\n" in capsys.readouterr().err
    assert main([*words, "--to", "4"]) == 0


def test_without_an_encoder_the_line_that_installs_one_is_named(run, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("PATH", "")
    monkeypatch.setitem(sys.modules, "av", None)
    assert main(["render", str(run.path), str(tmp_path / "film.mp4")]) == 2
    said = capsys.readouterr().err
    assert said.startswith("scla-mj: film.mp4, without ffmpeg on the path,") and said.count("\n") == 1
    assert "pip install 'scla-mj[video]'" in said
