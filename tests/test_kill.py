"""A run that is killed anywhere, and resumed, is the uninterrupted run. tests/kill_anywhere.py tries any number."""

import shutil

import kill_anywhere
import pytest

SEED = 0


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    work = tmp_path_factory.mktemp("killed")
    return work, kill_anywhere.make_whole(work, "--brain", "automaton")


@pytest.mark.parametrize("number", [2])  # before the first file is whole, and at the first checkpoint
def test_a_run_that_is_killed_anywhere_is_resumed_to_the_same_bits(number, whole):
    work, seconds = whole
    case = kill_anywhere.try_case(work, SEED, number, seconds, "--brain", "automaton")
    assert not case.told, case


@pytest.mark.parametrize("name", ["seal.json", "learning.png", "decisions.parquet"])
def test_the_harness_sees_what_a_run_lacks(name, whole, tmp_path):
    lame = shutil.copytree(whole[0] / "whole", tmp_path / "lame")
    (lame / name).unlink()
    assert kill_anywhere.difference(whole[0] / "whole", lame)
