"""A run that was stopped and resumed ends with the bits of one that never stopped, and its recording is whole."""

import dataclasses
import shutil

import pytest
from stopped_runs import QUICK, assert_same_run, stopped, whole

from scla_mj.cli.main import main
from scla_mj.config import NetworkConfig, PlasticityConfig, TaskConfig
from scla_mj.disturbances import DisturbanceConfig, with_sets
from scla_mj.engine.resume import resume
from scla_mj.engine.rollout import rollout
from scla_mj.errors import SclaError
from scla_mj.paths import recordings
from scla_mj.runs.checkpoint import read_checkpoint
from scla_mj.runs.decisions import read_decisions
from scla_mj.runs.seal import broken_files, is_sealed
from scla_mj.runs.summary import read_summary
from scla_mj.telemetry import names
from scla_mj.telemetry.reading.reader import inspect_recording
from scla_mj.telemetry.reading.recording_parts import open_parts

HARD = dataclasses.replace(
    QUICK,
    brain="scla-printed",
    epochs=3,
    telemetry="full",
    task=TaskConfig(action_noise=0.2, jump_epoch=2, crossed_epoch=3),
    network=NetworkConfig(precision="float64"),
    plasticity=PlasticityConfig(dopamine_delay_s=1.7),
)

DISTURBED = with_sets(DisturbanceConfig(), ["all"])


@pytest.fixture(scope="module")
def cut(tmp_path_factory):
    return stopped(QUICK, tmp_path_factory.mktemp("cut") / "run", 20)


@pytest.fixture
def run(cut, tmp_path):
    return shutil.copytree(cut, tmp_path / "run")


@pytest.mark.parametrize(
    "brain",
    [
        "scla",
        "scla-printed",
        "automaton",
        "network",
        "shortest-path",
        "automata-coin",
        "cell-states",
        "dyna-q",
        "actor-critic",
        "potjans",
    ],
)
def test_every_brain_is_resumed_bit_identically(brain, tmp_path):
    config = dataclasses.replace(QUICK, brain=brain)
    resume(stopped(config, tmp_path / "cut", 7, 30), pictures=False)
    assert_same_run(whole(config, tmp_path / "whole"), tmp_path / "cut")


@pytest.mark.parametrize("sessions", [(1,), (30,), (31,), (29, 1, 1, 40), (89,)])
def test_a_hard_run_is_resumed_bit_identically_wherever_it_is_cut(sessions, tmp_path, hard):
    resume(stopped(HARD, tmp_path / "cut", *sessions), pictures=False)
    assert_same_run(hard, tmp_path / "cut")
    seen, expected = (inspect_recording(*recordings(path)) for path in (tmp_path / "cut", hard))
    assert len(seen.parts) == len(sessions) + 1
    assert seen.path_length_m == pytest.approx(expected.path_length_m)
    told = {"parts": (), "properties": {}, "path_length_m": 0.0, "weights": None, "probabilities": None}
    assert seen._replace(**told) == expected._replace(**told)  # the arrays are inspect's to compare
    assert recorded_epochs(tmp_path / "cut") == [
        (epoch.epoch, epoch.hits_per_1000) for epoch in read_summary(tmp_path / "cut").epochs
    ]
    assert main(["inspect", str(tmp_path / "cut")]) == 0


def recorded_epochs(path):
    """Return every recorded epoch and its hits per 1000 decisions."""
    with open_parts(*recordings(path)) as parts:
        chunks = [chunk for part in parts for chunk in part.chunks([f"/{names.EPOCH_HITS}"])]
        results = [chunk for chunk in chunks if chunk.has("Scalars:scalars")]
        return [row for chunk in results for row in zip(chunk.epoch, chunk.values("Scalars:scalars"), strict=True)]


@pytest.fixture(scope="module")
def hard(tmp_path_factory):
    return whole(HARD, tmp_path_factory.mktemp("hard") / "run")


@pytest.mark.parametrize("localisation", ["odometry", "sensors"])
def test_a_disturbed_robot_that_knows_its_place_by_its_own_sensors_is_resumed_bit_identically(localisation, tmp_path):
    config = dataclasses.replace(QUICK, localisation=localisation, disturbance=DISTURBED)
    resume(stopped(config, tmp_path / "cut", 13, 4, 30), pictures=False)
    assert_same_run(whole(config, tmp_path / "whole"), tmp_path / "cut")


def test_decisions_after_the_checkpoint_are_made_again_and_counted_once(tmp_path, hard):
    """As after a kill: the files know more decisions than the checkpoint."""
    path = stopped(HARD, tmp_path / "run", 40)
    checkpoint = (path / "checkpoint.npz").read_bytes()
    stopped(HARD, path, 25, begin=False)
    (path / "checkpoint.npz").write_bytes(checkpoint)
    (path / "seal.json").unlink()
    assert read_decisions(path).num_rows == 65
    resume(path, pictures=False)
    assert_same_run(hard, path)
    seen, expected = inspect_recording(*recordings(path)), inspect_recording(*recordings(hard))
    assert (seen.decisions, seen.poses, seen.jumps) == (expected.decisions, expected.poses, expected.jumps)
    assert seen.populations == expected.populations
    assert seen.path_length_m == pytest.approx(expected.path_length_m)


def test_a_run_without_a_checkpoint_starts_again_from_its_beginning(run, tmp_path):
    (run / "checkpoint.npz").unlink()
    resume(run, pictures=False)
    assert_same_run(whole(QUICK, tmp_path / "whole"), run)


def test_checkpoints_are_written_as_the_run_goes_and_gone_at_its_end(tmp_path):
    seen = []

    def watch(record, epoch):
        state = read_checkpoint(tmp_path / "run")
        seen.append(0 if state is None else state["decisions"])

    rollout(QUICK, tmp_path / "run", watch=watch, pictures=False, checkpoint_period_s=0.0)
    assert seen == list(range(60))
    assert not (tmp_path / "run" / "checkpoint.npz").exists()
    assert_same_run(whole(QUICK, tmp_path / "whole"), tmp_path / "run")


def test_a_stopped_run_is_sealed_and_its_seal_is_lifted_while_it_runs(run):
    assert is_sealed(run) and not broken_files(run)

    def watch(record, epoch):
        assert not is_sealed(run)
        assert not (run / "summary.json").exists()

    resume(run, watch=watch, pictures=False)
    assert is_sealed(run) and not broken_files(run)


def test_what_a_killed_process_was_about_to_write_is_removed(run):
    (run / ".checkpoint.npz.123.tmp").write_bytes(b"half")
    (run / ".notes.txt.tmp").write_text("mine")
    resume(run, pictures=False)
    assert {file.name for file in run.iterdir() if file.name.startswith(".")} == {".notes.txt.tmp"}


def test_wall_time_is_that_of_all_sessions(run):
    before = read_summary(run).wall_s
    assert resume(run, pictures=False).wall_s > before


def test_a_disk_that_is_full_at_a_checkpoint_ends_the_run_in_a_sentence_and_it_is_resumed_later(tmp_path, monkeypatch):
    def fill(record, epoch):
        if record.decision == 9:

            def full(folder, state):
                raise SclaError("cannot write checkpoint.npz: No space left on device")

            monkeypatch.setattr("scla_mj.engine.session.write_checkpoint", full)

    with pytest.raises(SclaError, match="No space left"):
        rollout(QUICK, tmp_path / "run", watch=fill, pictures=False, checkpoint_period_s=0.0)
    monkeypatch.undo()
    assert read_checkpoint(tmp_path / "run")["decisions"] == 8
    assert read_decisions(tmp_path / "run").num_rows == 9
    resume(tmp_path / "run", pictures=False)
    assert_same_run(whole(QUICK, tmp_path / "whole"), tmp_path / "run")


def test_a_folder_that_vanishes_ends_the_run_in_a_sentence(tmp_path):
    def vanish(record, epoch):
        if record.decision == 5:
            shutil.rmtree(tmp_path / "run")

    with pytest.raises(SclaError, match="was moved or removed during its run"):
        rollout(QUICK, tmp_path / "run", watch=vanish, pictures=False, checkpoint_period_s=0.0)
