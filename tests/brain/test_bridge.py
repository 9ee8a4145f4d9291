"""A brain in another Python: it decides as one of ours, and whatever its process does is one sentence."""

import ast
import platform
import sys
from pathlib import Path

import numpy as np
import pytest

import scla_mj
from scla_mj.brain import bridge_child
from scla_mj.cli.main import main
from scla_mj.runs.decisions import read_decisions

BRAIN = """
import os, signal, sys, time
from dataclasses import dataclass

print("a banner")

class Brain:
    @dataclass(frozen=True)
    class Settings:
        stride: int = 1
        word: "str" = "x"

    def __init__(self, run, settings):
        self.made, self.told, self.stride = run.seed, [], settings.stride

    def decide(self, percept):
        assert len(percept.cell) == 2 and percept.sensed in (None, 0, 1, 2, 3) and not sys.stdin.read()
        self.made += self.stride
        return self.odd() if self.made == 3 else self.made % 4

    def odd(self):
        return {"action": 3}

    def learn(self, feedback):
        assert feedback.action == (self.made % 4) and feedback.duration_s > 0
        self.told.append(feedback.hit + feedback.after.cell[0] / 7)
"""
STATE = """
def state(self):
    return {"made": self.made, "told": self.told, "big": 1 << 100}
def restore(self, state):
    self.made, self.told = state["made"], state["told"]
    assert state["big"] == 1 << 100
"""


def rollout(folder, monkeypatch, body="", *more, run="run", python=sys.executable):
    """Run five decisions of a brain with these methods; returns the exit code."""
    (folder / "mine.py").write_text(BRAIN + "\n".join(f"    {line}" for line in body.splitlines()) + "\n")
    monkeypatch.chdir(folder)
    options = ["--brain", f"{python}:mine.py", "--epochs", "1", "--decisions", "5", "--telemetry", "off", *more]
    return main(["rollout", run, *options])


def sentence(capfd):
    (found,) = [line for line in capfd.readouterr().err.splitlines() if line.startswith("scla-mj: ")]
    return found


def test_it_decides_with_settings_of_its_own_and_what_it_prints_goes_to_stderr(tmp_path, monkeypatch, capfd):
    assert rollout(tmp_path, monkeypatch, "", "--brain.stride", "2", "--seed", "4") == 0
    assert read_decisions(tmp_path / "run")["action"].to_pylist() == ["left", "up", "left", "up", "left"]
    said = capfd.readouterr()
    assert "a banner" in said.err and "a banner" not in said.out
    named = ["--brain", f"{sys.executable}:mine.py", "--brain.word", "x"]
    assert main(["rollout", "other", *named, "--brain.gain", "2"]) == 2
    assert "--brain.gain" in sentence(capfd)


@pytest.mark.parametrize(
    ("odd", "words"),
    [
        ("os._exit(3)", "its process ended in its decide(), with exit code 3"),
        ("os.kill(os.getpid(), signal.SIGKILL)", "its process ended in its decide(), by signal SIGKILL"),
        ("time.sleep(60)", "its decide() gave no answer within 0.5 s (--brain.answer-within-s)"),
        ("os.write(4, b'what\\n')", "its decide() gave what is no answer: b'what"),
        ("os.write(4, b'[1]\\n')", "its decide() gave what is no answer: b'[1]"),
        ("return 7", "its decide() must return 0 to 3 (up, down, left, right), or a dict with action"),
        ("return object()", "its decide() raised TypeError: object is neither plain data nor an array of numbers"),
        ("sys.exit(0)", "its decide() raised SystemExit: 0, mine.py line 2"),
        ("return {'action': 1, 'motor_spikes': [-1, 0, 0, 0]}", "motor_spikes"),
    ],
)
def test_whatever_the_process_does_is_a_sentence_and_the_run_stays_sound(odd, words, tmp_path, monkeypatch, capfd):
    limit = ("--brain.answer-within-s", "0.5") if "sleep" in odd else ()
    assert rollout(tmp_path, monkeypatch, f"def odd(self):\n    {odd}", *limit) == 2
    assert words in sentence(capfd)
    assert read_decisions(tmp_path / "run").num_rows == 2
    assert main(["inspect", "run"]) == 0


@pytest.mark.parametrize(
    ("name", "words"),
    [
        (":mine.py", "names no Python: write PYTHON:mine.py"),
        ("no/python:mine.py", "no/python cannot be started: No such file or directory"),
        ("{python}:yours.py", "the script yours.py cannot be read: No such file or directory"),
        ("/bin/true:mine.py", "its process ended in its script, with exit code 0"),
        ("/bin/echo:mine.py", "its script gave what is no answer: b'"),
        ("{python}:broken.py", "its script raised ModuleNotFoundError: No module named 'no_such', broken.py line 1"),
        ("{python}:empty.py", "its script raised TypeError: the script has no class Brain"),
        ("{python}:list.py", "a setting must be one of bool, int, float, str, with a default; KeyError('list')"),
        ("{python}:odd.py", "its anatomy must be a dict of populations, (name, size, role) each"),
    ],
)
def test_what_cannot_be_started_is_refused_and_leaves_nothing(name, words, tmp_path, monkeypatch, capfd):
    made = "class Brain:\n    def __init__(self, run):\n        self.anatomy = {'populations': 5}\n"
    settings = "    import dataclasses\n    @dataclasses.dataclass\n    class Settings:\n        x: list = None\n"
    texts = {"mine": BRAIN, "broken": "import no_such", "empty": "", "odd": made}
    for file, text in (texts | {"list": made + settings}).items():
        (tmp_path / f"{file}.py").write_text(text)
    monkeypatch.chdir(tmp_path)
    assert main(["rollout", "run", "--brain", name.format(python=sys.executable)]) == 2
    assert words in sentence(capfd)
    assert not (tmp_path / "run").exists()


def test_a_run_goes_on_after_its_process_died_as_if_it_had_not(tmp_path, monkeypatch, capfd):
    dies = f"def odd(self):\n    return 3 if os.path.exists('cured') else os._exit(1)\n{STATE}"
    assert rollout(tmp_path, monkeypatch, dies, "--checkpoint-period-s", "0") == 2
    (tmp_path / "cured").touch()
    assert main(["resume", "run"]) == 2
    assert "is code of its own: name it again" in capfd.readouterr().err
    assert main(["resume", "run", "--brain", f"{sys.executable}:mine.py"]) == 0
    assert rollout(tmp_path, monkeypatch, dies, run="whole") == 0
    assert scla_mj.load_run("run").versions["bridge.python"] == platform.python_version()
    assert (tmp_path / "run/decisions.parquet").read_bytes() == (tmp_path / "whole/decisions.parquet").read_bytes()


def test_one_without_a_state_says_that_it_cannot_be_resumed(tmp_path, monkeypatch, capfd):
    assert rollout(tmp_path, monkeypatch, "def odd(self): os._exit(1)") == 2
    assert main(["resume", "run", "--brain", f"{sys.executable}:mine.py"]) == 2
    assert "cannot be resumed" in capfd.readouterr().err


def test_the_script_of_the_docs_runs(tmp_path, monkeypatch):
    page = (Path(__file__).parents[2] / "docs" / "bridge.md").read_text(encoding="utf-8")
    (tmp_path / "mine.py").write_text(page.split("```python\n")[1].split("```")[0])
    monkeypatch.chdir(tmp_path)
    options = ["--protocol", "sensed-start", "--epochs", "1", "--decisions", "3", "--telemetry", "off"]
    assert main(["rollout", "run", "--brain", f"{sys.executable}:mine.py", *options]) == 0
    rows = read_decisions(tmp_path / "run")
    assert rows["action"] == rows["sensed"] and sum(rows["hit"].to_pylist()) == 3


@pytest.mark.parametrize("array", [np.arange(6.0).reshape(2, 3), np.zeros((0, 2), np.int32), np.array([True])])
def test_arrays_cross_to_the_bit(array):
    found = bridge_child.unpacked(bridge_child.packed({"a": [array, array.dtype.type(1)]}).encode())["a"]
    assert found[0].dtype == array.dtype and np.array_equal(found[0], array) and found[1] == 1


def test_no_array_of_objects_is_made_of_what_comes():
    with pytest.raises(ValueError, match="holds no numbers"):
        bridge_child.unpacked(b'{"$array": "|O", "shape": [1], "data": "AAAAAAAAAAA="}')


def test_the_other_side_needs_the_standard_library_alone_and_old_pythons_can_read_it():
    tree = ast.parse(Path(bridge_child.__file__).read_text(encoding="utf-8"), feature_version=(3, 8))
    named = {alias.name for node in tree.body if isinstance(node, ast.Import) for alias in node.names}
    assert named <= set(sys.stdlib_module_names)
