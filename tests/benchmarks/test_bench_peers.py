"""The peers: an unequal spike train, weight or rate ends the bench; the numpy peer is our network, spike for spike."""

import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks import crosscheck, described, peers_race, workload
from benchmarks.crosscheck import Check, Train, prepare, read_train, require_same
from benchmarks.peer_job import write_job
from benchmarks.peers import REQUIREMENTS, WORKER
from benchmarks.peers_race import Round
from scla_mj.brain.network.network import Network
from scla_mj.cli.main import main
from scla_mj.config import PlasticityConfig, RunConfig
from scla_mj.errors import SclaError

HALF_A_SECOND = Check("half a second", ("numpy",), 1, True)


@pytest.fixture(scope="module")
def trains(tmp_path_factory):
    """Ours, and what the numpy peer wrote in a process of its own."""
    folder = tmp_path_factory.mktemp("peer")
    ours = prepare(HALF_A_SECOND, folder / "job.npz", PlasticityConfig(), seed=3)
    peers_race.run_to_the_end(Path(sys.executable), "numpy", folder / "job.npz", folder / "result.npz")
    return ours, read_train(folder / "result.npz")


def test_the_numpy_peer_gives_our_spikes_and_weights(trains):
    ours, theirs = trains
    assert len(ours.step) > 5000
    assert np.abs(ours.weights - 1.0).max() > 0.5
    assert require_same("numpy", HALF_A_SECOND, ours, theirs) < 1e-12


@pytest.mark.parametrize("field", ["step", "neuron"])
def test_one_spike_a_millisecond_late_or_of_another_neuron_is_refused(trains, field):
    ours, theirs = trains
    wrong = getattr(theirs, field).copy()
    wrong[1234] += 1
    with pytest.raises(SclaError, match="spike 1234 is of neuron"):
        require_same("numpy", HALF_A_SECOND, ours, theirs._replace(**{field: wrong}))


def test_a_missing_last_spike_is_refused(trains):
    ours, theirs = trains
    shorter = Train(theirs.step[:-1], theirs.neuron[:-1], theirs.weights)
    with pytest.raises(SclaError, match=f"{len(ours.step) - 1} spikes, ours {len(ours.step)}"):
        require_same("numpy", HALF_A_SECOND, ours, shorter)


@pytest.mark.parametrize("wrong", [1e-11, np.nan])
def test_a_weight_that_is_off_by_1e_11_is_refused(trains, wrong):
    ours, theirs = trains
    weights = theirs.weights.copy()
    weights[7, 99, 99] += wrong
    with pytest.raises(SclaError, match="a weight differs"):
        require_same("numpy", HALF_A_SECOND, ours, theirs._replace(weights=weights))


def test_unequal_rates_are_refused():
    equal = {"ours": (1000, 2000, 500), "numpy": (1090, 1900, 500)}
    peers_race.require_same_rates(equal)
    with pytest.raises(SclaError, match="2300 spikes of motor neurons, ours 2000"):
        peers_race.require_same_rates({**equal, "numpy": (1000, 2300, 500)})
    with pytest.raises(SclaError, match="0 spikes of sensory neurons"):
        peers_race.require_same_rates({**equal, "numpy": (0, 2000, 500)})


def test_the_race_is_judged_by_medians_without_the_first_round():
    def rounds(cpu_s):
        return [Round(9.0, (1, 1, 1)), *(Round(seconds, (1, 1, 1)) for seconds in cpu_s)]

    timed = {"ours": rounds([0.004, 0.005, 0.004]), "numpy": rounds([0.1, 0.1, 0.3])}
    timed |= {"brian2": rounds([0.08, 0.09, 0.08]), "nest": rounds([0.3, 0.3, 0.3])}
    sheet = peers_race.race_sheet(timed, {"numpy": 0.2, "brian2": 30.0, "nest": 0.5})
    assert sheet.values["ours, µs per simulated ms"] == pytest.approx(4.0)
    verdicts = {row[0]: row[2:4] for row in sheet.rows}
    assert verdicts["numpy"] == ("25.0", "≥ 20 met")
    assert verdicts["Brian2 (Cython)"] == ("20.0", "≥ 25 missed")


def test_a_peer_runs_rounds_in_turn_and_leaves_no_process(tmp_path):
    config = RunConfig()
    network = Network(config.network, config.plasticity, seed=0)
    work = workload.rewarded(20, drive=8.0, release=0.5, rng=np.random.Generator(np.random.PCG64(0)))
    job = tmp_path / "job.npz"
    write_job(job, config.network, config.plasticity, network.weights, work, plastic=True, record=False)
    with peers_race.Peer(Path(sys.executable), "numpy", job) as peer:
        first, second = peer.round(), peer.round()
    assert peer._process.poll() is not None
    assert first.cpu_s > 0
    own = peers_race._by_kind(workload.run_chunks(network, work).tolist())
    assert first.spikes == pytest.approx(own, rel=0.1)
    assert second.spikes != first.spikes


def test_the_peers_import_nothing_of_ours():
    for file in WORKER.parent.glob("[!_]*.py"):
        text = file.read_text(encoding="utf-8")
        assert "import scla_mj" not in text
        assert "from scla_mj" not in text
    assert "numpy" in REQUIREMENTS.read_text(encoding="utf-8")


def test_a_python_without_the_peers_is_refused_in_a_sentence(tmp_path, capsys, monkeypatch):
    assert main(["bench", "--peers", str(tmp_path / "none")]) == 2
    assert "is not a file" in capsys.readouterr().err
    (tmp_path / "job.npz").touch()
    early = peers_race.Peer(Path(sys.executable), "numpy", tmp_path / "job.npz")
    with pytest.raises(SclaError, match=r"the peer numpy ended early: .*; its environment is made from"), early:
        pass
    assert early._process.poll() is not None
    (tmp_path / "text").write_text("no program")
    monkeypatch.setattr(crosscheck, "CHECKS", (HALF_A_SECOND,))
    assert main(["bench", "--peers", str(tmp_path / "text")]) == 2
    assert "cannot be started" in capsys.readouterr().err


def test_a_peer_that_fails_or_hangs_is_reported_in_a_sentence(tmp_path, monkeypatch):
    job, result, python = tmp_path / "job.npz", tmp_path / "result.npz", Path(sys.executable)
    prepare(HALF_A_SECOND, job, PlasticityConfig(), seed=3)
    with pytest.raises(SclaError, match="ended early: ModuleNotFoundError"):
        peers_race.run_to_the_end(python, "none", job, result)
    monkeypatch.setattr(peers_race, "_LONGEST_S", 0.05)
    with pytest.raises(SclaError, match="the peer numpy has not ended"):
        peers_race.run_to_the_end(python, "numpy", job, result)


def test_a_network_by_description_is_judged_by_brian2_of_the_same_run_or_the_row_says_that_there_is_none():
    cost = dict(zip((described._PAPERS, described._DESCRIBED, described._GROWN), (2.0, 9.0, 99.0), strict=True))
    absent = described.sheet(cost).rows
    assert [row[1:] for row in absent[:3]] == [
        ("2.00", "1.0", ""),
        ("9.00", "4.5", ""),
        ("99.00", "49.5", "11.0 x by description, ≤ 12 met"),
    ]
    assert absent[3][3].startswith("not installed: python3 -m venv .peers")
    assert described.sheet({**cost, described._BRIAN2: 30.0}).rows[1][3] == "0.30 x Brian2, ≤ 0.2 missed"
