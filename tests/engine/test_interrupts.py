"""Ctrl-C and SIGTERM during a rollout: the decision is finished, and everything complete is on disk and agrees."""

import os
import pty
import signal
import subprocess
import sys
import threading

import pytest

from scla_mj.cli.main import main
from scla_mj.engine.interrupts import Terminated, held_back, terminable
from scla_mj.runs.brain import read_brain
from scla_mj.runs.decisions import read_decisions
from scla_mj.runs.summary import read_summary
from scla_mj.telemetry.reading.reader import inspect_recording

SIGNALLING = """
import os, signal
from scla_mj.brain.scla import SclaBrain

class {name}(SclaBrain):
    decided = 0

    def decide(self, percept):
        self.decided += 1
        if self.decided == {decision}:
            for _ in range({times}):
                os.kill(os.getpid(), signal.{signal})
        return super().decide(percept)
"""


@pytest.fixture(autouse=True)
def listening():
    """`nohup`, under which the suite may run, leaves SIGHUP ignored."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


def rollout_with_a_signal(number, decision, folder, monkeypatch, times=1):
    """Run with a brain that is sent a signal in the middle of a decision; returns the exit code."""
    module = f"signalling_{number.name}_{decision}_{times}".lower()
    source = SIGNALLING.format(name="Signalled", decision=decision, signal=number.name, times=times)
    (folder / f"{module}.py").write_text(source)
    monkeypatch.chdir(folder)
    return main(["rollout", "run", "--brain", f"{module}:Signalled", "--epochs", "1", "--decisions", "60"])


@pytest.mark.parametrize(
    ("number", "code", "word"),
    [
        (signal.SIGINT, 130, "interrupted"),
        (signal.SIGTERM, 143, "terminated"),
        (signal.SIGHUP, 129, "the terminal was closed"),
    ],
)
def test_a_signal_waits_for_the_decision_and_leaves_files_that_agree(number, code, word, tmp_path, monkeypatch, capsys):
    assert rollout_with_a_signal(number, 25, tmp_path, monkeypatch) == code
    assert f"scla-mj: {word}; what was complete is on disk\n" in capsys.readouterr().err
    rows = read_decisions(tmp_path / "run").to_pylist()
    assert [row["decision"] for row in rows] == list(range(1, 26))
    summary = read_summary(tmp_path / "run")
    assert summary.epochs[0].decisions == 25
    assert summary.simulated_s == pytest.approx(rows[-1]["time_s"] + 0.05 + rows[-1]["duration_s"])
    assert main(["inspect", "run"]) == 0, capsys.readouterr().out
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_a_second_signal_cuts_the_decision_and_still_leaves_a_readable_run(tmp_path, monkeypatch, capsys):
    assert rollout_with_a_signal(signal.SIGTERM, 10, tmp_path, monkeypatch, times=2) == 143
    assert "scla-mj resume run --brain signalling_sigterm_10_2:Signalled continues" in capsys.readouterr().err
    rows = read_decisions(tmp_path / "run").to_pylist()
    assert len(rows) == 9
    summary = read_summary(tmp_path / "run")
    assert summary.simulated_s == pytest.approx(rows[-1]["time_s"] + 0.05 + rows[-1]["duration_s"])
    assert read_brain(tmp_path / "run").weights is not None
    assert inspect_recording(tmp_path / "run" / "recording.rrd").finished


def test_a_first_signal_is_held_back_and_a_second_acts_at_once():
    reached = []
    with pytest.raises(KeyboardInterrupt), held_back() as let_through:
        os.kill(os.getpid(), signal.SIGINT)
        reached.append("held back")
        let_through()
        reached.append("let through too late")
    assert reached == ["held back"]
    with pytest.raises(Terminated), terminable(), held_back():
        os.kill(os.getpid(), signal.SIGINT)
        reached.append("held back again")
        os.kill(os.getpid(), signal.SIGTERM)
        reached.append("the second did nothing")
    assert reached == ["held back", "held back again"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_closing_terminal_never_cuts_a_decision_and_nohup_is_respected():
    with pytest.raises(Terminated), terminable(), held_back() as let_through:
        for _ in range(3):
            os.kill(os.getpid(), signal.SIGHUP)
        let_through()
    signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does
    try:
        with terminable(), held_back() as let_through:
            os.kill(os.getpid(), signal.SIGHUP)
            let_through()
    finally:
        signal.signal(signal.SIGHUP, signal.SIG_DFL)


IN_A_TERMINAL = """
import contextlib, os, signal, sys
from scla_mj.engine.interrupts import held_back, terminable

try:
    with terminable(), held_back() as let_through:
        print("decides", flush=True)
        with contextlib.suppress(OSError):
            os.read(0, 1)  # ends with the terminal; signal.pause() would wait for ever if the signal came before it
        print("a bar moves on", flush=True)
        let_through()
except KeyboardInterrupt as stop:
    print("how it is resumed", flush=True)
    sys.exit(128 + stop.args[0])
"""


def test_what_is_said_after_the_terminal_has_closed_does_no_harm():
    process, terminal = pty.fork()
    if process == 0:
        os.execv(sys.executable, [sys.executable, "-c", IN_A_TERMINAL])
    assert os.read(terminal, 100).startswith(b"decides")
    os.close(terminal)
    assert os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]) == 128 + signal.SIGHUP


STARTING = """
import os, signal, sys

class Interrupts:
    @staticmethod
    def find_spec(name, *_):
        if name == "{module}":
            os.kill(os.getpid(), signal.{number})

sys.meta_path.insert(0, Interrupts)
from scla_mj.__main__ import main
sys.exit(main(["rollout", "run"]))
"""


@pytest.mark.parametrize(
    ("module", "number", "code", "word"),
    [("tyro", "SIGINT", 130, "interrupted"), ("mujoco._structs", "SIGTERM", 143, "terminated")],
)
def test_a_signal_while_a_command_starts_ends_it_in_one_line(module, number, code, word, tmp_path):
    command = [sys.executable, "-c", STARTING.format(module=module, number=number)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (code, "", f"scla-mj: {word}\n")
    assert not list(tmp_path.iterdir())


def test_a_signal_that_is_never_let_through_is_not_lost():
    with pytest.raises(KeyboardInterrupt), held_back():
        os.kill(os.getpid(), signal.SIGINT)


def test_another_thread_than_the_main_one_can_roll_out_too():
    passed = []

    def work():
        with terminable(), held_back() as let_through:
            let_through()
            passed.append(True)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert passed == [True]
