"""Whatever is typed does what it says or is refused: no option means something else in silence."""

from pathlib import Path

import pytest

from scla_mj.cli.bench import bench_command
from scla_mj.cli.main import COMMANDS, main
from scla_mj.cli.options import parse
from scla_mj.config import RunConfig
from scla_mj.disturbances import SETS
from scla_mj.errors import SclaError


def parsed(*words):
    return parse(COMMANDS | {"bench": bench_command()}, list(words), prog="scla-mj")


def refusal(*words):
    with pytest.raises(SclaError) as refused:
        parsed(*words)
    return str(refused.value)


def disturbed(*words):
    """The disturbances that differ from none."""
    config = parsed("rollout", "RUN", *words).config.disturbance
    return {name for name, value in vars(config).items() if value != getattr(RunConfig().disturbance, name)}


@pytest.mark.parametrize(
    "words",
    [
        ["--disturb", "friction", "mass"],
        ["--disturb", "friction", "--disturb", "mass"],
        ["--disturb=friction", "--disturb=mass"],
        ["--disturb=friction", "mass"],
        ["--disturb", "friction", "--seed", "1", "--disturb=mass"],
    ],
)
def test_a_list_in_pieces_is_the_whole_list(words):
    assert disturbed(*words) == {"friction_scale", "mass_scale"}


def test_all_disturbances_are_all_of_them_however_written():
    every = {setting for figures in SETS.values() for setting in figures}
    assert disturbed("--disturb=all") == disturbed("--disturb", "all") == every


def test_closed_cells_and_experiments_add_up():
    cells = parsed("rollout", "RUN", "--closed-cells", "1", "1", "--closed-cells=2", "2").config.grid.closed_cells
    assert cells == ((1, 1), (2, 2))
    assert parsed("reproduce", "OUT", "--only", "paper", "--only=world").only == ("paper", "world")


@pytest.mark.parametrize(
    ("words", "field", "value"),
    [
        (["--seed=3"], "seed", 3),
        (["--seed", "-3"], "seed", -3),
        (["--brain=-x"], "brain", "-x"),
        (["--brain", "None"], "brain", "None"),
        (["--task.action_noise", "0.5"], "task.action_noise", 0.5),
        (["--task.action-noise", "-.5"], "task.action_noise", -0.5),
        (["--network.sensory-drive=-inf"], "network.sensory_drive", -float("inf")),
        (["--target=2", "4"], "grid.target", (2, 4)),
        (["--automaton.no-local-rule"], "automaton.local_rule", False),
        (["--automaton.no_local_rule"], "automaton.local_rule", False),
    ],
)
def test_a_value_is_taken_as_it_is_written(words, field, value):
    found = parsed("rollout", *words, "RUN").config
    for name in field.split("."):
        found = getattr(found, name)
    assert found == value


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--seed", "1", "--seed", "2"], "--seed is given twice: 1 and 2"),
        (["--task.action-noise", "0", "--task.action_noise=0"], "--task.action-noise is given twice: 0 and 0"),
        (["--target", "1", "1", "--target", "2", "2"], "--target is given twice: 1 1 and 2 2"),
        (["--automaton.local-rule", "--automaton.local-rule"], "--automaton.local-rule is given twice"),
        (["--automaton.local-rule", "--automaton.no-local-rule"], "are both given"),
        (["--automaton.local-rule=False"], "takes no value, such as False"),
        (["--automaton.local-rule", "false"], "--automaton.no-local-rule says no"),
        (["--seed="], "--seed has no value: it must be a whole number"),
        (["--seed"], "--seed has no value"),
        (["--seed", " "], "--seed has no value"),
        (["--seed", "--epochs", "3"], "--seed has no value"),
        (["--brain="], "--brain has no value"),
        (["--brain", "-x"], "--brain has no value"),
        (["--seed", "1e3"], "--seed is 1e3: it must be a whole number"),
        (["--network.sensory-drive", "much"], "is much: it must be a number"),
        (["--target", "1", "two"], "--target is two: it must be 2 whole numbers"),
        (["--target=2,4"], "--target is 2,4"),
        (["--target", "1", "2", "3"], "3 is one word too many: RUN is RUN already"),
        (["--telemetry", "LIGHT"], "--telemetry is LIGHT: it must be one of off, light, full"),
        (["--disturb"], "--disturb has no value"),
        (["--disturb", "tilt", "runs/x"], "is runs/x: it must be one of friction"),
        (["--disturb=friction,mass"], "--disturb is friction,mass"),
        (["--closed-cells"], "--closed-cells has no value: it must be pairs of whole numbers; RUN goes before it"),
        (["--closed-cells", "1", "--closed-cells", "2", "3", "3"], "--closed-cells is 1: it must be pairs"),
        (["--see", "3"], "--see is not an option: did you mean --seed?"),
        (["--action-noise", "0"], "did you mean --task.action-noise?"),
        (["--learning-rate", "3", "--brain", "dyna-q"], "did you mean --brain.learning-rate?"),
        (["--reward-rate", "0", "--brain", "dyna-q"], "--automaton.reward-rate, which --brain dyna-q does not read?"),
        (["--reward-rate", "0", "--brain", "my:Own"], "did you mean --automaton.reward-rate?"),
        (["--brain=scla-printed", "--automaton.nolocal-rule"], "did you mean --automaton.no-local-rule?"),
        (["-s", "3"], "-s is not an option"),
        (["-5"], "-5 is not an option"),
        (["--nonsense"], "see --help"),
        (["again"], "again is one word too many: RUN is RUN already"),
        (["--", "--seed", "1"], "--seed is one word too many"),
    ],
)
def test_what_cannot_mean_what_it_says_is_refused(words, said):
    assert said in refusal("rollout", "RUN", *words)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "a command is missing: choose rollout"),
        (["--seed", "3", "rollout", "RUN"], "--seed stands before the command"),
        (["rolout", "RUN"], "rolout is not a command: did you mean rollout?"),
        (["fly"], "fly is not a command: choose rollout"),
        (["rollout"], "RUN is missing"),
        (["rollout", "--closed-cells", "1", "1"], "RUN is missing"),
        (["inspect", "--seed", "3"], "--seed is not an option"),
        (["bench", "--out", "a\tb"], "--out 'a\\tb' holds a control character"),
        (["bench", "RUN"], "RUN is one word too many: it belongs to no option"),
    ],
)
def test_a_command_that_is_missing_or_misplaced_is_named(words, said):
    assert said in refusal(*words)


def test_none_is_a_name_like_any_other():
    assert parsed("reproduce", "None").path == Path("None")
    assert parsed("resume", "RUN", "--brain", "None").brain == "None"


def test_after_two_dashes_a_folder_may_have_any_name_and_a_list_has_ended():
    assert parsed("inspect", "--", "-x").path == Path("-x")
    chosen = parsed("rollout", "--disturb", "tilt", "--", "friction")
    assert (chosen.path, chosen.config.disturbance.friction_scale) == (Path("friction"), (1.0, 1.0))


ODD_PATHS = [
    ("", "is empty"),
    (" ", "is empty"),
    ("a\nb", "control character"),
    ("a\0b", "control character"),
    ("a\x1b[31m", "control character"),
    ("a\u2028b", "a line"),
    ("a\udcff", "not UTF-8"),
    ("x" * 256, "is too long"),
    ("é" * 128, "has 256 bytes"),
    ("x/" * 2000, "is too long"),
    ("~no-such-user/run", "nobody's home"),
    ("file/below", "is a file, not a folder"),
    ("file/far/below", "is a file, not a folder"),
    ("loop/below", "cannot be looked at"),
]


@pytest.mark.parametrize(("path", "said"), ODD_PATHS)
@pytest.mark.parametrize("command", ["rollout", "resume", "inspect", "reproduce"])
def test_an_odd_path_gets_a_sentence_before_anything_runs(command, path, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    Path("loop").symlink_to("loop")
    assert main([command, path]) == 2
    printed = capsys.readouterr()
    assert said in printed.err and printed.err.count("\n") == 1 and "\x1b" not in printed.err
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["file", "loop"]


def test_a_sentence_stays_one_line_whatever_a_word_holds(capsys):
    for words in (["--brain", "a\nb\x1b[31m:\udcff"], ["--a\nb\x1b[31m"], ["one", "a\nb\x1b[31m"]):
        assert main(["rollout", "RUN", *words]) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1 and "\x1b" not in said


@pytest.mark.parametrize("option", ["--version", "-V"])
def test_the_version_is_told(option, capsys):
    assert main([option]) == 0
    assert capsys.readouterr().out == "scla-mj 0.1.0\n"


def test_the_experiments_are_listed_without_a_folder(capsys):
    assert main(["reproduce", "--list"]) == 0
    assert "scla-dopamine-any-start" in capsys.readouterr().out
    assert main(["reproduce"]) == 2
    assert "OUT is missing" in capsys.readouterr().err
