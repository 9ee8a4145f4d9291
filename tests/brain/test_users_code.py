"""A user's code may do what code does: the run stays as it was, and a mistake is one sentence."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from scla_mj.brain.users_code import describe, shown, users_code
from scla_mj.cli.main import main
from scla_mj.errors import SclaError
from scla_mj.runs.decisions import read_decisions

BRAIN = """
import os
import sys
import numpy as np
from scla_mj import Action, Brain, Decision, Snapshot

class Mine(Brain):
    made = 0

    def decide(self, percept):
        self.made += 1
        return self.answer() if self.made == 3 else Decision(Action.UP)

    def answer(self):
        return Decision(Action.UP)

    def learn(self, feedback):
        pass

"""


def rollout(folder, monkeypatch, name, body, *more):
    """Run five decisions of a brain with these methods; returns the exit code."""
    text = BRAIN + "\n".join(f"    {line}" for line in body.splitlines())
    (folder / f"{name}.py").write_text(text)
    monkeypatch.chdir(folder)
    options = ["--brain", f"{name}:Mine", "--epochs", "1", "--decisions", "5", "--telemetry", "off", *more]
    return main(["rollout", "run", *options])


def test_a_brain_may_import_late_and_change_directory(tmp_path, monkeypatch):
    (tmp_path / "late_helper.py").touch()
    (tmp_path / "elsewhere").mkdir()
    body = """def answer(self):
    import late_helper
    os.chdir('elsewhere')
    np.seterr(all='raise')
    return Decision(Action.UP)
def learn(self, feedback):
    assert os.getcwd().endswith('elsewhere') == (self.made >= 3)"""
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])  # as for a script of this folder
    path, errors = list(sys.path), np.geterr()
    assert rollout(tmp_path, monkeypatch, "wandering", body) == 0
    assert read_decisions(tmp_path / "run").num_rows == 5
    assert (Path.cwd(), sys.path, np.geterr()) == (tmp_path, path, errors)


@pytest.mark.parametrize(
    ("name", "answer", "words"),
    [
        ("leaving", "sys.exit(0)", "raised SystemExit: 0"),
        ("odd", "raise type('Odd', (BaseException,), {})('x')", "raised Odd: x"),
        ("mute", "return type('R', (), {'__repr__': lambda s: 1 / 0})()", "<its repr() raises ZeroDivisionError> (R)"),
        ("weird", "return type('C', (), {'__class__': property(lambda s: 1 / 0)})()", "raised ZeroDivisionError"),
        ("library", "from scla_mj import Network; Network(seed=-1)", "raised SclaError: "),
    ],
)
def test_whatever_a_brain_raises_or_returns_is_a_sentence_and_keeps_what_was_made(
    name, answer, words, tmp_path, monkeypatch, capsys
):
    assert rollout(tmp_path, monkeypatch, f"brain_{name}", f"def answer(self):\n    {answer}") == 2
    (sentence,) = [line for line in capsys.readouterr().err.splitlines() if line.startswith("scla-mj: ")]
    assert sentence.startswith(f"scla-mj: --brain brain_{name}:Mine: its decide() ")
    assert words in sentence
    assert "must return" in sentence or f"{tmp_path}/brain_{name}.py line " in sentence
    assert read_decisions(tmp_path / "run").num_rows == 2


@pytest.mark.parametrize(
    ("name", "body", "words"),
    [
        ("memory", "def snapshot(self): return Snapshot(probabilities=np.ones(3))", "its snapshot() must"),
        ("state", "def state(self): raise ValueError('no')\ndef restore(self, state): pass", "its state() raised"),
        ("long", "def state(self): return {'n': 10**5000}\ndef restore(self, state): pass", "its state() raised"),
        ("sensors", "@property\ndef sensors(self): return 1 / 0", "its sensors raised ZeroDivisionError"),
        ("plain", "def __init__(self): pass", "takes 1 positional argument but 2 were given"),
    ],
)
def test_what_would_fail_at_the_end_is_refused_at_the_start(name, body, words, tmp_path, monkeypatch, capsys):
    assert rollout(tmp_path, monkeypatch, f"early_{name}", body) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_a_state_may_hold_numpys_numbers_and_resuming_takes_them_as_plain_ones(tmp_path, monkeypatch, capsys):
    body = """def answer(self):
    raise KeyboardInterrupt
def state(self):
    return {'made': np.int64(self.made), 'x': np.float32(0.1), 'on': np.bool_(True)}
def restore(self, state):
    assert state == {'made': 2, 'x': float(np.float32(0.1)), 'on': True}, state
    self.made = 3"""
    assert rollout(tmp_path, monkeypatch, "plain_numbers", body, "--checkpoint-period-s", "0") == 130
    assert main(["resume", "run", "--brain", "plain_numbers:Mine"]) == 0, capsys.readouterr().err
    assert read_decisions(tmp_path / "run").num_rows == 5


def test_a_stopped_run_of_a_brain_without_a_state_is_not_promised_to_continue(tmp_path, monkeypatch, capsys):
    assert rollout(tmp_path, monkeypatch, "forgetful", "def answer(self): raise KeyboardInterrupt") == 130
    assert "resume" not in capsys.readouterr().err
    assert main(["inspect", "run"]) == 0
    assert "no checkpoint: scla-mj resume run --brain forgetful:Mine starts it again, if its brain has state()" in (
        capsys.readouterr().out
    )


@pytest.mark.parametrize("name", ["my_brain.py:Mine", "./my_brain.py:Mine", "./my_brain:Mine"])
def test_a_file_instead_of_a_module_is_refused_with_the_modules_name(name, capsys):
    assert main(["rollout", "run", "--brain", name]) == 2
    assert f"--brain {name} names a file: name its module as in an import, --brain my_brain:Mine" in (
        capsys.readouterr().err
    )


def test_a_file_without_a_class_is_told_to_name_both(capsys):
    assert main(["rollout", "run", "--brain", "./my_brain.py"]) == 2
    assert "name its module and a class in it, such as my_brain:MyBrain" in capsys.readouterr().err


def test_a_module_that_another_hides_is_named_by_its_file(capsys):
    assert main(["rollout", "run", "--brain", "string:Mine"]) == 2
    assert f"the module string ({sys.modules['string'].__file__}) has no class Mine" in capsys.readouterr().err


FORKING = """
import os, sys
from scla_mj.brain.users_code import users_code
with users_code("its decide() raised"):
    if os.fork() == 0:
        sys.exit(3)
    os.wait()
print("one run")
"""


def test_a_process_that_a_brain_forks_never_goes_on_with_the_run():
    done = subprocess.run([sys.executable, "-c", FORKING], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (0, "one run\n", "")


def test_a_working_directory_that_was_removed_is_no_mistake(tmp_path, monkeypatch):
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    with users_code("it raised"):
        pass
    with pytest.raises(SclaError, match="it raised FileNotFoundError"), users_code("it raised"):
        Path("nowhere").stat()


def test_messages_are_short_and_printed_whatever_they_are():
    assert len(describe(ValueError("a\nb " * 10_000))) < 400
    assert describe(type("E", (Exception,), {"__str__": lambda self: 1 / 0})()) == (
        "E: <its str() raises ZeroDivisionError>"
    )
    assert shown("x" * 100).startswith("'xxx")


CLOSING = """
import sys, threading
import scla_mj.__main__ as start
from scla_mj.brain.users_code import users_code

start._PATIENCE_S = 0.1
with users_code("it raised"):
    sys.stdout.close()
    threading.Thread(target=threading.Event().wait).start()
print("nowhere")
sys.exit(start.main(["--version"]))
"""


def test_closed_streams_and_threads_without_an_end_do_not_keep_a_command_from_its_end():
    done = subprocess.run([sys.executable, "-c", CLOSING], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
