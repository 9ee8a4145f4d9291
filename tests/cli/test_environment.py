"""What the environment asks of libraries neither changes a run nor keeps it from running."""

import os
import subprocess
import sys

import pytest

from scla_mj.cli.main import main

OPTIONS = ["--brain", "automaton", "--epochs", "1", "--decisions", "12", "--seed", "3"]
BITS = ("decisions.parquet", "brain.npz", "learning.png", "policy.png")

LIBRARIES = {
    "MPLBACKEND": "module://matplotlib_inline.backend_inline",  # as every notebook exports it
    "MATPLOTLIBRC": "style",
    "MPLCONFIGDIR": "/dev/null",
    "RERUN": "0",
    "RERUN_STRICT": "1",
    "RERUN_FLUSH_NUM_BYTES": "junk",
    "_RERUN_TEST_FORCE_SAVE": "forced.rrd",
    "RUST_LOG": "trace",
    "MUJOCO_GL": "nosuch",
    "PYOPENGL_PLATFORM": "nosuch",
    "PYTHON_TYRO_ENABLE_TIMING": "junk",
    "NUMBA_DISABLE_JIT": "1",
    "SOURCE_DATE_EPOCH": "junk",
    "ARROW_DEFAULT_MEMORY_POOL": "nosuch",
    "NPY_PROMOTION_STATE": "legacy",
    "OMP_NUM_THREADS": "junk",
    "JAX_PLATFORMS": "nosuch",
}
SYSTEM = {
    "HOME": "/dev/null",
    "XDG_CACHE_HOME": "/dev/null",
    "TMPDIR": "/nonexistent",
    "PYTHONWARNINGS": "error",
    "PYTHONHASHSEED": "7",
    "PYTHONIOENCODING": "ascii",
    "PYTHONUTF8": "0",
    "LC_ALL": "C",
    "TZ": "Nowhere/Junk",
    "COLUMNS": "1",
    "LINES": "junk",
    "TERM": "dumb",
    "FORCE_COLOR": "1",
}
STYLE = "backend: nosuch\nfont.size: 30\ntext.usetex: True\nsavefig.dpi: 20\naxes.facecolor: red\nsavefig.bbox: tight\n"
SHADOWS = ("scla_mj", "benchmarks", "numpy", "rerun", "matplotlib", "random", "json", "inspect")

FROM_PYTHON = """
import os, scla_mj
scla_mj.rollout(scla_mj.RunConfig(brain="automaton", epochs=1, decisions=12, seed=3), "run")
assert os.environ["MPLBACKEND"].endswith("inline")  # the program's own figures are its own
"""


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    path = tmp_path_factory.mktemp("plain") / "run"
    assert main(["rollout", str(path), *OPTIONS]) == 0
    return path


@pytest.fixture
def odd_folder(tmp_path):
    """A working directory with a style of matplotlib's and with modules named as those that a run imports."""
    for place in (tmp_path, tmp_path / "style"):
        place.mkdir(exist_ok=True)
        (place / "matplotlibrc").write_text(STYLE)
    for name in SHADOWS:
        (tmp_path / f"{name}.py").write_text("raise SystemError('imported from the working directory')")
    return tmp_path


def assert_same_run(run, plain):
    assert sorted(file.name for file in run.iterdir()) == sorted(file.name for file in plain.iterdir())
    for name in BITS:
        assert (run / name).read_bytes() == (plain / name).read_bytes(), name


@pytest.mark.parametrize("variables", [LIBRARIES, SYSTEM], ids=["libraries", "system"])
def test_a_command_does_the_same_whatever_the_environment_says(variables, plain, odd_folder, capsys):
    command = [sys.executable, "-P", "-m", "scla_mj.cli.main", "rollout", "run", *OPTIONS]
    done = subprocess.run(command, cwd=odd_folder, env=os.environ | variables, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert b"Traceback" not in done.stderr and b"WARN" not in done.stderr
    assert_same_run(odd_folder / "run", plain)
    assert main(["inspect", str(odd_folder / "run")]) == 0
    assert "sound, complete" in capsys.readouterr().out


def test_a_run_from_python_keeps_its_recording_and_its_figures_too(plain, tmp_path):
    variables = {name: LIBRARIES[name] for name in ("MPLBACKEND", "RERUN", "MUJOCO_GL", "_RERUN_TEST_FORCE_SAVE")}
    subprocess.run([sys.executable, "-c", FROM_PYTHON], cwd=tmp_path, env=os.environ | variables, check=True)
    assert_same_run(tmp_path / "run", plain)


def test_tables_are_whole_on_a_terminal_of_no_width(plain, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "1")
    assert main(["inspect", "--verbose", str(plain)]) == 0
    assert "ceiling, per 1000" in capsys.readouterr().out
