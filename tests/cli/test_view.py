"""`scla-mj view` opens what there is, or says what is missing; a run is watched without knowing it."""

import subprocess
import sys

import pytest

from scla_mj import RunConfig, rollout
from scla_mj.cli.main import main
from scla_mj.engine.lock import running

SMALL = RunConfig(brain="random", epochs=1, decisions=3)


@pytest.fixture
def started(monkeypatch):
    """The viewers that are started, instead of starting them."""
    calls, start = [], subprocess.Popen

    def note(command, *more, **how):
        words = [str(word) for word in command]
        if not {"rerun", "--follow"} & set(words):
            return start(command, *more, **how)
        calls.append(words)
        ended = start([sys.executable, "-c", ""])
        ended.wait()
        return ended

    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(subprocess, "Popen", note)
    return calls


def test_a_finished_run_opens_all_its_parts_on_loopback_alone(started, tmp_path):
    rollout(SMALL, tmp_path / "run", pictures=False)
    assert main(["view", str(tmp_path / "run")]) == 0
    (command,) = started
    assert command[:3] == [sys.executable, "-m", "rerun"]
    assert command[command.index("--bind") + 1] == "127.0.0.1"
    assert command[-1] == str(tmp_path / "run" / "recording.rrd")


def test_an_interrupted_viewer_speaks_of_no_files_since_it_writes_none(tmp_path, monkeypatch, capsys):
    def interrupted(parts):
        raise KeyboardInterrupt

    rollout(SMALL, tmp_path / "run", pictures=False)
    monkeypatch.setattr("scla_mj.telemetry.viewer.open_files", interrupted)
    assert main(["view", str(tmp_path / "run")]) == 130
    assert capsys.readouterr().err == "scla-mj: interrupted\n"


def test_watching_starts_one_viewer_after_the_first_decision_and_changes_no_bit(started, tmp_path):
    watched, alone = tmp_path / "watched", tmp_path / "alone"
    options = ["--brain", "random", "--epochs", "1", "--decisions", "3"]
    assert main(["rollout", str(watched), *options, "--watch", "--pace", "50"]) == 0
    assert started == [[sys.executable, "-m", "scla_mj", "view", str(watched), "--follow"]]
    rollout(SMALL, alone)
    assert (watched / "decisions.parquet").read_bytes() == (alone / "decisions.parquet").read_bytes()


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--watch"], "--watch needs a display, and there is none: leave it out"),
        (["--pace", "0"], "--pace is 0.0: it must be above 0"),
        (["--watch", "--telemetry", "off"], "--watch shows the recording, and --telemetry off makes none"),
    ],
)
def test_what_cannot_be_watched_is_refused_before_anything_runs(options, sentence, tmp_path, monkeypatch, capsys):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    if "off" in options:
        monkeypatch.setenv("DISPLAY", ":0")
    assert main(["rollout", str(tmp_path / "run"), "--brain", "random", *options]) == 2
    assert sentence in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_what_cannot_be_shown_is_said_in_one_sentence(tmp_path, monkeypatch, capsys):
    run = tmp_path / "run"
    rollout(SMALL, run, pictures=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)

    def refusal(*words):
        assert main(["view", *map(str, words)]) == 2
        return capsys.readouterr().err

    assert "needs a display" in refusal(run)
    with running(run):
        assert f"is in progress: `scla-mj view {run} --follow`" in refusal(run)
    with (run / "recording.rrd").open("r+b") as recording:
        recording.truncate(1000)
    for words in ([run], [run, "--mujoco"]):
        assert "recording.rrd is damaged" in refusal(*words)
    (run / "recording.rrd").unlink()
    assert "recording.rrd is missing" in refusal(run)
