"""Compiled code is kept where it can be, and a machine where nothing is writable compiles it anew."""

import importlib.util
import sys

import pytest

SOURCE = """
from scla_mj.compiled import cached_njit

@cached_njit(nogil=True)
def double(x):
    return 2 * x
"""


def load(folder, text=SOURCE, name="source"):
    file = folder / f"{name}.py"
    file.write_text(text)
    spec = importlib.util.spec_from_file_location(name, file)
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
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


def test_a_cache_that_names_a_type_which_is_gone_is_compiled_anew(tmp_path):
    text = SOURCE.replace("@cached", "from typing import NamedTuple\nclass Old(NamedTuple):\n    y: float\n\n@cached")
    text = text.replace("2 * x", "2 * x.y")
    for kind in ("Old", "Newer"):
        module = load(tmp_path, text.replace("Old", kind), name="renamed")
        assert module.double(getattr(module, kind)(21.0)) == 42.0
