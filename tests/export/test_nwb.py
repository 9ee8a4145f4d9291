"""`scla-mj export --nwb`: the file is valid, keeps the inspector's rules, and others read the run's numbers from it."""

import numpy as np
import pytest

import scla_mj
from scla_mj.cli.main import main

LACKING = "install tests/export/requirements.txt to test NWB"
pynwb = pytest.importorskip("pynwb", reason=LACKING)
nwbinspector = pytest.importorskip("nwbinspector", reason=LACKING)
pynapple = pytest.importorskip("pynapple", reason=LACKING)

pytestmark = pytest.mark.filterwarnings("default")  # of these packages
DECISIONS = 1000


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    folder = tmp_path_factory.mktemp("nwb")
    run = scla_mj.RunConfig(epochs=1, decisions=DECISIONS, seed=3)
    scla_mj.rollout(run, folder / "run", pictures=False)
    assert main(["export", str(folder / "run"), "--nwb", str(folder / "run.nwb")]) == 0
    return scla_mj.load_run(folder / "run"), folder / "run.nwb"


def test_it_is_valid_and_the_inspector_has_no_objection(exported):
    _, file = exported
    assert pynwb.validate(path=str(file)) == []
    objections = list(nwbinspector.inspect_nwbfile(nwbfile_path=str(file)))
    assert [f"{one.check_function_name}: {one.message}" for one in objections] == []


def test_pynapple_reads_every_neurons_spikes_the_trials_and_the_path(exported):
    run, file = exported
    data = pynapple.load_file(str(file))
    units, spikes = data["units"], run.spikes()
    assert [len(units[n]) for n in units] == np.bincount(spikes.neuron, minlength=1000).tolist()
    assert np.array_equal(np.unique(units["population"]), sorted(scla_mj.POPULATION_NAMES))
    first = run.spikes(1)
    window = pynapple.IntervalSet(0.0, first.time_s.max() + 1e-9)
    assert sum(len(train) for train in units.restrict(window).values()) == len(first.time_s)
    trials = data["trials"]
    assert len(trials) == DECISIONS and trials["hit"].sum() == sum(run.decisions["hit"].to_pylist())
    motors = units[units["population"] == "MU"]
    twelfth = motors.restrict(pynapple.IntervalSet(trials["start"][11], trials["end"][11]))
    assert sum(len(train) for train in twelfth.values()) == run.decisions["spikes_MU"][11].as_py()
    poses = run.trajectory()
    assert np.allclose(data["position"].values, poses.position_m[:, :2])
    assert np.allclose(data["position"].t, poses.time_s)


def test_nothing_is_overwritten_and_the_name_says_what_it_is(exported, capsys, tmp_path):
    run, file = exported
    before = file.read_bytes()
    taken = tmp_path / "taken"
    (taken / "kept").mkdir(parents=True)
    both = ["--nwb", str(tmp_path / "new.nwb"), "--parquet", str(taken)]
    assert main(["export", str(run.path), *both]) == 2 and not (tmp_path / "new.nwb").exists()
    for name, words in ((file, "is there already: choose another FILE"), (file.with_suffix(".h5"), "must end in .nwb")):
        assert main(["export", str(run.path), "--nwb", str(name)]) == 2
        assert words in capsys.readouterr().err
    assert file.read_bytes() == before and sorted(file.parent.iterdir()) == [run.path, file]


def test_a_brain_without_neurons_has_trials_and_a_path_alone(tmp_path):
    settings = scla_mj.RunConfig(brain="q-learning", epochs=1, decisions=5)
    scla_mj.rollout(settings, tmp_path / "run", pictures=False)
    assert main(["export", str(tmp_path / "run"), "--nwb", str(tmp_path / "run.nwb")]) == 0
    with pynwb.NWBHDF5IO(str(tmp_path / "run.nwb"), "r") as stream:
        content = stream.read()
        assert content.units is None and len(content.trials) == 5 and "advised" in content.trials.colnames
