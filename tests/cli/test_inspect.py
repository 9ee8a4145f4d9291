"""`scla-mj inspect` on real, short runs: it compares every file, and says what is missing."""

import re
import shutil
import signal
import subprocess
import sys
import time

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from scla_mj.cli.main import main
from scla_mj.runs.atomic import read_json, write_json
from scla_mj.runs.decisions import SCHEMA, read_decisions


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A run whose target jumps, in a folder whose name is markup to some."""
    path = tmp_path_factory.mktemp("runs") / "[bold]run[red] :smile:"
    options = ["--epochs", "3", "--decisions", "12", "--brain", "automaton", "--task.jump-epoch", "3"]
    assert main(["rollout", str(path), *options]) == 0
    return path


@pytest.fixture
def run(made, tmp_path):
    return shutil.copytree(made, tmp_path / made.name)


def inspect(run, capsys):
    capsys.readouterr()
    code = main(["inspect", str(run)])
    return code, *(re.sub(r"\s+", " ", text) for text in capsys.readouterr())


def change_rows(run, name, value_of):
    (run / "seal.json").unlink()  # as if the run itself had written it so
    table = read_decisions(run)
    index = SCHEMA.get_field_index(name)
    column = pa.array(value_of(table[name].to_pylist()), SCHEMA.field(name).type)
    table = table.set_column(index, SCHEMA.field(name), column)
    pq.write_table(table, run / "decisions.parquet")


def change_config(run, change):
    (run / "seal.json").unlink()
    content = read_json(run / "config.json")
    change(content)
    write_json(run / "config.json", content)


def test_a_run_agrees_in_every_file(run, capsys):
    code, out, err = inspect(run, capsys)
    assert (code, err) == (0, "")
    assert "agrees with the run's files: config.json, decisions.parquet, summary.json, brain.npz" in out


def test_a_path_is_printed_as_it_is(run, capsys):
    assert str(run / "recording.rrd") in inspect(run, capsys)[1]


def test_a_brain_without_neurons_has_no_tables_of_spikes_and_weights(run, capsys):
    out = inspect(run, capsys)[1]
    assert "no neurons" in out
    assert "SU" not in out and "mean weights" not in out


def test_the_targets_jump_is_said_with_its_new_ceiling(run, capsys):
    out = inspect(run, capsys)[1]
    assert "the target jumps to cell (1, 5) at the beginning of epoch 3" in out
    assert "400.00" in out and "240.00" in out


@pytest.mark.parametrize(
    ("name", "value_of", "said"),
    [
        ("hit", lambda hits: [not hits[0], *hits[1:]], "epoch 1, hits of decisions"),
        ("epoch", lambda epochs: [*epochs[:-1], 2], "epoch 2, hits of decisions"),
        ("outcome", lambda outcomes: ["failed", *outcomes[1:]], "moves failed"),
        ("duration_s", lambda durations: [*durations[:-1], durations[-1] + 0.01], "simulated time, s"),
        ("position_error_m", lambda errors: [0.5, *errors[1:]], "largest position error, m"),
    ],
)
def test_a_row_that_does_not_fit_the_recording_is_seen(run, capsys, name, value_of, said):
    change_rows(run, name, value_of)
    code, out, _ = inspect(run, capsys)
    assert code == 1
    assert f"{said} (decisions.parquet)" in out and "(summary.json)" not in out


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda config: config.update(seed=99), "seed (config.json)"),
        (lambda config: config.update(telemetry="full"), "telemetry (config.json)"),
        (lambda config: config["grid"].update(target=[2, 3]), "target (config.json)"),
        (lambda config: config["task"].update(jump_target=[5, 5]), "jump of the target: epoch, x, y (config.json)"),
    ],
)
def test_a_setting_that_does_not_fit_the_recording_is_seen(run, capsys, change, said):
    change_config(run, change)
    code, out, _ = inspect(run, capsys)
    assert code == 1
    assert f"disagree: {said}" in out


@pytest.mark.parametrize("name", ["config.json", "decisions.parquet", "brain.npz", "summary.json"])
@pytest.mark.parametrize("content", [None, b"damaged"])
@pytest.mark.parametrize("sealed", [True, False])
def test_a_missing_or_damaged_file_is_named_after_what_the_recording_holds(run, capsys, name, content, sealed):
    if not sealed:
        (run / "seal.json").unlink()
    if content is None:
        (run / name).unlink()
    else:
        (run / name).write_bytes(content)
    code, out, err = inspect(run, capsys)
    assert code == 2
    missing = "seal.json lists it" in err if sealed else "cut off" in err or "does not exist" in err
    assert name in err and ("damaged" in err if content else missing)
    assert (" sealed: " in out, " unsealed: " in out) == (sealed, not sealed)
    assert "path length" in out and "agrees with the run's files" not in out
    assert "disagree" not in out


def test_a_killed_runs_recording_is_shown_and_its_end_explained(tmp_path, capsys):
    run = tmp_path / "killed"
    command = [sys.executable, "-m", "scla_mj.cli.main", "rollout", str(run), "--decisions", "100000"]
    process = subprocess.Popen(
        [*command, "--brain", "shortest-path"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    recording, deadline = run / "recording.rrd", time.monotonic() + 90
    while time.monotonic() < deadline and not (recording.exists() and recording.stat().st_size > 0):
        time.sleep(0.1)
    time.sleep(1.0)
    process.send_signal(signal.SIGKILL)
    process.wait()
    code, out, err = inspect(run, capsys)
    assert code == 2
    assert "the run was cut off before its summary was written" in err
    assert "path length" in out and "the recording is cut off" in out
    assert "disagree" not in out


def test_a_dash_under_light_telemetry_is_explained(tmp_path, capsys):
    assert main(["rollout", str(tmp_path / "run"), "--epochs", "1", "--decisions", "2"]) == 0
    code, out, _ = inspect(tmp_path / "run", capsys)
    assert code == 0
    assert "-: not recorded; spikes while driving are kept with --telemetry full" in out
    assert "SU" in out and "no neurons" not in out
