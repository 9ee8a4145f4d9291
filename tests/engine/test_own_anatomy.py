"""A brain of other neurons than the paper's is recorded, counted, drawn and checked under its own names."""

import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from scla_mj import RunConfig, SclaError, load_run, resume, rollout
from scla_mj.cli.main import main
from scla_mj.engine.build import simulate
from scla_mj.paths import BRAIN_NPZ, CONFIG_JSON, DECISIONS_PARQUET, RECORDING_RRD, WEIGHTS_PNG
from scla_mj.runs.decisions import DecisionLog
from scla_mj.telemetry.reading.chunks import join
from scla_mj.telemetry.reading.recording_parts import open_parts

EXAMPLE = Path(__file__).parents[2] / "examples" / "lif_brain.py"
NAMES = ("place", "go_up", "go_down", "go_left", "go_right")
RANGES = {"place": range(100), "go_up": range(100, 125), "go_down": range(125, 150), "go_left": range(150, 175),
          "go_right": range(175, 200)}  # fmt: skip


@pytest.fixture(scope="module")
def lif(tmp_path_factory):
    """A run of 200 LIF neurons: its folder, and every decision as the simulation made it."""
    place, records = tmp_path_factory.mktemp("lif"), []
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(EXAMPLE.parent))
        run = place / "run"
        config = RunConfig(
            brain="lif_brain:LifBrain", brain_settings={"noise": 0.2}, epochs=2, decisions=15, telemetry="full"
        )
        rollout(config, run, watch=lambda record, _: records.append(record))
    return run, records


def test_the_raster_agrees_neuron_by_neuron(lif):
    run, records = load_run(lif[0]), lif[1]
    for number, record in enumerate(records, 1):
        spikes, activity = run.spikes(number), record.activity
        assert spikes.neuron.tolist() == activity.spike_neuron.tolist()
        assert np.allclose(spikes.time_s, record.time_s + 0.001 * activity.spike_step)
        assert all(neuron in RANGES[name] for neuron, name in zip(spikes.neuron, spikes.population, strict=True))


def test_the_table_counts_the_motor_populations_by_their_names(lif):
    table = load_run(lif[0]).decisions
    assert [name for name in table.column_names if name.startswith("spikes_")] == [f"spikes_{n}" for n in NAMES[1:]]
    for row, record in zip(table.to_pylist(), lif[1], strict=True):
        for name in NAMES[1:]:
            assert row[f"spikes_{name}"] == np.isin(record.activity.spike_neuron, RANGES[name]).sum()


def test_rates_and_weights_are_recorded_by_name(lif):
    found = {}
    with open_parts(lif[0] / RECORDING_RRD) as parts:
        for chunk in parts[0].chunks(["/brain/rates/**", "/brain/weights/**"]):
            if chunk.has("Scalars:scalars"):
                found.setdefault(chunk.entity, []).append(chunk)
    for name, neurons in RANGES.items():
        spikes = [np.isin(record.activity.spike_neuron, neurons).sum() for record in lif[1]]
        rates_hz = join(found[f"brain/rates/{name}"], "Scalars:scalars").values
        assert np.allclose(rates_hz, np.array(spikes) / (len(neurons) * 0.05))
    means = join(found["brain/weights/to_go_left"], "Scalars:scalars").values
    assert np.array_equal(means, [record.activity.mean_weights[2] for record in lif[1]])


def test_inspect_counts_the_same_spikes_and_says_that_all_agrees(lif):
    found = load_run(lif[0]).inspect()
    assert found.verdict == "sound", found.sentence()
    neurons = np.concatenate([record.activity.spike_neuron for record in lif[1]])
    counted = {own.name: own.thinking_spikes for own in found.recording.populations}
    assert counted == {name: np.isin(neurons, own).sum() for name, own in RANGES.items()}
    compared = {row.what for row in found.comparisons if row.file == DECISIONS_PARQUET}
    assert {f"spikes {name} while thinking" for name in NAMES[1:]} <= compared


def test_a_table_that_counts_other_spikes_than_the_recording_disagrees(lif, tmp_path):
    run = tmp_path / "run"
    shutil.copytree(lif[0], run)
    (run / DECISIONS_PARQUET).unlink()
    (run / "seal.json").unlink()
    with DecisionLog(run, NAMES[1:]) as log:
        for record in lif[1]:
            log.write(record._replace(chosen=record.chosen._replace(motor_spikes=(0, 0, 0, 0))))
    found = load_run(run).inspect()
    assert [row.what for row in found.disagreements] == [f"spikes {name} while thinking" for name in NAMES[1:]]


def test_a_run_is_read_by_its_own_names_without_its_brain(lif):
    run = load_run(lif[0])
    assert "lif_brain" in sys.modules and run.anatomy == sys.modules["lif_brain"].LifBrain.anatomy
    assert json.loads((run.path / CONFIG_JSON).read_text())["anatomy"]["populations"][1]["name"] == "go_up"
    assert run.brain.weights.shape == (4, 100, 25) and run.weight_history.mean_weights.shape[1] == 4
    assert (run.path / WEIGHTS_PNG).exists()
    with np.load(run.path / BRAIN_NPZ) as archive:
        assert list(archive["projections"]) == [f"to_{name}" for name in NAMES[1:]]
    assert len(run.spikes().neuron) == sum(len(record.activity.spike_neuron) for record in lif[1])


def test_config_json_keeps_the_brains_settings_the_digest_of_its_file_and_its_packages(lif):
    content = json.loads((lif[0] / CONFIG_JSON).read_text())
    assert len(content["brain_sha256"]) == 64 and content["versions"]["numpy"] == np.__version__
    assert content["brain_settings"] == {"noise": 0.2}


MINE = """
from scla_mj import Action, Activity, Anatomy, Brain, Decision, Projection, Snapshot, stacked
import numpy as np

class Mine(Brain):
    reads = ()
    anatomy = Anatomy(
        stacked(("a", 3), ("b", 2, "motor")),
        (Projection("ab", "a", "b", (3, 2)), Projection("ba", "b", "a", (4,))),
    )

    def decide(self, percept):
        return Decision(Action.UP, None, (1,))

    def learn(self, feedback):
        pass

    def activity(self):
        return Activity(np.array([0, 2]), np.array([4, 1]), 1, 50, 50, np.ones(2), np.zeros(2))

    def snapshot(self):
        return Snapshot({"ab": np.ones((3, 2)), "ba": np.ones(4)})

    def state(self):
        return {}

    def restore(self, state):
        pass
"""


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """Write the module `mine`, changed, for a brain of five neurons; what it was before is forgotten."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delitem(sys.modules, "mine", raising=False)

    def write(old="", new=""):
        assert old in MINE
        Path("mine.py").write_text(MINE.replace(old, new), encoding="utf-8")
        sys.modules.pop("mine", None)

    return write


def test_weights_of_different_shapes_are_kept_and_compared_by_name(mine, tmp_path):
    mine()
    rollout(RunConfig(brain="mine:Mine", epochs=1, decisions=3), tmp_path / "run")
    run = load_run(tmp_path / "run")
    assert {name: array.shape for name, array in run.brain.weights.items()} == {"ab": (3, 2), "ba": (4,)}
    found = run.inspect()
    assert found.verdict == "sound" and found.recording.weights["ba"].tolist() == [1.0] * 4


def test_a_brain_whose_file_has_changed_is_not_resumed(mine, tmp_path):
    def stop(record, _):
        if record.decision == 2:
            raise KeyboardInterrupt

    mine()
    config = RunConfig(brain="mine:Mine", epochs=1, decisions=4, telemetry="off")
    with pytest.raises(KeyboardInterrupt):
        rollout(config, tmp_path / "run", watch=stop)
    mine("pass", "_ = feedback")
    with pytest.raises(SclaError, match=r"mine\.py has changed since .* began"):
        resume(tmp_path / "run", brain="mine:Mine")
    mine()
    assert resume(tmp_path / "run", brain="mine:Mine").transitions.commanded == 4


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('("b", 2, "motor")', '("a", 2, "motor")', "two populations are called 'a'"),
        ('"a", "b", (3, 2)', '"a", "c", (3, 2)', "names the population 'c'"),
        ("anatomy = Anatomy(", "anatomy = (lambda *_: 3)(", "its anatomy must be an Anatomy or None"),
        ("anatomy = Anatomy(", "nothing = Anatomy(", "motor_spikes are None"),
        ('"motor"', '"output"', "motor_spikes are None, as its anatomy has no population of role motor"),
        ("(1,))", "(1, 2))", "a count for each population of role motor (b) or None"),
        ("[4, 1]", "[5, 1]", "indices from 0 to 4"),
        ("np.ones(2)", "np.ones(8)", "mean_weights as 2 finite floats"),
        ('"ba": np.ones(4)', '"ba": np.ones(5)', "weights of ba are float64 (5,), they must be floats of (4,)"),
        (', "ba": np.ones(4)', "", "weights are of ab, the projections are ab, ba"),
        (
            '{"ab": np.ones((3, 2)), "ba": np.ones(4)}',
            "np.ones((2, 3, 2))",
            "they must be a dict with an array for each",
        ),
    ],
)
def test_what_does_not_fit_its_anatomy_is_refused_in_one_sentence(mine, capsys, old, new, words):
    mine(old, new)
    assert main(["rollout", "run", "--brain", "mine:Mine", "--epochs", "1", "--decisions", "3"]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len([line for line in said if words in line]) == 1


def test_the_librarys_brains_have_no_digest_and_their_anatomy_is_theirs(tmp_path):
    assert simulate(RunConfig(brain="random")).brain.anatomy is None
    rollout(RunConfig(brain="random", epochs=1, decisions=2), tmp_path / "run", pictures=False)
    run = load_run(tmp_path / "run")
    assert run.anatomy is None and run.inspect().verdict == "sound"
    assert json.loads((run.path / CONFIG_JSON).read_text())["brain_sha256"] is None
