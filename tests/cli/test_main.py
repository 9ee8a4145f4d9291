"""The command line as a user meets it."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from scla_mj.cli.main import COMMANDS, main
from scla_mj.runs.decisions import read_decisions

SCRIPTS = Path(__file__).parents[2] / "scripts"


def refused(arguments, capsys):
    """The one sentence that a bad call prints."""
    assert main(arguments) == 2
    printed = capsys.readouterr()
    assert "Traceback" not in printed.err + printed.out
    assert printed.err.startswith("scla-mj: ")
    assert printed.err.count("\n") == 1, printed.err
    return printed.err


@pytest.mark.parametrize(
    ("options", "named", "allowed"),
    [
        (["--protocol", "sometimes"], "sometimes", "sensed-start"),
        (["--target", "6", "3"], "(6, 3)", "1 to 5"),
        (["--target", "3"], "--target", "2 whole numbers"),
        (["--decisions", "0"], "--decisions is 0", "1 to"),
        (["--epochs", "-2"], "--epochs is -2", "1 to"),
        (["--epochs", "many"], "many", "--epochs"),
        (["--cells", "1", "1"], "1 1", "two cells"),
        (["--telemetry", "loud"], "loud", "light"),
        (["--nonsense", "1"], "--nonsense", "see --help"),
        (["--clock.physics-step-ms", "3.3"], "physics-step-ms 3.3", "multiple"),
        (["--network.weight-low", "5"], "weight-low", "swap"),
        (["--automaton.reward-rate", "nan"], "reward-rate is nan", "finite"),
        (["--closed-cells", "3", "2", "2", "3", "4", "3", "3", "4"], "walled off", "open a way"),
        (["--brain", "psychic"], "psychic", "q-learning"),
        (["--disturb", "friction", "earthquake"], "earthquake", "pushes"),
        (["--localisation", "gps"], "gps", "sensors"),
        (["--disturbance.friction-scale", "1.5", "0.3"], "friction-scale is 1.5 0.3", "lower end"),
        (["--brain", "no.such:Brain"], "no.such", "imported"),
        (["--brain", "shortest-path", "--task.jump-epoch", "2"], "shortest-path", "jump-epoch"),
        (["--brain", "shortest-path", "--task.crossed-epoch", "2"], "shortest-path", "crossed-epoch"),
        (["--task.jump-epoch", "11"], "--task.jump-epoch is 11", "ends after epoch 10"),
        (["--clock.physics-step-ms", "1e-6"], "physics-step-ms is 1e-06", "0.1 to 20"),
    ],
)
def test_a_bad_option_gets_one_sentence_and_exit_code_2(options, named, allowed, tmp_path, capsys):
    run = tmp_path / "run"
    sentence = refused(["rollout", str(run), *options], capsys)
    assert named in sentence
    assert allowed in sentence
    assert not run.exists(), "a refused run leaves nothing behind"


def test_a_missing_folder_or_command_is_named(capsys):
    assert "RUN" in refused(["rollout"], capsys)
    assert "fly" in refused(["fly"], capsys)


def test_a_run_is_never_written_over_another_nor_into_a_file(tmp_path, capsys):
    run = tmp_path / "run"
    assert main(["rollout", str(run), "--epochs", "1", "--decisions", "2", "--telemetry", "off"]) == 0
    before = {file.name: file.read_bytes() for file in run.iterdir()}
    capsys.readouterr()
    assert "already holds a run" in refused(["rollout", str(run)], capsys)
    assert {file.name: file.read_bytes() for file in run.iterdir()} == before
    (tmp_path / "file").write_text("mine")
    assert "file" in refused(["rollout", str(tmp_path / "file")], capsys)
    assert "cannot" in refused(["rollout", str(tmp_path / "file" / "below")], capsys)
    assert (tmp_path / "file").read_text() == "mine"


def test_a_folder_without_a_name_is_refused_and_a_tilde_is_the_home_folder(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert "RUN is empty" in refused(["rollout", ""], capsys)
    assert "OUT is empty" in refused(["reproduce", " "], capsys)
    assert "nobody" in refused(["rollout", "~no-such-user/run"], capsys)
    assert list(tmp_path.iterdir()) == []
    options = ["--epochs", "1", "--decisions", "2", "--telemetry", "off", "--brain", "random"]
    assert main(["rollout", "~/run", *options]) == 0
    assert (tmp_path / "run" / "summary.json").is_file()


def test_the_end_of_a_rollout_reads_well_at_80_columns_whatever_its_folder_is_called(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    run = tmp_path / "a [bold] name:smile:" / "run"
    assert main(["rollout", str(run), "--epochs", "1", "--decisions", "2", "--brain", "random"]) == 0
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    assert f"The run:  {run}" in lines
    assert f"Look at it:  scla-mj view '{run}'" in lines
    assert lines[:2] == [
        "any-start, 5x5, target (3, 3), seed 0",
        "ceiling 400.00, chance 31.58 hits per 1000 decisions",
    ]
    assert not any("…" in line for line in lines)
    assert any(re.fullmatch(r"2 moves: \d completed, \d blocked, 0 failed", line) for line in lines)
    assert any(re.fullmatch(r"largest position error \S+ mm; \d s simulated in \d+ s", line) for line in lines)


def test_inspecting_what_is_no_run_gets_one_sentence(tmp_path, capsys):
    assert "not a run folder" in refused(["inspect", str(tmp_path / "nowhere")], capsys)
    assert "config.json" in refused(["inspect", str(tmp_path)], capsys)


def test_help_names_the_commands_and_every_setting(capsys):
    for arguments, words in (
        (["--help"], ["rollout", "inspect"]),
        (["rollout", "--help"], ["--network.sensory-noise"]),
    ):
        with pytest.raises(SystemExit) as stop:
            main(arguments)
        assert stop.value.code == 0
        printed = capsys.readouterr().out
        assert all(word in printed for word in words)


def test_a_rollout_ends_with_a_table_its_files_and_the_line_that_opens_the_recording(tmp_path, capsys):
    run = tmp_path / "run"
    assert main(["rollout", str(run), "--epochs", "2", "--decisions", "30", "--seed", "7"]) == 0
    printed = capsys.readouterr().out
    assert re.search(r"scla-mj view \S+", printed)
    hits = [epoch["hits"] for epoch in json.loads((run / "summary.json").read_text())["epochs"]]
    table = read_decisions(run)
    assert table.num_rows == 60
    assert sum(hits) == sum(table["hit"].to_pylist())
    names = {file.name for file in run.iterdir()}
    assert names == {
        "config.json", "decisions.parquet", "summary.json", "brain.npz", "learning.png", "weights.png", "policy.png",
        "recording.rrd", "seal.json",
    }  # fmt: skip
    assert all(name in printed for name in names)
    assert main(["inspect", str(run)]) == 0
    assert "recording agrees" in capsys.readouterr().out


def test_where_no_policy_earns_more_than_chance_inspect_says_nothing_to_be_above_it(tmp_path, capsys):
    options = ["--epochs", "1", "--decisions", "5", "--brain", "random", "--telemetry", "off"]
    assert main(["rollout", str(tmp_path / "run"), *options, "--task.action-noise", "0.75"]) == 0
    capsys.readouterr()
    assert main(["inspect", str(tmp_path / "run")]) == 0
    assert "chance 31.58 per 1000: nothing earns more\n" in capsys.readouterr().out
    assert main(["inspect", str(tmp_path / "run"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["percent_above_chance"] is None


def test_the_scripts_take_the_same_options(tmp_path):
    run = tmp_path / "run"
    options = ["--epochs", "1", "--decisions", "3"]
    for script, arguments in (("rollout.py", [str(run), *options]), ("inspect_recording.py", [str(run)])):
        subprocess.run([sys.executable, SCRIPTS / script, *arguments], check=True, capture_output=True, cwd=tmp_path)
    assert read_decisions(run).num_rows == 3


def test_named_disturbances_are_kept_as_the_figures_that_they_stand_for(tmp_path, capsys):
    run = tmp_path / "run"
    options = ["--disturb", "friction", "latency", "--disturbance.tilt-deg", "1", "--localisation", "sensors"]
    few = ["--epochs", "1", "--decisions", "2", "--telemetry", "off", "--brain", "random"]
    assert main(["rollout", str(run), *options, *few]) == 0
    kept = json.loads((run / "config.json").read_text())
    assert kept["disturbance"]["friction_scale"] == [0.3, 1.5]
    assert (kept["disturbance"]["latency_periods"], kept["disturbance"]["tilt_deg"]) == (1, 1.0)
    assert kept["disturbance"]["mass_scale"] == [1.0, 1.0]
    assert (
        "Under:  friction-scale (0.3, 1.5), latency-periods 1, tilt-deg 1.0, localisation sensors"
        in capsys.readouterr().out
    )
    assert json.loads((run / "summary.json").read_text())["localisation"]["wrong_cells"] == 0


def test_help_and_version_load_no_heavy_library():
    lines = "from scla_mj.cli.main import main; import contextlib, sys"
    for words in (["--version"], ["--help"], ["rollout", "--help"], ["inspect", "--help"]):
        lines += f"\nwith contextlib.suppress(SystemExit): main({words})"
    heavy = "{'numpy', 'numba', 'mujoco', 'matplotlib', 'pyarrow', 'pydantic', 'rerun', 'scipy'}"
    lines += f"\nprint({heavy} & sys.modules.keys(), file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", lines], capture_output=True, text=True, check=True)
    assert done.stderr == "set()\n"


def test_benchmarks_that_are_not_installed_are_said_to_be_so(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr("scla_mj.cli.bench._CHECKOUT", tmp_path)
    assert "from a git checkout" in refused(["bench", "--growth"], capsys)


@pytest.mark.parametrize("arguments", [["--help"], *([command, "--help"] for command in COMMANDS)])
def test_output_that_nobody_reads_ends_quietly(arguments):
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as pipe:
        command = [sys.executable, "-m", "scla_mj.cli.main", *arguments]
        done = subprocess.run(command, stdout=pipe, stderr=subprocess.PIPE, text=True, check=False)
    assert done.stderr == ""
    assert done.returncode == 141


def test_a_sentence_that_nobody_reads_ends_quietly():
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as pipe:
        command = [sys.executable, "-m", "scla_mj.cli.main", "fly"]
        assert subprocess.run(command, stdout=pipe, stderr=pipe, check=False).returncode == 141


def test_a_typed_figure_counts_for_more_than_a_named_set_even_where_it_is_the_neutral_one(tmp_path):
    run = tmp_path / "run"
    options = ["--disturb", "all", "--disturbance.tilt-deg", "0", "--disturbance.friction_scale", "1", "1"]
    few = ["--epochs", "1", "--decisions", "2", "--telemetry", "off", "--brain", "random"]
    assert main(["rollout", str(run), *options, *few]) == 0
    kept = json.loads((run / "config.json").read_text())["disturbance"]
    assert (kept["tilt_deg"], kept["friction_scale"], kept["mass_scale"]) == (0.0, [1.0, 1.0], [0.7, 1.3])
