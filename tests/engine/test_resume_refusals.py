"""What cannot be resumed is refused in one sentence, and left as it is."""

import dataclasses
import re
import shutil
import textwrap
from pathlib import Path

import pytest
from stopped_runs import QUICK, assert_same_run, refused, stopped, whole

from scla_mj.engine.lock import running
from scla_mj.engine.resume import resume
from scla_mj.engine.rollout import rollout
from scla_mj.errors import SclaError
from scla_mj.paths import recordings
from scla_mj.runs.atomic import read_json, write_json
from scla_mj.runs.checkpoint import read_checkpoint, write_checkpoint
from scla_mj.runs.summary import read_summary
from scla_mj.telemetry.reading.reader import inspect_recording

RECORDED = dataclasses.replace(QUICK, telemetry="light")
OWN_BRAIN = Path(__file__).parents[2] / "docs" / "own-brain.md"


@pytest.fixture(scope="module")
def cut(tmp_path_factory):
    return stopped(QUICK, tmp_path_factory.mktemp("cut") / "run", 20)


@pytest.fixture(scope="module")
def cut_recording(tmp_path_factory):
    return stopped(RECORDED, tmp_path_factory.mktemp("recorded") / "run", 20)


@pytest.fixture
def recorded(cut_recording, tmp_path):
    return shutil.copytree(cut_recording, tmp_path / "recorded")


@pytest.fixture
def run(cut, tmp_path):
    return shutil.copytree(cut, tmp_path / "run")


def test_a_complete_run_is_not_resumed(run):
    resume(run, pictures=False)
    assert "is complete: there is nothing to resume" in refused(run)


def test_a_run_that_another_process_is_running_is_not_resumed(run):
    with running(run):
        assert "is in use: another process is running it" in refused(run)
    resume(run, pictures=False)


def test_while_a_run_is_running_nobody_else_can_resume_it(tmp_path):
    def watch(record, epoch):
        with pytest.raises(SclaError, match="another process is running it"):
            resume(tmp_path / "run", pictures=False)

    rollout(dataclasses.replace(QUICK, epochs=1, decisions=2), tmp_path / "run", watch=watch, pictures=False)


def test_other_versions_than_the_run_began_with_are_refused_by_name(run):
    (run / "seal.json").unlink()
    config = read_json(run / "config.json")
    config["versions"]["mujoco"] = "3.99"
    write_json(run / "config.json", config)
    assert "began with mujoco 3.99 (here 3." in refused(run)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda config: config.update(seed=5), "does not belong to"),
        (lambda config: config.update(epochs=5), "does not belong to"),
        (lambda config: config.update(run_id="other"), "does not belong to"),
        (lambda config: config.update(seed=-1), "seed is -1"),
        (lambda config: config.pop("versions"), "scla-mj unknown"),
    ],
)
def test_a_checkpoint_of_another_run_is_refused(run, change, said):
    (run / "seal.json").unlink()
    config = read_json(run / "config.json")
    change(config)
    write_json(run / "config.json", config)
    assert said in refused(run)


def test_a_damaged_checkpoint_is_refused_and_the_run_can_start_again(run, tmp_path):
    path = run / "checkpoint.npz"
    sound = path.read_bytes()
    for place in range(0, len(sound), len(sound) // 20):
        path.write_bytes(sound[:place] + bytes([sound[place] ^ 1]) + sound[place + 1 :])
        assert "checkpoint.npz is damaged" in refused(run)
    path.unlink()
    resume(run, pictures=False)
    assert_same_run(whole(QUICK, tmp_path / "whole"), run)


@pytest.mark.parametrize(
    "name", ["config.json", "decisions.parquet", "summary.json", "brain.npz", "checkpoint.npz", "recording.rrd"]
)
def test_a_stopped_run_is_resumed_only_if_every_file_is_as_it_left_it(name, recorded):
    with (recorded / name).open("ab") as file:
        file.write(b"\n")
    assert f"{name} is damaged: its bytes are not those that the run wrote" in refused(recorded)
    if name != "checkpoint.npz":
        (recorded / name).unlink()
        assert re.search(rf"{re.escape(name)} (is missing: seal.json lists it|does not exist)", refused(recorded))


@pytest.fixture(scope="module")
def cut_killed(tmp_path_factory):
    """A run whose first part was stopped and whose second was killed, as its folder was then."""
    path = stopped(RECORDED, tmp_path_factory.mktemp("killed") / "run", 20)

    def copy(record, epoch):
        if (record.epoch, record.decision) == (2, 20):
            shutil.copytree(path, path.with_name("killed"))

    resume(path, watch=copy, pictures=False, checkpoint_period_s=0.0)
    return path.with_name("killed")


@pytest.fixture
def killed(cut_killed, tmp_path):
    return shutil.copytree(cut_killed, tmp_path / "killed")


@pytest.mark.parametrize("part", ["recording.rrd", "recording-2.rrd"])
def test_a_killed_run_does_not_go_on_from_a_damaged_recording(part, killed, tmp_path):
    vouched = {known["name"]: known["bytes"] for known in read_checkpoint(killed)["recorder"]["parts"]}
    assert list(vouched) == ["recording.rrd", "recording-2.rrd"]
    path, sound = killed / part, (killed / part).read_bytes()
    size = vouched[part]
    assert 100_000 < size <= len(sound)
    for place in (0, size // 2, size - 1):
        path.write_bytes(sound[:place] + bytes([sound[place] ^ 1]) + sound[place + 1 :])
        assert f"{part} is damaged, as its first {size} bytes are not those that the run wrote" in refused(killed)
    path.write_bytes(sound[: size - 1])
    assert f"{part} is damaged, as it holds {size - 1} bytes" in refused(killed)
    path.unlink()
    assert f"{part} is missing: fetch a sound copy, or move it and checkpoint.npz away" in refused(killed)
    path.write_bytes(sound)
    resume(killed, pictures=False)
    assert_same_run(whole(QUICK, tmp_path / "whole"), killed)
    assert inspect_recording(*recordings(killed)).decisions == 60


def test_the_remedy_for_a_damaged_recording_gives_the_whole_run(killed, tmp_path):
    (killed / "recording.rrd").unlink()
    (killed / "checkpoint.npz").unlink()
    resume(killed, pictures=False)
    assert_same_run(whole(QUICK, tmp_path / "whole"), killed)
    assert inspect_recording(*recordings(killed)).decisions == 60


def test_a_complete_run_that_was_damaged_is_not_called_complete(run):
    resume(run, pictures=False)
    (run / "brain.npz").write_bytes(b"")
    assert "brain.npz is damaged" in refused(run)


def test_a_checkpoint_that_lacks_a_part_or_fits_no_brain_is_refused(run):
    (run / "seal.json").unlink()
    state = read_checkpoint(run)
    for change in (
        {"simulation": {}},
        {"account": 3},
        {"recorder": None, "simulation": state["simulation"] | {"brain": {"rng": 1}}},
    ):
        write_checkpoint(run, state | change)
        assert "does not fit its own run" in refused(run)


def test_decisions_that_are_damaged_or_too_few_are_refused(run):
    (run / "seal.json").unlink()
    state = read_checkpoint(run)
    state["account"]["outcomes"]["moved"] += 5
    write_checkpoint(run, state)
    assert "of 25 decisions" in refused(run)
    (run / "decisions.parquet").unlink()
    said = refused(run)
    assert "decisions.partial.arrows is missing, the decisions that checkpoint.npz builds on: put it back" in said
    (run / "checkpoint.npz").unlink()  # the remedy that it names
    resume(run, pictures=False)
    assert read_summary(run).epochs[-1].decisions == QUICK.decisions


def test_what_is_no_run_is_not_resumed(tmp_path):
    with pytest.raises(SclaError, match="not a run folder"):
        resume(tmp_path / "nowhere")
    with pytest.raises(SclaError, match=r"config\.json does not exist"):
        resume(tmp_path)


OWN = """
import numpy as np
from scla_mj.brain import Brain
from scla_mj.grid import Action
from scla_mj.signals import Decision

class Plain(Brain):
    def __init__(self, checked):
        self.rng = np.random.Generator(np.random.PCG64(checked.config.seed))
    def decide(self, percept):
        return Decision(Action(int(self.rng.integers(4))))
    def learn(self, feedback):
        pass

class Half(Plain):
    def state(self):
        return {"rng": self.rng.bit_generator.state}

class Able(Half):
    def restore(self, state):
        self.rng.bit_generator.state = state["rng"]

class Wrong(Able):
    def state(self):
        return {"cells": {1, 2}}

class Broken(Able):
    def restore(self, state):
        raise RuntimeError("no")
"""


@pytest.fixture
def own(tmp_path, monkeypatch):
    (tmp_path / "own_brains_to_resume.py").write_text(OWN)
    monkeypatch.chdir(tmp_path)
    return lambda name: dataclasses.replace(QUICK, brain=f"own_brains_to_resume:{name}")


def test_a_users_brain_with_both_methods_is_resumed(own, tmp_path):
    resume(stopped(own("Able"), tmp_path / "cut", 20), brain=own("Able").brain, pictures=False)
    assert_same_run(whole(own("Able"), tmp_path / "whole"), tmp_path / "cut")


@pytest.mark.parametrize("name", ["Plain", "Half"])
def test_a_users_brain_that_lacks_one_runs_as_ever_but_is_not_resumed(name, own, tmp_path):
    path = stopped(own(name), tmp_path / "cut", 20)
    assert not (path / "checkpoint.npz").exists()
    assert "cannot be resumed: give its class state() and restore()" in refused(path, brain=own(name).brain)


def test_a_users_mistakes_in_them_are_told_in_a_sentence(own, tmp_path):
    with pytest.raises(SclaError, match=r"its state\(\) returns what no checkpoint can hold: cells is set"):
        rollout(own("Wrong"), tmp_path / "wrong", pictures=False, checkpoint_period_s=0.0)
    path = stopped(own("Broken"), tmp_path / "broken", 20)
    assert "its restore() raised RuntimeError" in refused(path, brain=own("Broken").brain)


TELLTALE = """
from pathlib import Path
Path("imported").touch()
"""


def test_no_code_is_imported_that_the_run_names_but_the_user_does_not(run, tmp_path, monkeypatch):
    (tmp_path / "telltale_brain.py").write_text(TELLTALE)
    monkeypatch.chdir(tmp_path)
    (run / "seal.json").unlink()
    write_json(run / "config.json", read_json(run / "config.json") | {"brain": "telltale_brain:Able"})
    said = (
        "was made by --brain telltale_brain:Able, which is code of its own: name it again, --brain telltale_brain:Able"
    )
    for brain in (None, "scla", "os:system", "telltale_brain:Other"):
        assert said in refused(run, brain=brain)
    assert not (tmp_path / "imported").exists()
    assert "has no class Able" in refused(run, brain="telltale_brain:Able")
    assert (tmp_path / "imported").exists()


def test_a_run_of_the_library_is_not_resumed_with_another_brain(run):
    assert "was made by --brain scla, not by --brain random" in refused(run, brain="random")


def test_the_documented_methods_make_the_documented_brain_resumable(tmp_path, monkeypatch):
    brain, _, methods = re.findall(r"```python\n(.*?)```", OWN_BRAIN.read_text(encoding="utf-8"), re.DOTALL)
    (tmp_path / "documented_brain.py").write_text(brain + "\n" + textwrap.indent(methods, "    "))
    monkeypatch.chdir(tmp_path)
    config = dataclasses.replace(QUICK, brain="documented_brain:LastGoodMove", protocol="sensed-start")
    resume(stopped(config, tmp_path / "cut", 25), brain=config.brain, pictures=False)
    assert_same_run(whole(config, tmp_path / "whole"), tmp_path / "cut")
