"""What no part of the package may do, read off its source: run foreign code, open a door, or leave its folder."""

import ast
import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import scla_mj
from scla_mj.cli.main import main
from scla_mj.experiments.catalogue import CATALOGUE
from scla_mj.extras import EXTRA_OF

PACKAGE = Path(scla_mj.__file__).parent
ROOT = Path(__file__).parents[1]
MODULES = sorted(PACKAGE.rglob("*.py"))
SOURCES = [*MODULES, *sorted((ROOT / "scripts").rglob("*.py"))]
UNPICKLERS = {"pickle", "cPickle", "dill", "cloudpickle", "shelve", "marshal", "joblib", "yaml"}
DOORS = {"socketserver", "http.server", "xmlrpc", "asyncio", "websockets", "flask", "urllib", "requests", "ftplib"}
SERVING = {"serve", "serve_grpc", "serve_web", "serve_web_viewer", "connect_grpc", "spawn"}
LOADERS = {"brain/registry.py", "cli/bench.py"}
"""The one place that imports by name: the brain that the user named."""


def name_of(path):
    return str(path.relative_to(ROOT if ROOT in path.parents else PACKAGE.parent))


def calls(path):
    return [node for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(node, ast.Call)]


def imported(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield str(node.module)


def keyword(call, name):
    return next((ast.unparse(word.value) for word in call.keywords if word.arg == name), None)


@pytest.mark.parametrize("path", SOURCES, ids=name_of)
def test_nothing_is_evaluated_unpickled_or_given_to_a_shell(path):
    for call in calls(path):
        what = ast.unparse(call.func)
        assert what not in {
            "eval",
            "exec",
            "compile",
            "__import__",
            "os.system",
            "os.popen",
            "os.execv",
            "os.spawnv",
        }, what
        assert keyword(call, "shell") in (None, "False"), f"{what} with a shell"
        assert keyword(call, "allow_pickle") in (None, "False"), f"{what} would unpickle"
        if what in {"np.load", "numpy.load", "np.lib.format.read_array"}:
            assert keyword(call, "allow_pickle") == "False", f"{what} must say allow_pickle=False"
    assert not {module.split(".")[0] for module in imported(path)} & UNPICKLERS


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_no_door_is_opened_to_the_network(path):
    assert not {module for module in imported(path) if module in DOORS or module.split(".")[0] in DOORS | {"socket"}}
    for call in calls(path):
        library, _, function = ast.unparse(call.func).rpartition(".")
        served = function in SERVING and library in {"rr", "rerun", "rr.grpc", "self._stream", "stream"}
        assert not served, f"{function}: a viewer may only be reached on 127.0.0.1, and this test must see that"


FROM_A_TABLE = {("__init__.py", "_PLACES[name]"), ("extras.py", "library"), ("opengl.py", "f'mujoco.{name}'")}


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_only_the_brain_that_the_user_names_is_imported_by_its_name(path):
    by_name = [call for call in calls(path) if ast.unparse(call.func).endswith("import_module")]
    if str(path.relative_to(PACKAGE)) in LOADERS:
        assert len(by_name) == 1
        return
    for call in by_name:  # elsewhere: the names of our own modules, in a process of their own or from a fixed table
        own = "worker" in path.name and isinstance(call.args[0], ast.JoinedStr)
        assert own or (path.name, ast.unparse(call.args[0])) in FROM_A_TABLE


def test_libraries_of_extras_are_imported_by_names_that_stand_in_the_code():
    named = [call.args[0] for path in MODULES for call in calls(path) if ast.unparse(call.func) == "need"]
    assert len(named) > 3 and all(isinstance(name, ast.Constant) and name.value in EXTRA_OF for name in named)


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_a_script_is_run_only_in_the_process_that_was_named_for_it(path):
    assert str(path.relative_to(PACKAGE)) == "brain/bridge_child.py" or "runpy" not in set(imported(path))


def test_the_programs_that_are_started_are_our_own_with_words_not_a_line():
    for path in MODULES:
        for call in calls(path):
            if ast.unparse(call.func) in {"subprocess.run", "subprocess.Popen"}:
                assert not isinstance(call.args[0], ast.Constant | ast.JoinedStr), (
                    f"{name_of(path)} starts a line of text"
                )


def test_every_name_of_the_catalogue_is_a_plain_folder_name():
    for experiment in CATALOGUE:
        assert Path(experiment.name).name == experiment.name not in ("", ".", "..")
        assert "\\" not in experiment.name and experiment.name.isascii()


def test_an_experiment_is_named_from_the_catalogue_and_leads_nowhere_else(tmp_path, capsys):
    for name in ("../elsewhere", "/etc", "scla-printed-any-start/../../x"):
        assert main(["reproduce", str(tmp_path / "out"), "--only", name]) == 2
        assert "is not an experiment" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_links_in_a_folder_are_never_written_through(tmp_path, capsys):
    precious = tmp_path / "precious.txt"
    precious.write_text("mine")
    run = tmp_path / "run"
    run.mkdir()
    (run / "summary.json").symlink_to(precious)
    assert main(["rollout", str(run), "--epochs", "1", "--decisions", "2", "--telemetry", "off"]) == 2
    assert "already holds a run" in capsys.readouterr().err
    out = tmp_path / "out" / "runs" / "random-any-start"
    out.mkdir(parents=True)
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "precious.txt").write_text("mine")
    (out / "seed-200").mkdir()
    (out / "seed-200" / "brain.npz").symlink_to(tmp_path / "elsewhere" / "precious.txt")
    options = ["--only", "random-any-start", "--seeds", "1", "--epochs", "1", "--decisions", "2", "--workers", "1"]
    assert main(["reproduce", str(tmp_path / "out"), *options]) == 2
    assert "already holds a run (brain.npz is there)" in capsys.readouterr().err
    assert precious.read_text() == (tmp_path / "elsewhere" / "precious.txt").read_text() == "mine"


def test_others_files_in_a_runs_place_are_left_alone(tmp_path):
    place = tmp_path / "out" / "runs" / "random-any-start" / "seed-200"
    place.mkdir(parents=True)
    (place / "notes.txt").write_text("mine")
    options = ["--only", "random-any-start", "--seeds", "1", "--epochs", "1", "--decisions", "2", "--workers", "1"]
    assert main(["reproduce", str(tmp_path / "out"), *options]) == 0
    assert (place / "notes.txt").read_text() == "mine"


def test_a_run_says_nothing_of_who_ran_it_or_where(tmp_path):
    run = tmp_path / "a-telling-name" / "run"
    assert main(["rollout", str(run), "--epochs", "1", "--decisions", "2", "--brain", "random"]) == 0
    content = json.loads((run / "config.json").read_text())
    assert "a-telling-name" not in json.dumps(content)
    assert not [file.name for file in run.iterdir() if b"a-telling-name" in file.read_bytes()]
    shutil.rmtree(run)


def test_a_program_started_for_reading_imports_nothing_from_the_working_directory(tmp_path):
    from scla_mj.telemetry.reading import probe

    (tmp_path / "rerun_bindings.py").write_text("raise SystemExit('imported from the working directory')")
    done = subprocess.run([sys.executable, probe.__file__, "no-such.rrd"], cwd=tmp_path, capture_output=True, text=True)
    assert "imported from the working directory" not in done.stderr
