"""A damaged file is refused with one sentence, or harmless; never a traceback. tests/fuzz_damage.py tries thousands."""

import itertools
import shutil

import damage
import pytest

from scla_mj.runs.atomic import read_json, write_json

SEED = 0


def numbers(opened, count):
    """The first cases of the seed that are opened that way, none if this version has no such command."""
    if opened not in {way.open for way in damage.ways()}:
        return []
    return list(itertools.islice((n for n in itertools.count() if damage.way_of(SEED, n).open == opened), count))


@pytest.fixture(scope="module")
def work(tmp_path_factory):
    path = tmp_path_factory.mktemp("damage")
    damage.make_runs(path)
    return path


@pytest.fixture(scope="module")
def truths():
    return {}


@pytest.mark.parametrize(
    "number", [*numbers("read", 100), *numbers("inspect", 3), *numbers("resume", 2), *numbers("figures", 2)]
)
def test_a_damaged_file_is_never_taken_for_sound_and_never_ends_in_a_traceback(work, truths, number):
    case = damage.try_case(work, SEED, number, truths)
    assert case.outcome in damage.GOOD, case


def test_a_resumed_run_has_the_bits_of_the_one_that_was_never_killed(work, truths):
    way = next(way for way in damage.ways() if way.open == "resume")
    run = work / "whole" / "run"
    shutil.copytree(work / "killed", run)
    outcome, found = damage.seen(run, way)
    assert outcome == "opened"
    assert found == [(work / "finished" / name).read_bytes() for name in ("decisions.parquet", "brain.npz")]


def test_the_harness_sees_a_reader_that_takes_damage_for_sound(work, truths, monkeypatch):
    monkeypatch.setattr(damage, "check_seal", lambda run, name: None)  # as if nobody looked at the seal
    way = next(way for way in damage.WAYS if (way.run, way.file) == ("finished", "config.json"))
    monkeypatch.setattr(damage, "way_of", lambda seed, number: way)
    monkeypatch.setattr(damage, "damage", lambda path, rng: write_json(path, read_json(path) | {"seed": 4}))
    assert damage.try_case(work, SEED, 0, {}).outcome == "taken for sound"
