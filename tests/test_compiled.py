"""Compiled code is kept where it can be, and a machine where nothing is writable compiles it anew."""

import importlib.util

import pytest

SOURCE = """
from scla_mj.compiled import cached_njit

@cached_njit(nogil=True)
def double(x):
    return 2 * x
"""


def load(folder):
    file = folder / "source.py"
    file.write_text(SOURCE)
    spec = importlib.util.spec_from_file_location("source", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def nowhere(tmp_path, monkeypatch):
    """A file where a folder is wanted cannot be written into, not even by root."""
    file = tmp_path / "file"
    file.touch()
    for variable in ("HOME", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.setenv(variable, str(file))
    return file


def test_a_function_runs_where_no_cache_can_be_kept(tmp_path, nowhere):
    (tmp_path / "__pycache__").write_text("a file, no folder")
    assert load(tmp_path).double(21) == 42
    assert not list(tmp_path.rglob("*.nbi"))


def test_compiled_code_is_kept_beside_the_source(tmp_path, nowhere):
    assert load(tmp_path).double(21) == 42
    assert len(list((tmp_path / "__pycache__").glob("source.double*.nbi"))) == 1
