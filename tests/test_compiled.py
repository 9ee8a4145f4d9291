"""Compiled code is kept where it can be, and a machine where nothing is writable compiles it anew."""

import importlib.util
import logging
import subprocess
import sys

import numba
import pytest
from numba import float64, int64

from scla_mj import compiled
from scla_mj.errors import SclaError

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
    assert not list(tmp_path.rglob("*.nbc"))


def test_compiled_code_is_kept_beside_the_source(tmp_path, nowhere):
    assert load(tmp_path).double(21) == 42
    assert len(list((tmp_path / "__pycache__").glob("source.double*.nbc"))) == 1


RECURSIVE = """
import sys

import numpy as np
from scla_mj.compiled import cached_njit, leaf_njit

@leaf_njit()
def summed(x, depth):
    if depth < 1:
        return len(x[0].cells)
    return summed(x, depth - 1) + summed(x, depth - 2)

@cached_njit()
def double(x):
    return summed(x, len(x) + 1)

for size in sys.argv[1:]:
    print(double(np.zeros(1, [("cells", float, int(size))])))
"""


def test_what_two_processes_have_compiled_stays_apart_in_a_third(tmp_path, nowhere):
    (tmp_path / "sizes.py").write_text(RECURSIVE)

    def said(*sizes):
        words = [sys.executable, str(tmp_path / "sizes.py"), *sizes]
        return subprocess.run(words, capture_output=True, text=True, check=True).stdout.split()

    assert [said("3"), said("5"), said("3", "5")] == [["9"], ["15"], ["9", "15"]]


def test_a_cache_that_names_a_type_which_is_gone_is_compiled_anew(tmp_path):
    text = SOURCE.replace("@cached", "from typing import NamedTuple\nclass Old(NamedTuple):\n    y: float\n\n@cached")
    text = text.replace("2 * x", "2 * x.y")
    for kind in ("Old", "Newer"):
        module = load(tmp_path, text.replace("Old", kind), name="renamed")
        assert module.double(getattr(module, kind)(21.0)) == 42.0


def test_without_its_compiler_the_package_says_what_to_unset(monkeypatch):
    monkeypatch.setattr(numba.config, "DISABLE_JIT", 1)
    spec = importlib.util.spec_from_file_location("uncompiled", compiled.__file__)
    with pytest.raises(SclaError, match="NUMBA_DISABLE_JIT is set"):
        spec.loader.exec_module(importlib.util.module_from_spec(spec))


def kept(folder):
    (file,) = (folder / "__pycache__").glob("source.double*.nbc")
    return file


def found(folder, kind=int64):
    """Return whether a new process would take the function from the cache."""
    double = load(folder).double
    return double._cache.load_overload((kind,), double.targetctx) is not None


@pytest.fixture
def sound(tmp_path, nowhere):
    """The file of a function that is kept, and its bytes."""
    assert load(tmp_path).double(21) == 42
    return kept(tmp_path), kept(tmp_path).read_bytes()


def test_a_damaged_file_of_compiled_code_is_told_once_compiled_anew_and_mended(tmp_path, sound, caplog):
    file, content = sound
    for damaged in (b"", content[:-1], content[: len(content) // 2], bytes(len(content)), content + b"0"):
        file.write_bytes(damaged)
        caplog.clear()
        assert load(tmp_path).double(21) == 42
        assert [record.getMessage() for record in caplog.records] == [f"{file} is damaged: it is compiled anew"]
        assert found(tmp_path), "the next process finds it whole"
        compiled._warn.cache_clear()


def test_no_damage_to_compiled_code_is_ever_run(tmp_path, sound):
    file, content = sound
    cache = load(tmp_path).double
    for length in range(0, len(content), 40):
        file.write_bytes(content[:length])
        assert cache._cache.load_overload((int64,), cache.targetctx) is None
    for at in range(0, len(content), 100):
        file.write_bytes(content[:at] + bytes([content[at] ^ 1 << at % 8]) + content[at + 1 :])
        assert cache._cache.load_overload((int64,), cache.targetctx) is None


def test_two_signatures_never_take_each_others_code(tmp_path, nowhere):
    first, second = load(tmp_path).double, load(tmp_path).double  # two processes that found the folder empty
    assert (first(21), second(0.25)) == (42, 0.5)
    assert found(tmp_path, int64)
    assert found(tmp_path, float64)
    one, other = (tmp_path / "__pycache__").glob("*.nbc")
    one.write_bytes(other.read_bytes())
    assert found(tmp_path, int64) != found(tmp_path, float64)


def test_a_folder_that_can_no_longer_be_written_to_costs_only_the_compiling(tmp_path, nowhere, caplog):
    double = load(tmp_path).double
    for entry in (tmp_path / "__pycache__").iterdir():
        entry.unlink()
    (tmp_path / "__pycache__").rmdir()
    (tmp_path / "__pycache__").touch()
    with caplog.at_level(logging.INFO):
        assert double(21) == 42
    assert "compiled code cannot be kept in" in caplog.text


def test_compiling_is_announced_once_and_only_when_it_happens(tmp_path, nowhere, caplog):
    compiled._announce.cache_clear()
    with caplog.at_level(logging.INFO):
        assert (load(tmp_path).double(21), load(tmp_path).double(0.25)) == (42, 0.5)
        assert caplog.text.count("compiling for this machine, once") == 1
        compiled._announce.cache_clear()
        caplog.clear()
        assert load(tmp_path).double(21) == 42
        assert not caplog.text
