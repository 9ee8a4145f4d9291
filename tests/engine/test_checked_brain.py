"""A user's own brain with a mistake in it: one sentence that says where to look."""

import dataclasses

import numpy as np
import pytest

from scla_mj.anatomy import NEURON_COUNT, PAPER_ANATOMY
from scla_mj.brain.base import Brain
from scla_mj.brain.scla import SclaBrain
from scla_mj.checked import check
from scla_mj.cli.main import main
from scla_mj.config import RunConfig
from scla_mj.engine.checked_brain import CheckedBrain
from scla_mj.errors import SclaError
from scla_mj.grid import Action, Cell
from scla_mj.runs.decisions import read_decisions
from scla_mj.runs.summary import read_summary
from scla_mj.signals import Activity, Decision, Percept, Snapshot

SPIKES = np.array([0, 3], np.int32)
QUIET = Activity(SPIKES, SPIKES, 1, 50, 100, np.ones(8), np.zeros(8))
HERE = Percept(Cell(1, 1), None)


class Answering(Brain):
    """Gives the answers that it was made with."""

    anatomy = PAPER_ANATOMY

    def __init__(self, decision=None, activity=None, snapshot=None):
        self.answers = decision, activity, snapshot

    def decide(self, percept):
        return self.answers[0]

    def learn(self, feedback):
        raise ZeroDivisionError("no rate")

    def activity(self):
        return self.answers[1]

    def snapshot(self):
        return self.answers[2]


def checked(**answers):
    return CheckedBrain(Answering(**answers), "my:Brain", cells=(5, 4))


def test_a_sensor_that_raises_is_named():
    brain = Answering()
    brain.sensors = {"ranges": lambda world: 1 / 0}
    with pytest.raises(SclaError, match="--brain my:Brain: its sensor ranges raised ZeroDivisionError"):
        CheckedBrain(brain, "my:Brain", cells=(5, 4)).sensors["ranges"](None)
    brain.sensors = ["ranges"]
    with pytest.raises(SclaError, match="its sensors must be a dict of functions by name"):
        CheckedBrain(brain, "my:Brain", cells=(5, 4))


@pytest.mark.parametrize(
    ("decision", "words"),
    [
        (Action.UP, "return a Decision, such as"),
        (2, "return a Decision, such as"),
        (None, "None (NoneType)"),
        ((Action.UP, None, None), "return a Decision, such as"),
        (Decision(2), "action is an Action"),
        (Decision(np.int64(2)), "action is an Action"),
        (Decision(Action.UP, advised=1), "advised"),
        (Decision(Action.UP, motor_spikes=(1, 2, 3)), "motor_spikes"),
        (Decision(Action.UP, motor_spikes=4), "motor_spikes"),
        (Decision(Action.UP, motor_spikes=(1, 2, 3, 0.5)), "motor_spikes"),
        (Decision(Action.UP, motor_spikes=(1, 2, 3, -1)), "motor_spikes"),
        (Decision(Action.UP, motor_spikes=np.zeros((4, 2), int)), "motor_spikes"),
    ],
)
def test_a_decision_of_the_wrong_kind_is_refused(decision, words):
    with pytest.raises(SclaError, match=r"my:Brain: its decide\(\) must") as refusal:
        checked(decision=decision).decide(HERE)
    assert words in str(refusal.value)


@pytest.mark.parametrize(
    ("activity", "words"),
    [
        ((SPIKES, SPIKES), "an Activity or None"),
        (QUIET._replace(spike_step=[0, 3]), "spike_step"),
        (QUIET._replace(spike_step=np.int32(0)), "spike_step"),
        (QUIET._replace(spike_step=np.zeros((2, 2), int)), "spike_step"),
        (QUIET._replace(spike_neuron=SPIKES[:1]), "spike_neuron"),
        (QUIET._replace(spike_neuron=SPIKES + NEURON_COUNT), "spike_neuron"),
        (QUIET._replace(spike_step=SPIKES[::-1]), "never falling"),
        (QUIET._replace(thinking_spikes=3), "thinking_spikes"),
        (QUIET._replace(steps=40), "thinking_steps"),
        (QUIET._replace(mean_weights=np.ones(7)), "mean_weights"),
        (QUIET._replace(dopamine=np.full(8, np.nan)), "dopamine"),
    ],
)
def test_an_activity_of_the_wrong_kind_is_refused(activity, words):
    with pytest.raises(SclaError, match=r"its activity\(\) must") as refusal:
        checked(activity=activity).activity()
    assert words in str(refusal.value)


@pytest.mark.parametrize(
    ("snapshot", "words"),
    [
        (None, "return a Snapshot"),
        (Snapshot(weights=np.ones((8, 10, 10))), "weights"),
        (Snapshot(weights=np.ones((8, 100, 100), int)), "weights"),
        (Snapshot(weights=np.ones((8, 100, 100), np.float16)), "weights are float16"),
        (Snapshot(probabilities=np.full((4, 5, 4), 0.25)), "(5, 4, 4)"),
        (Snapshot(probabilities=np.full((5, 4, 4), 0.5)), "sum to 1"),
        (Snapshot(probabilities=[[0.25] * 4]), "probabilities"),
    ],
)
def test_a_snapshot_of_the_wrong_kind_is_refused(snapshot, words):
    with pytest.raises(SclaError, match=r"its snapshot\(\) must") as refusal:
        checked(snapshot=snapshot).snapshot()
    assert words in str(refusal.value)


def test_right_answers_pass_and_spike_counts_become_plain_numbers():
    memory = Snapshot(np.ones((8, 100, 100), np.float32), np.full((5, 4, 4), 0.25))
    counted = QUIET._replace(counts=np.full((2, 12), 7))
    brain = checked(decision=Decision(Action.LEFT, None, np.arange(4)), activity=counted, snapshot=memory)
    assert brain.decide(HERE) == Decision(Action.LEFT, None, (0, 1, 2, 3))
    assert brain.activity() == QUIET, "spikes are counted anew"
    assert brain.snapshot() is memory


def test_our_own_brain_passes_every_check():
    config = dataclasses.replace(RunConfig(), brain="scla_mj.brain.scla:SclaBrain")
    plain, brain = (SclaBrain(check(config)) for _ in range(2))
    brain = CheckedBrain(brain, config.brain, cells=config.grid.cells)
    for _ in range(3):
        assert brain.decide(HERE) == plain.decide(HERE)
        brain.elapse(0.5)
        plain.elapse(0.5)
        assert np.array_equal(brain.activity().spike_step, plain.activity().spike_step)
    assert np.array_equal(brain.snapshot().weights, plain.snapshot().weights)
    assert np.array_equal(brain.network.weights, plain.network.weights)
    assert not hasattr(brain, "no_such_part")


def test_what_a_brain_raises_is_told_with_its_file_and_line():
    line = Answering.learn.__code__.co_firstlineno + 1
    with pytest.raises(SclaError) as refusal:
        checked().learn(None)
    assert (
        str(refusal.value) == f"--brain my:Brain: its learn() raised ZeroDivisionError: no rate, {__file__} line {line}"
    )


TIRING = """
from scla_mj.brain import Brain
from scla_mj.grid import Action
from scla_mj.signals import Decision, Snapshot

class Tiring(Brain):
    def __init__(self, checked):
        self.left = checked.config.seed

    def decide(self, percept):
        self.left -= 1
        return Decision(Action.UP) if self.left >= 0 else Action.UP

    def learn(self, feedback):
        pass

    def snapshot(self):
        return "nothing" if self.left == 0 else Snapshot()
"""


def test_a_run_refused_at_its_first_decision_leaves_nothing_and_later_what_was_complete(tmp_path, monkeypatch, capsys):
    (tmp_path / "tiring_brain.py").write_text(TIRING)
    monkeypatch.chdir(tmp_path)
    options = ["--brain", "tiring_brain:Tiring", "--decisions", "9", "--epochs", "1", "--telemetry"]
    assert main(["rollout", "run", *options, "off", "--seed", "0"]) == 2
    assert capsys.readouterr().err.startswith(
        "scla-mj: --brain tiring_brain:Tiring: its decide() must return a Decision"
    )
    assert not (tmp_path / "run").exists()
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("mine")
    assert main(["rollout", "mine", *options, "off", "--seed", "0"]) == 2
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["notes.txt"]
    capsys.readouterr()
    assert main(["rollout", "run", *options, "off", "--seed", "3"]) == 2
    assert "its decide() must return a Decision" in capsys.readouterr().err
    assert read_decisions(tmp_path / "run").num_rows == 3
    assert read_summary(tmp_path / "run").epochs[0].decisions == 3
    capsys.readouterr()
    assert main(["rollout", "forgetful", *options, "light", "--seed", "1"]) == 2
    assert "its snapshot() must return a Snapshot" in capsys.readouterr().err
    assert not (tmp_path / "forgetful").exists()
