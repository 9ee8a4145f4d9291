"""A rollout that starts from stored settings, and brains with settings of their own."""

import dataclasses
import json
import sys

import pytest

from scla_mj.cli.main import COMMANDS, main
from scla_mj.cli.options import parse
from scla_mj.config import RunConfig
from scla_mj.errors import SclaError
from scla_mj.runs.folder import open_run

FEW = ["--epochs", "1", "--decisions", "6", "--telemetry", "off"]
OWN_BRAIN = '''
from dataclasses import dataclass
from typing import Literal

from scla_mj.brain.baselines import RandomBrain


class Greedy(RandomBrain):
    @dataclass(frozen=True)
    class Settings:
        """How greedy it is."""

        greed: float = 0.5
        """Between 0 and 1."""
        quick: bool = True
        mode: Literal["bold", "shy"] = "bold"
        sizes: tuple[int, ...] = (1, 2)

    def __init__(self, checked, settings):
        super().__init__(checked)
'''


@pytest.fixture(autouse=True)
def workplace(tmp_path, monkeypatch):
    (tmp_path / "greedy_brain.py").write_text(OWN_BRAIN)
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    path = tmp_path_factory.mktemp("runs") / "made"
    own = ["--brain", "q-learning", "--brain.epsilon", "0.3"]
    assert main(["rollout", str(path), *FEW, *own, "--disturb", "tilt"]) == 0
    return path


def settings(*words):
    return parse(COMMANDS, ["rollout", "RUN", *words], prog="scla-mj").config


def refusal(*words):
    with pytest.raises(SclaError) as refused:
        settings(*words)
    return str(refused.value)


def test_a_stored_run_is_repeated_to_the_bit(made, tmp_path, capsys):
    assert main(["rollout", "again", "--config", str(made)]) == 0
    assert main(["inspect", "again", "--against", str(made)]) == 0
    assert "the same to the bit" in capsys.readouterr().out


def test_an_option_overrides_what_is_stored_and_nothing_else(made):
    stored = open_run(made).config
    for file in (made, made / "config.json"):
        assert settings(f"--config={file}") == stored
        varied = settings("--seed", "9", "--config", str(file), "--disturb", "mass")
        tilted = dataclasses.replace(stored.disturbance, mass_scale=(0.7, 1.3))
        assert varied == dataclasses.replace(stored, seed=9, disturbance=tilted)


def test_what_a_file_written_by_hand_leaves_out_takes_its_default(tmp_path):
    (tmp_path / "mine.json").write_text('{"seed": 3, "grid": {"cells": [7, 7]}}')
    config = settings("--config", "mine.json")
    assert config == dataclasses.replace(RunConfig(), seed=3, grid=dataclasses.replace(RunConfig().grid, cells=(7, 7)))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ('{"sede": 3}', "mine.json: sede is not a setting"),
        ('{"seed": "3"}', "mine.json: seed is '3': it must be a whole number"),
        ('{"seed": -3}', "mine.json: seed is -3"),
        ("[1]", "must hold a JSON object"),
        ("seed: 3", "must hold JSON"),
    ],
)
def test_a_file_with_what_is_no_setting_is_refused(content, said, tmp_path):
    (tmp_path / "mine.json").write_text(content)
    assert said in refusal("--config", "mine.json")


def test_a_changed_copy_is_taken_only_without_its_digest(made, tmp_path):
    content = json.loads((made / "config.json").read_text()) | {"seed": 4}
    (tmp_path / "mine.json").write_text(json.dumps(content))
    assert "take the digest out" in refusal("--config", "mine.json")
    del content["digest"]
    (tmp_path / "mine.json").write_text(json.dumps(content))
    assert settings("--config", "mine.json").seed == 4


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--config", "nowhere"], "nowhere does not exist"),
        (["--config", "."], "config.json does not exist"),
        (["--config="], "--config has no value"),
        (["--config", "a\nb"], "--config 'a\\nb' holds a control character"),
    ],
)
def test_a_file_that_is_not_there_is_named(words, said):
    assert said in refusal(*words)


def test_code_that_a_file_names_runs_only_if_it_is_named_again(tmp_path):
    file = "foreign.json"
    (tmp_path / file).write_text('{"brain": "greedy_brain:Greedy", "brain_settings": {"greed": 1}}')
    assert "name it again, --brain greedy_brain:Greedy, if you trust it" in refusal("--config", file)
    config = settings("--config", file, "--brain", "greedy_brain:Greedy", "--brain.no-quick")
    assert config.brain_settings == {"greed": 1, "quick": False}
    assert settings("--config", file, "--brain", "random").brain_settings == {}, "they were another brain's"


@pytest.mark.parametrize(
    ("words", "stored"),
    [
        ([], {}),
        (["--brain.greed", "0.7"], {"greed": 0.7}),
        (["--brain.no-quick", "--brain.sizes=3"], {"quick": False, "sizes": (3,)}),
        (["--brain.mode", "shy", "--brain.sizes", "3", "--brain.sizes", "4"], {"mode": "shy", "sizes": (3, 4)}),
    ],
)
def test_a_brain_takes_settings_of_its_own(words, stored):
    assert settings("--brain", "greedy_brain:Greedy", *words).brain_settings == stored
    assert settings(*words, "--brain=greedy_brain:Greedy").brain_settings == stored


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ["--brain.greed", "1"],
            "--brain.greed is not a setting of --brain scla: its own are release, released-at, gate",
        ),
        (["--brain.seed", "1"], "--brain.seed is not a setting of --brain scla: did you mean --seed?"),
        (["--brain=random", "--brain.reward_rate=1"], "reward-rate is not a setting of --brain random: it has none of"),
        (
            ["--brain", "dyna-q", "--brain.release", "1"],
            "of --brain dyna-q, but of scla, scla-dopamine, potjans: its own "
            "are learning-rate, discount, initial-value, epsilon, trace-decay, planning-steps, sensing",
        ),
        (["--brain", "dyna-q", "--brain.planing-steps", "1"], "did you mean --brain.planning-steps?"),
        (["--brain", "scla-printed", "--brain.greed", "1"], "of --brain scla-printed: it has none of its own"),
        (["--brain", "greedy_brain:Greedy", "--brain.greet", "1"], "did you mean --brain.greed?"),
        (["--brain", "greedy_brain:Greedy", "--brain.greed", "very"], "--brain.greed is very: it must be a number"),
        (["--brain", "greedy_brain:Greedy", "--brain.mode", "sly"], "--brain.mode is sly: it must be one of bold, shy"),
        (["--brain", "greedy_brain:Greedy", "--brain.greed", "1", "--brain.greed", "2"], "given twice"),
        (["--brain", "no.such:Brain", "--brain.greed", "1"], "no.such cannot be imported"),
    ],
)
def test_a_setting_that_the_brain_does_not_have_is_refused(words, said):
    assert said in refusal(*words)


@pytest.mark.parametrize("hint", ["dict[str, int]", "int | str", "tuple[bool, ...]", "tuple[int, str]", "list[int]"])
def test_a_setting_of_a_type_that_words_cannot_give_is_refused(hint, tmp_path, monkeypatch):
    (tmp_path / "odd_brain.py").write_text(OWN_BRAIN.replace("greed: float = 0.5", f"greed: {hint} = 0"))
    monkeypatch.delitem(sys.modules, "odd_brain", raising=False)
    assert "--brain.greed is of type" in refusal("--brain", "odd_brain:Greedy", "--brain.no-quick")


def test_whole_numbers_may_be_choices_and_a_value_may_be_left_to_none(tmp_path, monkeypatch):
    kinds = {"greed: float = 0.5": "greed: Literal[1, 2] = 1", "quick: bool = True": "quick: int | None = None"}
    code = OWN_BRAIN
    for before, after in kinds.items():
        code = code.replace(before, after)
    (tmp_path / "choice_brain.py").write_text(code)
    words = ["--brain", "choice_brain:Greedy", "--brain.greed"]
    assert settings(*words, "2", "--brain.quick", "3").brain_settings == {"greed": 2, "quick": 3}
    assert "must be one of 1, 2" in refusal(*words, "3")


def test_the_help_of_a_named_brain_lists_its_own_settings(capsys):
    with pytest.raises(SystemExit):
        main(["rollout", "--brain", "greedy_brain:Greedy", "--help"])
    assert "--brain.greed" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--brain", "random", "--network.projections", "SUtoML"], "is SUtoML, which --brain random does not read: "),
        (
            ["--plasticity.modulation", "scalar"],
            "which --brain scla does not read: leave it out or choose --brain scla-p",
        ),
        (["--automaton.epsilon", "0.5"], "choose --automaton.scheme reward-epsilon-penalty"),
        (["--task.jump-target", "1", "1"], "choose --task.jump-epoch"),
        (["--brain", "q-learning", "--brain.epsilon", "2"], "--brain.epsilon is 2.0: it must be 0 to 1"),
    ],
)
def test_an_option_that_nothing_reads_is_refused(words, said, capsys):
    assert main(["rollout", "run", *words]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b'{"seed": 3, "seed": 4}', "'seed' is given twice in one object"),
        (b'{"grid": {"cells": [7, 7], "cells": [5, 5]}}', "'cells' is given twice in one object"),
        (b"import numpy as np", "is not a file of settings: it must hold JSON"),
        ('{"seed": 3}'.encode("utf-16"), "is not a file of settings: it must hold JSON"),
        (b"[1]", "is not a file of settings: it must hold a JSON object, not list"),
    ],
)
def test_a_file_of_ones_own_that_cannot_mean_what_it_says_is_refused(content, sentence, tmp_path, capsys):
    (tmp_path / "mine.json").write_bytes(content)
    assert main(["rollout", "run", "--config", "mine.json", *FEW]) == 2
    assert sentence in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_a_byte_order_mark_before_the_settings_is_no_fault(tmp_path):
    (tmp_path / "mine.json").write_bytes(b"\xef\xbb\xbf" + b'{"seed": 7, "brain": "random"}')
    assert main(["rollout", "run", "--config", "mine.json", *FEW]) == 0
    assert open_run("run").config.seed == 7
