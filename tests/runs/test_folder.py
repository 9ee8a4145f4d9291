"""A run folder is made once, and opened again only if it is sound."""

import dataclasses
import json
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scla_mj import paths
from scla_mj.checked import check
from scla_mj.config import GridConfig, RunConfig
from scla_mj.errors import SclaError
from scla_mj.runs.atomic import read_json, write_json
from scla_mj.runs.folder import RUN_FILES, create, discard, made, open_run


def begin(path, config):
    with made(path) as place:
        return create(place, config)


def refused(call, *arguments):
    with pytest.raises(SclaError) as caught:
        call(*arguments)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_new_folder_is_made_with_its_parents_and_says_what_made_it(tmp_path):
    config = dataclasses.replace(RunConfig(), seed=7, grid=GridConfig((7, 7), (4, 4)))
    run = begin(tmp_path / "a" / "b", config)
    content = read_json(run.file(paths.CONFIG_JSON))
    assert (content["seed"], content["grid"]["cells"], content["protocol"]) == (7, [7, 7], "any-start")
    assert content["run_id"] == run.run_id == open_run(run.path).run_id
    named = {"mujoco", "numpy", "numba", "rerun-sdk", "pyarrow", "scla-mj", "python", "platform"}
    assert content["versions"].keys() == named
    assert open_run(run.path).config == config


def test_an_existing_folder_is_used_and_its_other_files_are_left_alone(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    begin(tmp_path, RunConfig())
    assert {path.name for path in tmp_path.iterdir()} == {"notes.txt", paths.CONFIG_JSON}


@pytest.mark.parametrize("name", RUN_FILES)
def test_a_folder_that_holds_any_file_of_a_run_is_refused_untouched(tmp_path, name):
    (tmp_path / name).write_bytes(b"precious")
    said = refused(begin, tmp_path, RunConfig())
    assert f"already holds a run ({name} is there)" in said
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [(name, b"precious")]


def test_of_runs_that_begin_at_once_in_one_folder_exactly_one_gets_it(tmp_path):
    together = Barrier(4)

    def compete(folder):
        together.wait()
        try:
            return begin(folder, RunConfig())
        except SclaError:
            return None

    with ThreadPoolExecutor(4) as threads:
        for round_ in range(20):
            runs = list(threads.map(compete, [tmp_path / str(round_)] * 4))
            assert sum(run is not None for run in runs) == 1


def test_a_discarded_run_takes_its_own_files_with_it_and_nothing_else(tmp_path):
    with made(tmp_path / "new") as new:
        discard(create(new, RunConfig()))
    assert not (tmp_path / "new").exists()
    (tmp_path / "notes.txt").write_text("mine")
    discard(begin(tmp_path, RunConfig()))
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_every_name_in_a_run_folder_is_guarded():
    names = {
        value
        for name, value in vars(paths).items()
        if name.isupper() and not name.endswith(("_XML", "_PATTERN", "LOCK", "WATCHED", "FIGURES"))
    }
    assert names == set(RUN_FILES)


def test_a_file_is_no_folder(tmp_path):
    (tmp_path / "file").write_text("")
    assert "is a file, not a folder" in refused(begin, tmp_path / "file", RunConfig())
    assert "choose another RUN" in refused(begin, tmp_path / "file" / "run", RunConfig())


def test_a_folder_that_cannot_be_written_to_is_refused():
    """/proc takes no folder from anybody, root included."""
    assert "cannot write /proc/run" in refused(begin, "/proc/run", RunConfig())


def test_a_file_is_whole_or_absent_when_the_disk_is_full(tmp_path):
    """A file-size limit stands in for the full disk; what was there stays."""
    script = (
        "import resource, sys; from pathlib import Path; from scla_mj.runs.atomic import write_json;"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000)); write_json(Path(sys.argv[1]), {'long': 'x' * 5000})"
    )
    target = tmp_path / "config.json"
    write_json(target, {"old": 1})
    run = subprocess.run([sys.executable, "-c", script, str(target)], capture_output=True, text=True, check=False)
    assert "SclaError: cannot write" in run.stderr.splitlines()[-1]
    assert read_json(target) == {"old": 1}
    assert [path.name for path in tmp_path.iterdir()] == ["config.json"]


@pytest.mark.parametrize("damage", [("250", "251"), ('"seed"', '"sead"'), ("digest", "digist"), ("0.5", "0.6")])
def test_json_of_which_a_digit_or_a_letter_has_changed_is_refused(tmp_path, damage):
    path = tmp_path / "config.json"
    write_json(path, {"decisions": 250, "seed": 3, "rate": 0.5, "cells": (5, 5)})
    assert read_json(path) == {"decisions": 250, "seed": 3, "rate": 0.5, "cells": [5, 5]}
    text = path.read_text()
    path.write_text(text.replace(*damage))
    with pytest.raises(SclaError, match="does not fit its own digest"):
        read_json(path)
    path.write_text(json.dumps(json.loads(text)))
    assert read_json(path)["seed"] == 3, "spaces do not count"


def test_json_without_a_digest_opens_only_where_it_may_be_written_by_hand(tmp_path):
    (tmp_path / "config.json").write_text('{"seed": 3}')
    assert read_json(tmp_path / "config.json", by_hand=True) == {"seed": 3}
    with pytest.raises(SclaError, match="digest"):
        read_json(tmp_path / "config.json")


def test_a_number_that_json_cannot_say_leaves_nothing_behind(tmp_path):
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_json(tmp_path / "config.json", {"x": float("nan")})
    assert list(tmp_path.iterdir()) == []


def set_key(content, path, value):
    *parents, key = path.split(".")
    for parent in parents:
        content = content[parent]
    if value is KeyError:
        del content[key]
    else:
        content[key] = value


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        ("grid.colour", "red", "grid.colour is not a setting: known are cells, target"),
        ("grid.target", KeyError, "grid.target is missing"),
        ("grid.target", [3], "grid.target is 3: it must hold 2 values"),
        ("grid.target", [3, "x"], "grid.target[1] is 'x': it must be a whole number"),
        ("grid.target", 3, "grid.target is 3: it must be a list"),
        ("grid.target", [9, 9], "the target (9, 9) is off the 5x5 grid"),
        ("grid", None, "grid is None: it must be an object of settings"),
        ("seed", 1.5, "seed is 1.5: it must be a whole number"),
        ("seed", True, "seed is True: it must be a whole number"),
        ("seed", -1, "seed is -1: it must be 0 to"),
        ("decisions", 0, "decisions is 0: it must be 1 to"),
        ("protocol", "no-start", "protocol is 'no-start': it must be one of any-start, sensed-start"),
        ("protocol", ["any-start"], "protocol is ['any-start']: it must be one of"),
        ("automaton.reward_rate", "half", "automaton.reward_rate is 'half': it must be a number"),
        ("automaton.reward_rate", True, "automaton.reward_rate is True: it must be a number"),
        ("automaton.reward_rate", 2, "automaton.reward_rate is 2: it must be 0 to 1"),
        ("automaton.reward_rate", 10**400, "it must be a finite number"),
        ("automaton.local_rule", 1, "automaton.local_rule is 1: it must be true or false"),
        ("clock.physics_step_ms", 3.0, "is not an integer multiple"),
    ],
)
def test_a_configuration_that_was_tampered_with_is_refused_by_its_key(tmp_path, path, value, said):
    run = begin(tmp_path, RunConfig())
    file = run.file(paths.CONFIG_JSON)
    content = read_json(file)
    set_key(content, path, value)
    write_json(file, content)
    message = refused(open_run, tmp_path)
    assert said in message
    assert str(file) in message


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b"null", b"\xff\xfe", b"[" * 100_000, b"{}", b'{"seed": 1}'])
def test_a_damaged_configuration_is_refused(tmp_path, content):
    (tmp_path / paths.CONFIG_JSON).write_bytes(content)
    assert paths.CONFIG_JSON in refused(open_run, tmp_path)


def test_what_is_no_run_folder_is_not_opened(tmp_path):
    assert "is not a run folder" in refused(open_run, tmp_path / "absent")
    assert "config.json does not exist" in refused(open_run, tmp_path)
    (tmp_path / paths.CONFIG_JSON).mkdir()
    assert "it must be a file" in refused(open_run, tmp_path)


@given(st.floats(0.27, 3.0), st.integers(0, 2**63 - 1), st.booleans(), st.integers(3, 50))
def test_any_configuration_survives_the_way_to_its_file_and_back(number, seed, flag, width):
    config = RunConfig(seed=seed, grid=GridConfig(cells=(width, 3), cell_size_m=number), brain_settings={"x": [1, 0.5]})
    config = dataclasses.replace(config, automaton=dataclasses.replace(config.automaton, local_rule=flag))
    with tempfile.TemporaryDirectory() as folder:
        write_json(Path(folder) / "config.json", dataclasses.asdict(config))
        assert open_run(Path(folder)).config == check(config).config == config


def test_a_file_that_lacks_a_setting_is_refused_by_its_name(tmp_path):
    file = begin(tmp_path, RunConfig()).file(paths.CONFIG_JSON)
    content = read_json(file)
    del content["disturbance"]["friction_scale"]
    write_json(file, content)
    assert "disturbance.friction_scale is missing" in refused(open_run, tmp_path)
