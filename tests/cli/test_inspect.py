"""`scla-mj inspect` on real, short runs: the verdict first, each file compared, and one run against another."""

import json
import math
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from scla_mj.cli.main import main
from scla_mj.runs.atomic import read_json, write_json
from scla_mj.runs.checkpoint import write_checkpoint
from scla_mj.runs.decisions import read_decisions, schema

MOTORS = ("MU", "MD", "ML", "MR")
SCHEMA = schema(MOTORS)

OPTIONS = ["--epochs", "3", "--decisions", "12", "--brain", "automaton", "--task.jump-epoch", "3"]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A run whose target jumps, in a folder whose name is markup to some."""
    path = tmp_path_factory.mktemp("runs") / "[bold]run[red] :smile:"
    assert main(["rollout", str(path), *OPTIONS]) == 0
    return path


@pytest.fixture
def run(made, tmp_path):
    return shutil.copytree(made, tmp_path / made.name)


def inspect(run, capsys, *options):
    capsys.readouterr()
    code = main(["inspect", str(run), *options])
    return code, *(re.sub(r"\s+", " ", text) for text in capsys.readouterr())


def change_rows(run, name, value_of):
    (run / "seal.json").unlink()  # as if the run itself had written it so
    change_rows_again(run, name, value_of)


def change_rows_again(run, name, value_of):
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


def test_a_sound_run_says_so_in_its_first_line(run, capsys):
    code, out, err = inspect(run, capsys)
    assert (code, err) == (0, "")
    hits = sum(read_decisions(run)["hit"].to_pylist())
    percent = 100 * hits / (24 * 0.400 + 12 * 0.240)
    said = f"{run}: sound, complete: 3 epochs, {hits} hits of 36 decisions, {percent:.1f} % of the ceiling"
    assert out.startswith(f"{said}, recording agrees ")


def test_every_figure_that_was_compared_is_printed_on_demand(run, capsys):
    assert " brain.npz " not in inspect(run, capsys)[1]
    out = inspect(run, capsys, "--verbose")[1]
    assert all(name in out for name in ("config.json", "decisions.parquet", "summary.json", "brain.npz"))
    assert str(run / "recording.rrd") in out, "a path is printed as it is"


def test_a_brain_without_neurons_has_no_tables_of_spikes_and_weights(run, capsys):
    out = inspect(run, capsys, "--verbose")[1]
    assert "no neurons" in out
    assert "SU" not in out and "mean weights" not in out


def test_the_targets_jump_is_said_with_its_new_ceiling(run, capsys):
    out = inspect(run, capsys, "--verbose")[1]
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
    assert f": disagrees: {said}" in out


def content_or_none(run, name, content):
    if content is None:
        (run / name).unlink()
    else:
        (run / name).write_bytes(content)


@pytest.mark.parametrize("name", ["config.json", "decisions.parquet", "brain.npz", "summary.json", "recording.rrd"])
@pytest.mark.parametrize("content", [None, b"damaged"])
def test_damage_to_a_sealed_run_comes_before_all_else(run, capsys, name, content):
    content_or_none(run, name, content)
    code, out, err = inspect(run, capsys, "--verbose")
    assert (code, err) == (2, "")
    assert out.startswith(f"{run}: damaged: {name} is {'damaged' if content else 'missing'}")
    assert name == "config.json" or f"--config {shlex.quote(str(run / 'config.json'))}`" in out
    assert ": sound" not in out and "disagrees" not in out


@pytest.mark.parametrize("name", ["config.json", "decisions.parquet", "summary.json", "recording.rrd"])
@pytest.mark.parametrize("content", [None, b"damaged"])
def test_damage_to_an_unsealed_run_shows_where_its_files_cannot_be_so(run, capsys, name, content):
    (run / "seal.json").unlink()
    content_or_none(run, name, content)
    code, out, _ = inspect(run, capsys)
    assert code == 2
    assert out.startswith(f"{run}: damaged: ") and name in out
    assert " unsealed: " in out


def test_a_damaged_seal_vouches_for_nothing(run, capsys):
    (run / "seal.json").write_text("{}")
    code, out, _ = inspect(run, capsys)
    assert code == 2 and out.startswith(f"{run}: damaged: seal.json")


def test_a_run_whose_brain_was_not_written_yet_is_unfinished(run, capsys):
    """The brain is written last: of a run that was killed before, nothing is damaged."""
    (run / "seal.json").unlink()
    (run / "brain.npz").unlink()
    code, out, _ = inspect(run, capsys)
    assert code == 0 and "sound, unfinished: 36 of 36 decisions" in out


def test_a_run_with_decisions_left_is_unfinished_though_its_end_was_written(run, capsys):
    change_config(run, lambda config: config.update(epochs=4))
    code, out, _ = inspect(run, capsys)
    assert code == 0 and "sound, unfinished: 36 of 48 decisions" in out


def test_a_checkpoint_of_another_run_is_seen(run, capsys):
    (run / "seal.json").unlink()
    write_checkpoint(run, {"config": {"seed": 7}})
    code, out, _ = inspect(run, capsys)
    assert code == 2 and f"{run}: damaged: checkpoint.npz is of another run" in out


def test_a_killed_run_is_sound_as_far_as_it_went(tmp_path, capsys):
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
    code, out, err = inspect(run, capsys, "--verbose")
    assert (code, err) == (0, "")
    assert re.match(rf"{re.escape(str(run))}: sound, unfinished: \d+ of 1000000 decisions", out)
    assert f"scla-mj resume {run} continues it" in out
    assert "the recording is cut off" in out


def test_a_dash_under_light_telemetry_is_explained(tmp_path, capsys):
    assert main(["rollout", str(tmp_path / "run"), "--epochs", "1", "--decisions", "2"]) == 0
    code, out, _ = inspect(tmp_path / "run", capsys, "--verbose")
    assert code == 0
    assert "-: not recorded; spikes while driving are kept with --telemetry full" in out
    assert "SU" in out and "no neurons" not in out


@pytest.fixture(scope="module")
def unrecorded(tmp_path_factory):
    """The same run without a recording."""
    path = tmp_path_factory.mktemp("runs") / "off"
    assert main(["rollout", str(path), *OPTIONS, "--telemetry", "off"]) == 0
    return path


def test_a_run_that_was_not_recorded_is_inspected_too(unrecorded, tmp_path, capsys):
    code, out, _ = inspect(unrecorded, capsys, "--verbose")
    assert code == 0 and "% of the ceiling, no recording" in out
    run = shutil.copytree(unrecorded, tmp_path / "run")
    change_rows(run, "hit", lambda hits: [not hits[0], *hits[1:]])
    code, out, _ = inspect(run, capsys)
    assert code == 1 and "disagrees: epoch 1, hits of decisions (decisions.parquet)" in out


def test_json_is_one_object_with_the_verdict_and_the_counts(run, unrecorded, capsys):
    capsys.readouterr()
    for path, recorded in ((run, True), (unrecorded, False)):
        assert main(["inspect", str(path), "--json"]) == 0
        found = json.loads(capsys.readouterr().out)
        assert (found["verdict"], found["complete"], found["decisions"]) == ("sound", True, 36)
        assert found["settings"]["task"]["jump_epoch"] == 3
        assert [epoch["ceiling_hits_per_1000"] for epoch in found["epochs"]] == pytest.approx([400, 400, 240])
        assert (found["recording"] is not None) == recorded
    (run / "brain.npz").write_bytes(b"")
    assert main(["inspect", str(run), "--json"]) == 2
    found = json.loads(capsys.readouterr().out)
    assert found["verdict"] == "damaged" and list(found["faults"]) == ["brain.npz"]


def test_every_key_of_the_json_is_documented(run, made, capsys):
    page = (Path(__file__).parents[2] / "docs" / "command-line.md").read_text()
    capsys.readouterr()
    for options in ([], ["--against", str(made)]):
        main(["inspect", str(run), "--json", *options])
        for key in json.loads(capsys.readouterr().out):
            assert f"`{key}`" in page, key


def against(run, other, capsys):
    capsys.readouterr()
    code = main(["inspect", str(run), "--against", str(other)])
    return code, capsys.readouterr().out


def test_two_runs_of_the_same_settings_are_the_same_to_the_bit(run, made, unrecorded, capsys):
    code, out = against(run, made, capsys)
    assert code == 0 and "are the same to the bit: settings, 36 decisions, summary, brain" in out
    code, out = against(made, unrecorded, capsys)
    assert code == 1 and "differ: settings (telemetry); the same: decisions, summary, brain" in out
    assert "--telemetry: light | off" in out


def test_the_first_decision_that_differs_is_named_with_both_values(run, made, capsys):
    change_rows(run, "duration_s", lambda durations: [*durations[:14], -0.0, *durations[15:]])
    change_rows_again(run, "position_error_m", lambda errors: [*errors[:20], math.nan, *errors[21:]])
    code, out = against(run, made, capsys)
    assert code == 1 and "differ: decisions from epoch 2, decision 3 on; the same: settings" in out
    assert "epoch 2, decision 3, duration_s: -0.0 | " in out
    code, out = against(run, run, capsys)
    assert code == 0, "a number that is none is the same as itself"


def test_a_count_of_spikes_differs_from_none(run, made, tmp_path, capsys):
    other = shutil.copytree(made, tmp_path / "other")
    for path, count in ((run, 5), (other, None)):
        counts = pa.array([1, 2, 3, count, *[None] * 32], pa.int32())
        table = read_decisions(path)
        table = table.add_column(table.num_columns - 1, SCHEMA.field("spikes_MU"), counts)
        pq.write_table(table, path / "decisions.parquet")
        (path / "seal.json").unlink()
    code, out = against(run, other, capsys)
    assert code == 1 and "epoch 1, decision 4, spikes_MU: 5 | None" in out


def test_a_run_that_went_further_differs_where_the_other_ends(run, made, capsys):
    (run / "seal.json").unlink()
    pq.write_table(read_decisions(run).slice(0, 30), run / "decisions.parquet")
    code, out = against(run, made, capsys)
    assert code == 1 and "decisions from epoch 3, decision 7 on (30 and 36 of them)" in out


def test_a_damaged_run_is_not_compared(run, made, capsys):
    (run / "brain.npz").write_bytes(b"")
    assert main(["inspect", str(made), "--against", str(run)]) == 2
    assert f"cannot compare: {run}: damaged: brain.npz" in capsys.readouterr().err
