"""`scla-mj export --parquet`: tables that say what the run's own files say; what cannot be exported is a sentence."""

import shutil
import sys

import numpy as np
import pyarrow.parquet as pq
import pytest

import scla_mj
from scla_mj.cli.main import main


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("export") / "run"
    scla_mj.rollout(scla_mj.RunConfig(epochs=2, decisions=10, seed=3), folder, pictures=False)
    return folder


def test_the_tables_say_what_the_run_says(run, tmp_path, capsys):
    assert main(["export", str(run), "--parquet", str(tmp_path / "tables")]) == 0
    table = {file.stem: pq.read_table(file).to_pandas() for file in (tmp_path / "tables").iterdir()}
    assert sorted(table) == ["decisions", "mean_weights", "poses", "spikes", "weights"]
    stored, spikes, poses = scla_mj.load_run(run), table["spikes"], table["poses"]
    assert table["decisions"].equals(stored.decisions.to_pandas())
    of_motors = spikes[spikes.population.isin(["MU", "MD", "ML", "MR"])]
    counts = of_motors.groupby(["decision", "population"], observed=True).size().unstack(fill_value=0)
    for name in counts.columns:
        assert counts[name].tolist() == stored.decisions[f"spikes_{name}"].to_pylist()
    third = stored.trajectory(3)
    assert np.array_equal(poses[poses.decision == 3][["x_m", "y_m", "z_m"]], third.position_m)
    assert np.array_equal(poses[poses.decision == 3].heading_rad, third.heading_rad)
    weights, first = stored.brain.weights, table["weights"].query("projection == 'SUtoMU'")
    assert len(table["weights"]) == weights.size
    assert np.array_equal(weights[0, first.presynaptic, first.postsynaptic], first.weight)
    assert np.allclose(table["mean_weights"]["SRtoML"], stored.weight_history.mean_weights[:, 7])
    assert capsys.readouterr().out.count("Written:  ") == 5


def test_all_spikes_are_those_of_every_decision(run):
    stored = scla_mj.load_run(run)
    every = stored.spikes()
    for number in (1, 10, 11, 20):
        one, of_it = stored.spikes(number), every.decision == number
        assert all(np.array_equal(column[of_it], alone) for column, alone in zip(every, one, strict=True))


def test_a_brain_without_neurons_has_no_spikes_and_no_weights(tmp_path):
    scla_mj.rollout(scla_mj.RunConfig(brain="q-learning", epochs=1, decisions=3), tmp_path / "run", pictures=False)
    assert main(["export", str(tmp_path / "run"), "--parquet", str(tmp_path / "tables")]) == 0
    assert sorted(file.stem for file in (tmp_path / "tables").iterdir()) == ["decisions", "poses"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "nothing is asked for: choose --nwb FILE or --parquet FOLDER"),
        (["--parquet", "{run}"], "is not empty: choose another FOLDER, nothing is overwritten"),
        (["--parquet", "{run}/config.json"], "is a file, not a folder: choose another FOLDER"),
        (["--parquet", "new", "--nwb", "a.nwb"], "--nwb needs pynwb, which cannot be imported"),
    ],
)
def test_what_cannot_be_written_is_one_sentence_and_nothing_else(options, words, run, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "pynwb", None)  # as if it were not installed
    monkeypatch.chdir(tmp_path)
    before = {file: file.read_bytes() for file in run.iterdir()}
    assert main(["export", str(run), *(option.format(run=run) for option in options)]) == 2
    assert words in capsys.readouterr().err
    assert {file: file.read_bytes() for file in run.iterdir()} == before and not list(tmp_path.iterdir())


def test_what_is_no_sound_finished_recorded_run_is_refused(run, tmp_path, capsys):
    off = scla_mj.RunConfig(brain="random", epochs=1, decisions=2, telemetry="off")
    scla_mj.rollout(off, tmp_path / "off", pictures=False)
    for name, file, change in (("open", "summary.json", None), ("cut", "recording.rrd", b"RRF2")):
        shutil.copytree(run, tmp_path / name)
        (tmp_path / name / file).unlink()
        if change is not None:
            (tmp_path / name / file).write_bytes(change)
    for name, words in (
        ("off", "has no recording (--telemetry off), so no spikes or poses: `scla-mj rollout NEW --config "),
        ("open", "is unfinished: `scla-mj resume "),
        ("cut", "recording.rrd is damaged"),
        ("none", "is not a run folder"),
    ):
        assert main(["export", str(tmp_path / name), "--parquet", str(tmp_path / "out")]) == 2
        assert words in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
