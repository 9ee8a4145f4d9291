"""A run as a unit of work: asked for any number of times, by any number of processes, it is made once."""

import dataclasses
import shutil
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import pytest
from stopped_runs import QUICK, assert_same_run, stop_after, stopped, whole

from scla_mj.brain.base import Brain
from scla_mj.cli.main import main
from scla_mj.engine.ensure import OtherSettingsError, ensure
from scla_mj.engine.resume import resume
from scla_mj.engine.rollout import rollout
from scla_mj.errors import SclaError
from scla_mj.grid import Action
from scla_mj.runs.seal import broken_files, is_sealed
from scla_mj.signals import Decision

TINY = dataclasses.replace(QUICK, brain="random", epochs=1, decisions=8)


class Stateless(Brain):
    """Goes up for ever, and cannot be resumed."""

    reads = ()

    def __init__(self, checked):
        """Keep nothing."""

    def decide(self, percept):
        return Decision(Action.UP)

    def learn(self, feedback):
        """Learn nothing."""


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_a_complete_run_is_returned_as_it_is_even_where_nothing_can_be_written(tmp_path):
    made = ensure(TINY, tmp_path / "run")
    before = contents(tmp_path / "run")
    (tmp_path / "run").chmod(0o500)
    assert ensure(TINY, tmp_path / "run" / ".." / "run") == made
    assert contents(tmp_path / "run") == before


def test_a_stopped_run_and_one_that_was_hardly_begun_are_finished_to_the_same_bits(tmp_path):
    expected = whole(QUICK, tmp_path / "whole")
    stopped(QUICK, tmp_path / "stopped", 20)
    begun = tmp_path / "begun"
    begun.mkdir()
    shutil.copy(expected / "config.json", begun)
    (begun / ".config.json.77-1.tmp").write_text("{")
    (begun / ".lock").touch()
    (tmp_path / "empty").mkdir()
    (tmp_path / "empty" / ".config.json.77-1.tmp").write_text("{")
    for name in ("stopped", "begun", "empty"):
        ensure(QUICK, tmp_path / name)
        assert_same_run(expected, tmp_path / name)
        assert not [file for file in (tmp_path / name).iterdir() if file.name.startswith(".")]


def test_a_run_of_other_settings_and_a_damaged_one_are_told_and_left(tmp_path):
    stopped(TINY, tmp_path / "run", 3)
    before = contents(tmp_path / "run")
    with pytest.raises(OtherSettingsError, match="holds a run with other settings"):
        ensure(dataclasses.replace(TINY, seed=5), tmp_path / "run")
    (tmp_path / "run" / "checkpoint.npz").write_bytes(before["checkpoint.npz"][:-1])
    with pytest.raises(SclaError, match=r"checkpoint\.npz is damaged"):
        ensure(TINY, tmp_path / "run")
    assert contents(tmp_path / "run") == before | {"checkpoint.npz": before["checkpoint.npz"][:-1]}


def test_a_brain_without_a_state_starts_its_run_again(tmp_path):
    config = dataclasses.replace(TINY, brain=Stateless)
    with pytest.raises(KeyboardInterrupt):
        rollout(config, tmp_path / "run", watch=stop_after(3), pictures=False)
    ensure(config, tmp_path / "run")
    assert_same_run(whole(config, tmp_path / "whole"), tmp_path / "run")


def test_of_many_who_ask_at_once_one_makes_the_run_and_the_others_are_told_that_it_is_in_use(tmp_path):
    together, link = Barrier(3), tmp_path / "link"
    link.symlink_to(tmp_path / "run")
    (tmp_path / "run").mkdir()

    def ask(path):
        together.wait()
        try:
            return ensure(TINY, path)
        except SclaError as error:
            return str(error)

    with ThreadPoolExecutor(3) as threads:
        answers = list(threads.map(ask, [tmp_path / "run", link, tmp_path / "." / "run"]))
    summaries = [answer for answer in answers if not isinstance(answer, str)]
    assert summaries
    assert all("is in use" in answer for answer in answers if isinstance(answer, str))
    assert ensure(TINY, link) == summaries[0]
    assert is_sealed(tmp_path / "run") and not broken_files(tmp_path / "run")


def test_a_run_whose_folder_is_moved_writes_nothing_into_the_one_that_takes_its_place(tmp_path):
    place, moved, other = tmp_path / "run", tmp_path / "moved", dataclasses.replace(TINY, seed=9)

    def move(record, epoch):
        if record.decision == 4:
            place.rename(moved)
            ensure(other, place)
            before.update(contents(place))

    before = {}
    with pytest.raises(SclaError, match="was moved or removed during its run"):
        rollout(TINY, place, watch=move, pictures=False, checkpoint_period_s=0.0)
    assert contents(place) == before
    resume(moved, pictures=False)
    assert_same_run(whole(TINY, tmp_path / "whole"), moved)


def test_a_run_that_is_stopped_before_its_first_decision_leaves_nothing_and_nobody_elses(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("mine")
    for name in ("new", "mine"):
        with pytest.raises(SclaError):
            ensure(dataclasses.replace(TINY, brain="no_such_module:Brain"), tmp_path / name)
    assert [path.name for path in tmp_path.rglob("*")] == ["mine", "notes.txt"]


def test_of_a_run_that_is_going_on_inspect_says_what_is_sound_or_that_it_is_in_use(tmp_path, capsys):
    said = []

    def look(record, epoch):
        said.append((main(["inspect", str(tmp_path / "run")]), *capsys.readouterr()))
        if record.decision == 7:  # as if another were in the middle of a write
            log = (tmp_path / "run" / "decisions.partial.arrows").read_bytes()
            (tmp_path / "run" / "decisions.partial.arrows").write_bytes(b"half")
            said.append((main(["inspect", str(tmp_path / "run")]), *capsys.readouterr()))
            (tmp_path / "run" / "decisions.partial.arrows").write_bytes(log)

    rollout(TINY, tmp_path / "run", watch=look, pictures=False, checkpoint_period_s=0.0)
    codes = [code for code, _, _ in said]
    assert codes == [0] * 7 + [2, 0]
    assert "is in use: its files change while they are read" in said[7][2] and said[7][1] == ""
    assert all(
        "sound, unfinished" in out and "another process is running it" in out for code, out, _ in said if code == 0
    )
