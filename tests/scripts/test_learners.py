"""The command that compares learners: its curves are those of rollouts, kept, and the pages' tables are theirs."""

import importlib.util
import sys
from pathlib import Path

import pytest

from scla_mj import RunConfig, simulate
from scla_mj.errors import SclaError
from scla_mj.runs.atomic import read_json

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def learners():
    spec = importlib.util.spec_from_file_location("learners", ROOT / "scripts" / "learners.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["learners"] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    yield module
    del sys.modules["learners"]


def test_a_curve_is_that_of_the_rollout_and_is_not_computed_again(learners, tmp_path, monkeypatch, capsys):
    options = learners.Options(tmp_path, seeds=(4, 5), decisions=1000, learners=("dyna-q",))
    learners.main(options)
    curve = learners.Curve(**read_json(tmp_path / "curves" / "dyna-q" / "seed-05.json"))
    simulation = simulate(RunConfig(brain="dyna-q", brain_settings={"sensing": "reflex"}, seed=5))
    assert curve.hits == [number for number in range(1, 1001) if simulation.step().hit]
    printed = capsys.readouterr().out
    assert "Dyna-Q with a reflex | 2 seeds (4 to 5)" in printed
    assert (tmp_path / learners.FIGURE).stat().st_size > 10_000

    learner = learners.LEARNERS["dyna-q"]
    for settings in (dict(curve.settings), {"brain": "q-learning"}):
        changed = learner._replace(prepare=lambda settings=settings: (None, settings))  # would fail if it learned
        monkeypatch.setitem(learners.LEARNERS, "dyna-q", changed)
        if settings == curve.settings:
            learners.main(options)
            assert capsys.readouterr().out == printed
        else:
            with pytest.raises(SclaError, match="other settings: choose another OUT"):
                learners.main(options)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [({"learners": ("q",)}, "names among scla"), ({"decisions": 1500}, "multiple of 1000"),
     ({"seeds": ()}, "one or more"), ({"learners": ("scla",), "take": True}, "leave --learners out")],
)  # fmt: skip
def test_what_cannot_be_measured_is_refused_before_anything_is(learners, tmp_path, wrong, words):
    with pytest.raises(SclaError, match=words):
        learners.main(learners.Options(tmp_path / "out", **wrong))
    assert not (tmp_path / "out").exists()


def test_a_package_that_is_missing_is_named_with_the_remedy(learners, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    with pytest.raises(SclaError, match=r"DQN needs stable_baselines3, .*run pip install 'scla-mj\[sb3\]'"):
        learners.main(learners.Options(tmp_path, learners=("dqn",)))


def test_the_pages_have_the_tables_of_the_committed_curves(learners):
    for path, text in learners.texts(ROOT).items():
        assert path.read_text(encoding="utf-8") == text, f"{path} is out of step: scripts/learners.py OUT --take"
