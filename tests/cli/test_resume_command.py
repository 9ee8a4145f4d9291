"""`scla-mj resume` from outside: after kill -9, after Ctrl-C, and refused."""

import re
import resource
import signal
import subprocess
import sys
import time

import pytest

from scla_mj.cli.main import main
from scla_mj.runs.atomic import read_json
from scla_mj.runs.checkpoint import read_checkpoint
from scla_mj.runs.decisions import read_decisions

OPTIONS = ["--brain", "automaton", "--epochs", "2", "--decisions", "400", "--seed", "3"]


def test_a_run_killed_outright_is_resumed_bit_identically(tmp_path, capsys):
    killed, whole = tmp_path / "killed", tmp_path / "whole"
    command = [sys.executable, "-m", "scla_mj.cli.main", "rollout", str(killed), *OPTIONS]
    process = subprocess.Popen([*command, "--checkpoint-period-s", "0.1"], stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 90
    while time.monotonic() < deadline and not (killed / "checkpoint.npz").exists():
        time.sleep(0.01)
    time.sleep(0.3)
    process.send_signal(signal.SIGKILL)
    process.wait()
    decisions = read_checkpoint(killed)["decisions"]
    assert 0 < decisions < 800
    assert read_decisions(killed).num_rows >= decisions
    assert main(["inspect", str(killed)]) == 0
    assert f"scla-mj resume {killed} continues it" in capsys.readouterr().out
    assert main(["resume", str(killed)]) == 0
    printed = capsys.readouterr().out
    assert f"scla-mj view {killed}" in printed
    assert (killed / "recording-2.rrd").exists()
    assert main(["inspect", str(killed)]) == 0
    assert "sound, complete: 2 epochs" in capsys.readouterr().out
    assert main(["rollout", str(whole), *OPTIONS]) == 0
    for name in ("decisions.parquet", "brain.npz"):
        assert (killed / name).read_bytes() == (whole / name).read_bytes()
    summaries = [read_json(path / "summary.json") for path in (killed, whole)]
    assert all(summary.pop("wall_s") for summary in summaries)
    assert summaries[0] == summaries[1]
    assert main(["resume", str(killed)]) == 2
    assert "is complete: there is nothing to resume" in capsys.readouterr().err


@pytest.mark.parametrize("telemetry", ["light", "off"])
def test_a_full_disk_ends_in_a_sentence_and_the_run_is_resumed_once_there_is_room(telemetry, tmp_path):
    """A limit on any file's size stands in for the full disk: it stops a recording at its birth, decisions later."""
    room_bytes, options = 60_000, [*OPTIONS, "--telemetry", telemetry]

    def fill():
        resource.setrlimit(resource.RLIMIT_FSIZE, (room_bytes, room_bytes))

    full, whole = tmp_path / "full", tmp_path / "whole"
    command = [sys.executable, "-m", "scla_mj.cli.main", "rollout", str(full), *options, "--checkpoint-period-s", "0.1"]
    run = subprocess.run(command, preexec_fn=fill, capture_output=True, text=True, timeout=90)
    assert run.returncode == 2
    assert re.fullmatch(r"scla-mj: .*cannot (write|be written).*", run.stderr.splitlines()[-1])
    assert "Traceback" not in run.stderr
    if telemetry == "light":
        assert not full.exists()
        return
    assert read_decisions(full).num_rows > 0
    assert main(["resume", str(full)]) == 0
    assert main(["rollout", str(whole), *options]) == 0
    assert (full / "decisions.parquet").read_bytes() == (whole / "decisions.parquet").read_bytes()


INTERRUPTING = """
import os, signal
from scla_mj.brain.tabular import QLearningBrain

class Interrupting(QLearningBrain):
    def __init__(self, checked, settings):
        super().__init__(checked, settings)
        self.decided = 0

    def decide(self, percept):
        self.decided += 1
        if self.decided == 12:
            os.kill(os.getpid(), signal.SIGINT)
        return super().decide(percept)
"""


def test_ctrl_c_says_how_to_go_on(tmp_path, monkeypatch, capsys):
    (tmp_path / "interrupting_brain.py").write_text(INTERRUPTING)
    monkeypatch.chdir(tmp_path)
    options = ["--brain", "interrupting_brain:Interrupting", "--epochs", "1", "--decisions", "20"]
    assert main(["rollout", "my run", *options]) == 130
    assert f"scla-mj resume 'my run' --brain {options[1]} continues it" in capsys.readouterr().err
    assert main(["inspect", "my run"]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("my run: sound, unfinished: 12 of 20 decisions")
    assert f"scla-mj resume 'my run' --brain {options[1]} continues it" in printed
    assert main(["resume", "my run", *options[:2]]) == 0  # the signal's twelfth decision is past
    assert read_decisions(tmp_path / "my run").num_rows == 20


@pytest.mark.parametrize("period", ["-1", "nan", "soon"])
def test_a_period_that_cannot_be_is_refused(period, tmp_path, capsys):
    assert main(["rollout", str(tmp_path / "run"), "--checkpoint-period-s", period]) == 2
    assert "--checkpoint-period-s" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_what_is_no_run_is_refused(tmp_path, capsys):
    assert main(["resume", str(tmp_path / "nowhere")]) == 2
    assert "is not a run folder" in capsys.readouterr().err
