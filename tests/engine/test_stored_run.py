"""A run read back: exactly what its decisions were, whole, unfinished, resumed, with and without a recording."""

import dataclasses
import shutil

import numpy as np
import pytest
from stopped_runs import QUICK, stopped

import scla_mj
from scla_mj.anatomy import POPULATIONS
from scla_mj.config import RunConfig
from scla_mj.engine.build import simulate
from scla_mj.errors import SclaError
from scla_mj.paths import BRAIN_NPZ, CHECKPOINT_NPZ, SEAL_JSON
from scla_mj.signals import TRAJECTORY_COLUMNS

CONFIG = RunConfig(seed=4, epochs=2, decisions=20, telemetry="full")
MISSING = ("spikes", "trajectory")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("stored") / "run"
    scla_mj.rollout(CONFIG, path, pictures=False)
    return path


@pytest.fixture(scope="module")
def truth():
    """The same run's decisions, made again without any folder."""
    simulation = simulate(CONFIG)
    return [simulation.step() for _ in range(40)]


def test_a_whole_run_lacks_nothing_and_tells_what_it_was(folder):
    run = scla_mj.load_run(str(folder))
    assert run.is_complete and run.lacks == () and run.config == CONFIG
    assert run.decisions.num_rows == 40 and len(run.decisions.to_pandas()) == 40
    assert sum(epoch.hits for epoch in run.summary.epochs) == np.sum(run.decisions["hit"].to_numpy())
    assert run.brain.weights.shape == (8, 100, 100)
    assert run.inspect().sentence().endswith("recording agrees")
    assert "scla, any-start, seed 4, complete" in repr(run)


@pytest.mark.parametrize("decision", [1, 2, 20, 21, 40])
def test_a_decisions_spikes_are_those_of_its_neurons(folder, truth, decision):
    found, activity = scla_mj.load_run(folder).spikes(decision), truth[decision - 1].activity
    steps = np.rint((found.time_s - truth[decision - 1].time_s) * 1000).astype(int)
    order = np.lexsort((activity.spike_neuron, activity.spike_step))
    assert steps.tolist() == activity.spike_step[order].tolist()
    assert found.neuron.tolist() == activity.spike_neuron[order].tolist()
    names = {neuron: p.name for p in POPULATIONS for neuron in range(p.start, p.stop)}
    assert found.population.tolist() == [names[neuron] for neuron in found.neuron.tolist()]


@pytest.mark.parametrize("decision", [1, 20, 40])
def test_a_decisions_trajectory_is_the_robots(folder, truth, decision):
    found, move = scla_mj.load_run(folder).trajectory(decision), truth[decision - 1].move
    times = move.trajectory[:, TRAJECTORY_COLUMNS.index("time_s")]
    rows = np.searchsorted(times, found.time_s - 1e-6)
    assert len(found.time_s) > 10 and found.time_s[-1] == pytest.approx(times[-1])
    assert np.allclose(found.position_m[:, :2], move.trajectory[rows, 1:3], atol=1e-6)
    qw, qz = move.trajectory[rows, 4], move.trajectory[rows, 7]
    assert np.allclose(np.cos(found.heading_rad), np.cos(2 * np.arctan2(qz, qw)), atol=1e-3)


def test_the_weight_history_is_that_of_the_decisions(folder, truth):
    history = scla_mj.load_run(folder).weight_history
    assert history.decision.tolist() == list(range(1, 41, 4))
    means = [truth[number - 1].activity.mean_weights for number in history.decision]
    assert np.array_equal(history.mean_weights, means)


def test_without_a_recording_the_rest_is_there_and_what_is_lacking_is_refused_by_name(tmp_path):
    config = dataclasses.replace(CONFIG, telemetry="off", epochs=1)
    scla_mj.rollout(config, tmp_path / "run", pictures=False)
    run = scla_mj.load_run(tmp_path / "run")
    assert run.is_complete and run.lacks == MISSING
    assert len(run.weight_history.decision) == 5
    for ask in (run.spikes, run.trajectory):
        with pytest.raises(SclaError, match=r"has no recording \(--telemetry off\)"):
            ask(1)


def test_an_unfinished_run_is_opened_and_once_resumed_it_lacks_nothing(tmp_path):
    run = scla_mj.load_run(stopped(dataclasses.replace(QUICK, telemetry="light"), tmp_path / "run", 25))
    assert not run.is_complete and run.decisions.num_rows == 25
    assert run.weight_history.decision.tolist() == list(range(1, 26, 4))
    before = run.spikes(25)
    shutil.copytree(tmp_path / "run", tmp_path / "killed")
    for name in (CHECKPOINT_NPZ, BRAIN_NPZ, SEAL_JSON):  # as a kill before the first checkpoint would leave it
        (tmp_path / "killed" / name).unlink()
    recorded = scla_mj.load_run(tmp_path / "killed")
    assert recorded.lacks == ("brain",)
    assert recorded.weight_history.decision.tolist() == list(range(1, 26))
    with pytest.raises(SclaError, match=r"brain\.npz, as the run stopped before its end.*scla-mj resume"):
        _ = recorded.brain
    scla_mj.resume(tmp_path / "run", pictures=False)
    whole = scla_mj.load_run(tmp_path / "run")
    assert whole.is_complete and whole.lacks == ()
    assert np.array_equal(whole.spikes(25).time_s, before.time_s)
    assert len(whole.spikes(26).time_s)


@pytest.mark.parametrize("decision", [0, 41, -1])
def test_a_decision_that_the_run_does_not_have_is_refused(folder, decision):
    with pytest.raises(SclaError, match=f"decision {decision} is not in the run: choose 1 to 40"):
        scla_mj.load_run(folder).spikes(decision)


def test_what_is_no_run_is_refused(tmp_path):
    with pytest.raises(SclaError, match="not a run folder"):
        scla_mj.load_run(tmp_path / "absent")


@pytest.mark.parametrize("decision", ["5", 1.5, True])
def test_what_is_not_a_number_of_a_decision_is_refused(folder, decision):
    with pytest.raises(SclaError, match="it must be a whole number, 1 to 40"):
        scla_mj.load_run(folder).trajectory(decision)


@pytest.mark.parametrize("call", [scla_mj.load_run, scla_mj.resume, lambda path: scla_mj.rollout(CONFIG, path)])
def test_what_is_not_a_path_is_refused(call):
    with pytest.raises(SclaError, match="RUN is None: it must be the path of a folder"):
        call(None)


def test_a_stopped_run_whose_brain_has_no_state_is_not_complete(tmp_path):
    path = stopped(dataclasses.replace(QUICK, brain="random"), tmp_path / "run", 25)
    (path / CHECKPOINT_NPZ).unlink()  # a brain without state() leaves none
    run = scla_mj.load_run(path)
    assert not run.is_complete and run.summary.epochs
    assert "unfinished" in repr(run)


def test_what_was_damaged_or_removed_since_the_run_is_said_to_be_so(folder, tmp_path):
    path = shutil.copytree(folder, tmp_path / "run")
    recording = path / "recording.rrd"
    recording.write_bytes(recording.read_bytes()[: recording.stat().st_size // 3])
    (path / "decisions.parquet").unlink()
    (path / BRAIN_NPZ).unlink()
    run = scla_mj.load_run(path)
    with pytest.raises(SclaError, match=r"recording\.rrd is damaged: its bytes are not those that the run wrote"):
        run.trajectory(40)
    with pytest.raises(SclaError, match=r"decisions\.parquet is missing"):
        _ = run.decisions
    with pytest.raises(SclaError, match=r"brain\.npz is missing: seal\.json lists it; `scla-mj rollout NEW --config"):
        _ = run.brain


def test_the_largest_seed_is_stored_and_its_recording_agrees(tmp_path):
    config = RunConfig(brain="random", epochs=1, decisions=4, seed=np.uint64(2**63 - 1))
    scla_mj.rollout(config, tmp_path / "run", pictures=False)
    run = scla_mj.load_run(tmp_path / "run")
    assert run.config.seed == run.summary.seed == 2**63 - 1
    assert run.inspect().verdict == "sound"
