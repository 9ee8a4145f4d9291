"""A run's files under their seal: what changes later is named, what is not ours is left alone."""

import hashlib
import json
import shutil

import pytest

from scla_mj.config import RunConfig
from scla_mj.engine.rollout import rollout
from scla_mj.errors import SclaError
from scla_mj.runs.seal import broken_files, check_seal, is_sealed

FILES = ("brain.npz", "config.json", "decisions.parquet", "summary.json")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    path = tmp_path_factory.mktemp("runs") / "run"
    path.mkdir()
    (path / "notes.txt").write_text("mine")
    rollout(RunConfig(epochs=1, decisions=5, brain="automaton", telemetry="off"), path, pictures=False)
    return path


@pytest.fixture
def run(made, tmp_path):
    return shutil.copytree(made, tmp_path / "run")


def test_a_finished_run_is_sealed_file_by_file(run):
    seal = json.loads((run / "seal.json").read_text())
    assert seal["files"] == {name: hashlib.sha256((run / name).read_bytes()).hexdigest() for name in FILES}
    assert is_sealed(run)
    assert broken_files(run) == {}
    check_seal(run, *FILES)


def test_a_note_of_the_users_beside_the_run_is_no_part_of_it(run):
    (run / "notes.txt").write_text("changed")
    assert broken_files(run) == {}


@pytest.mark.parametrize("name", FILES)
def test_one_changed_bit_is_seen_and_the_file_named(run, name):
    content = bytearray((run / name).read_bytes())
    content[len(content) // 2] ^= 1
    (run / name).write_bytes(content)
    assert list(broken_files(run)) == [name]
    with pytest.raises(SclaError, match=rf"{name} is damaged: [^\n]+$"):
        check_seal(run, *FILES)
    check_seal(run, *(other for other in FILES if other != name))


def test_a_file_that_went_or_came_after_the_run_is_named(run):
    (run / "brain.npz").unlink()
    (run / "recording.rrd").write_bytes(b"somebody else's")
    broken = broken_files(run)
    assert set(broken) == {"brain.npz", "recording.rrd"}
    assert "missing" in broken["brain.npz"]
    assert "not in seal.json" in broken["recording.rrd"]


def test_an_unsealed_run_opens_as_before(run):
    (run / "seal.json").unlink()
    (run / "brain.npz").write_bytes(b"")
    assert not is_sealed(run)
    assert broken_files(run) == {}
    check_seal(run, *FILES)


@pytest.mark.parametrize("position", range(0, 480, 16))
def test_a_seal_is_refused_if_any_of_its_own_bytes_change(run, position):
    content = bytearray((run / "seal.json").read_bytes())
    content[position] ^= 2
    (run / "seal.json").write_bytes(content)
    with pytest.raises(SclaError, match=r"seal\.json (is damaged|has format)"):
        broken_files(run)


@pytest.mark.parametrize("name", ["../run/brain.npz", "/etc/passwd", "notes.txt", "", "."])
def test_a_seal_cannot_lead_out_of_its_folder(run, name):
    content = {"format": 1, "files": {name: "0" * 64}}
    digest = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
    (run / "seal.json").write_text(json.dumps(content | {"digest": digest}))
    with pytest.raises(SclaError, match="SHA-256 of files of this run"):
        check_seal(run, name)


def test_an_interrupted_run_is_sealed_too_as_it_ends_in_order(tmp_path):
    config = RunConfig(epochs=1, decisions=5, telemetry="off", brain="random")

    def stop(record, epoch):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        rollout(config, tmp_path / "run", watch=stop, pictures=False)
    assert is_sealed(tmp_path / "run")
    assert broken_files(tmp_path / "run") == {}
