from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import rerun as rr
import synthetic_run
from synthetic_run import open_recorder, record_run, records, snapshot

from scla_mj.anatomy import POPULATIONS, PROJECTION_NAMES
from scla_mj.config import RunConfig, TaskConfig
from scla_mj.errors import SclaError
from scla_mj.signals import Outcome
from scla_mj.telemetry.reading.comparison import RunFiles, compare
from scla_mj.telemetry.reading.reader import inspect_recording


@pytest.fixture(scope="module")
def run():
    return list(records(epochs=3, decisions=100, spikes=600, thinking_spikes=120))


@pytest.fixture(scope="module")
def memory():
    return snapshot(np.random.default_rng(5))


@pytest.fixture(scope="module")
def folder(tmp_path_factory, run, memory):
    path = tmp_path_factory.mktemp("recordings")
    for mode in ("light", "full"):
        record_run(path / f"{mode}.rrd", mode, run, memory)
    return path


def summary_of(run) -> dict:
    """Return what summary.json would say, counted here."""
    epochs = []
    for epoch in sorted({record.epoch for record in run}):
        hits = [record.hit for record in run if record.epoch == epoch]
        epochs.append({"epoch": epoch, "decisions": len(hits), "hits": sum(hits), "ceiling_hits_per_1000": 400.0})
    outcomes = [record.move.outcome for record in run]
    return {
        "protocol": "any-start",
        "seed": 7,
        "cells": [5, 5],
        "target": [3, 3],
        "ceiling_hits_per_1000": 400.0,
        "epochs": epochs,
        "transitions": {
            "commanded": len(run),
            "completed": outcomes.count(Outcome.MOVED),
            "blocked": outcomes.count(Outcome.BLOCKED),
            "failed": 0,
        },
        "max_position_error_m": max(record.move.position_error_m for record in run),
        "simulated_s": float(run[-1].move.trajectory[-1, 0]),
    }


CONFIG = {
    "seed": 7,
    "protocol": "any-start",
    "telemetry": "light",
    "cells": (5, 5),
    "target": (3, 3),
    "cell_size_m": 0.3,
    "thinking_window_s": 0.05,
    "jumps": [],
}


@pytest.mark.parametrize("mode", ["light", "full"])
def test_a_recording_alone_tells_hits_spikes_weights_and_memory(folder, run, memory, mode):
    seen = inspect_recording(folder / f"{mode}.rrd")
    assert (seen.mode, seen.finished, seen.properties["protocol"]) == (mode, True, "any-start")
    for epoch in seen.epochs:
        hits = [record.hit for record in run if record.epoch == epoch.epoch]
        assert (epoch.decisions, epoch.hits) == (len(hits), sum(hits))
    for population, counted in zip(POPULATIONS, seen.populations, strict=True):
        mine = [
            (record.activity.spike_neuron >= population.start) & (record.activity.spike_neuron < population.stop)
            for record in run
        ]
        thinking = sum(
            np.count_nonzero(here & (record.activity.spike_step < 50)) for here, record in zip(mine, run, strict=True)
        )
        assert counted.thinking_spikes == thinking
        assert counted.thinking_rate_hz == pytest.approx(thinking / population.size / (0.050 * len(run)))
        assert counted.whole_spikes == (sum(map(np.count_nonzero, mine)) if mode == "full" else None)
    first, last = run[0].activity.mean_weights, run[-1].activity.mean_weights
    assert list(seen.first_weights.values()) == first.tolist() and list(seen.last_weights) == list(PROJECTION_NAMES)
    assert list(seen.last_weights.values()) == last.tolist()
    assert np.array_equal(list(seen.weights.values()), memory.weights)
    assert {matrix.dtype for matrix in seen.weights.values()} == {np.dtype(np.float32)}
    assert seen.probabilities.tobytes() == memory.probabilities.tobytes()


def test_the_path_is_as_long_as_the_robot_drove(tmp_path):
    run = []
    for record in records(epochs=1, decisions=40, spikes=10, thinking_spikes=5):
        rows = record.move.trajectory.copy()
        # A straight line between two centres, without the made-up wobble.
        start, end = rows[0, 1:4], rows[-1, 1:4]
        rows[:, 1:4] = start + np.linspace(0, 1, len(rows))[:, None] * (end - start)
        run.append(record._replace(move=record.move._replace(trajectory=rows)))
    record_run(tmp_path / "r.rrd", "light", run)
    driven = sum(float(np.linalg.norm(np.diff(record.move.trajectory[[0, -1], 1:4], axis=0))) for record in run)
    assert inspect_recording(tmp_path / "r.rrd").path_length_m == pytest.approx(driven, rel=1e-5)


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_a_recording_agrees_with_its_run_in_either_precision(tmp_path, run, memory, precision):
    weights = memory.weights.astype(precision)
    means = weights.mean(axis=(1, 2), dtype=float)
    last = run[-1]._replace(activity=run[-1].activity._replace(mean_weights=means))
    brain = memory._replace(weights=weights)
    record_run(tmp_path / "r.rrd", "light", [*run[:-1], last], brain)
    summary = summary_of(run)
    rows = compare(inspect_recording(tmp_path / "r.rrd"), RunFiles(CONFIG, summary, summary, brain))
    assert len(rows) >= 40
    assert {row.file for row in rows} == {"config.json", "decisions.parquet", "summary.json", "brain.npz"}
    assert [row for row in rows if not row.agrees] == []


def test_each_difference_from_the_run_is_named(folder, run, memory):
    seen = inspect_recording(folder / "light.rrd")
    brain = memory._replace(
        weights=np.array([seen.last_weights[name] for name in PROJECTION_NAMES])[:, None, None] * np.ones((8, 100, 100))
    )

    def differing(**change) -> set[str]:
        rows = compare(seen, RunFiles(summary=summary_of(run) | change))
        return {row.what for row in rows if not row.agrees}

    assert differing(seed=8) == {"seed"}
    assert differing(protocol="sensed-start") == {"protocol"}
    assert differing(max_position_error_m=None) == {"largest position error, m"}
    epochs = summary_of(run)["epochs"]
    assert differing(epochs=[*epochs[:-1], epochs[-1] | {"hits": epochs[-1]["hits"] + 1}]) == {
        "epoch 3, hits of decisions"
    }
    assert differing(epochs=epochs[:-1]) == {"epoch 3, hits of decisions"}
    one_bit = memory.weights.copy()
    one_bit[0, 0, 0] = np.nextafter(one_bit[0, 0, 0], np.float32(9))
    named = {row.what: row.agrees for row in compare(seen, RunFiles(brain=memory._replace(weights=one_bit)))}
    assert not named["last weights SUtoMU"] and named["last weights SUtoMD"] and named["last action probabilities"]
    means = {row.what: row.agrees for row in compare(seen, RunFiles(brain=brain))}
    assert all(means[f"last mean weight {name}"] for name in PROJECTION_NAMES)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"seed": 8}, "seed"),
        ({"cells": (5, 6)}, "cells"),
        ({"target": (3, 2)}, "target"),
        ({"protocol": "sensed-start"}, "protocol"),
        ({"telemetry": "full"}, "telemetry"),
        ({"thinking_window_s": 0.04}, "thinking_window_s"),
        ({"jumps": [(2, 1, 5)]}, "jump of the target: epoch, x, y"),
    ],
)
def test_a_setting_that_is_not_the_recordings_is_named(folder, change, named):
    rows = compare(inspect_recording(folder / "light.rrd"), RunFiles(config=CONFIG | change))
    assert [row.what for row in rows if not row.agrees] == [named]


def test_a_jump_of_the_target_is_told_by_the_recording_alone(tmp_path):
    run = list(records(epochs=3, decisions=20, spikes=10, thinking_spikes=5))
    config = RunConfig(seed=7, task=TaskConfig(jump_epoch=2, jump_target=(1, 5)))
    record_run(tmp_path / "r.rrd", "light", run, config=config)
    seen = inspect_recording(tmp_path / "r.rrd")
    assert seen.jumps == ((2, (1, 5)),)
    assert [epoch.ceiling_hits_per_1000 for epoch in seen.epochs] == [400.0, 240.0, 240.0]
    for jumps, agrees in (([(2, 1, 5)], True), ([(3, 1, 5)], False), ([(2, 1, 4)], False), ([], False)):
        rows = compare(seen, RunFiles(config=CONFIG | {"jumps": jumps}))
        assert all(row.agrees for row in rows) is agrees


def test_of_several_snapshots_the_last_one_counts(tmp_path, run):
    memories = [snapshot(np.random.default_rng(seed)) for seed in range(3)]
    with open_recorder(tmp_path / "r.rrd") as recorder:
        for record, memory in zip(run, memories[:2], strict=False):
            recorder.write(record, memory)
            recorder._stream.flush()  # each in a chunk of its own, as in a real run
        recorder.write(run[2])
        recorder.close(memories[2])
    seen = inspect_recording(tmp_path / "r.rrd")
    assert np.array_equal(list(seen.weights.values()), memories[2].weights)
    assert seen.probabilities.tobytes() == memories[2].probabilities.tobytes()


_KILLED = """
import os, signal, sys
sys.path[:0] = {paths!r}
from synthetic_run import open_recorder, records
from pathlib import Path
recorder = open_recorder(Path(sys.argv[1]))
for record in records(epochs=1, decisions=1050, spikes=20, thinking_spikes=10):
    recorder.write(record)
recorder._stream.flush()
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_the_recording_of_a_killed_run_is_readable_up_to_its_last_columns(tmp_path):
    script = _KILLED.format(paths=[str(Path(synthetic_run.__file__).parent)])
    done = subprocess.run([sys.executable, "-c", script, str(tmp_path / "r.rrd")], capture_output=True, timeout=60)
    assert done.returncode == -signal.SIGKILL, done.stderr.decode()
    seen = inspect_recording(tmp_path / "r.rrd")
    assert (seen.finished, seen.decisions) == (False, 1000)
    run = list(records(epochs=1, decisions=1050, spikes=20, thinking_spikes=10))
    assert seen.epochs[0].hits == sum(record.hit for record in run[:1000])


@pytest.mark.parametrize("share", [0.3, 0.6, 0.95])
def test_a_recording_cut_anywhere_is_readable_or_refused_in_a_sentence(folder, tmp_path, share):
    whole = (folder / "full.rrd").read_bytes()
    (tmp_path / "cut.rrd").write_bytes(whole[: int(share * len(whole))])
    seen = inspect_recording(tmp_path / "cut.rrd")
    assert not seen.finished and seen.decisions in (0, 200, 300)


def test_bytes_that_abort_the_decoder_are_refused_in_a_sentence(folder, tmp_path, monkeypatch):
    # Whether bad bytes abort or raise depends on where they fall: this decoder always aborts.
    (tmp_path / "rerun_bindings.py").write_text("import os; os.abort()")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    shutil.copy(folder / "light.rrd", tmp_path)  # one that was not decoded before
    with pytest.raises(SclaError, match=r"light\.rrd is damaged: its data cannot be decoded$"):
        inspect_recording(tmp_path / "light.rrd")


def test_a_damaged_recording_is_refused_in_a_sentence(folder, tmp_path):
    whole = bytearray((folder / "light.rrd").read_bytes())
    middle = len(whole) // 2
    whole[middle : middle + 200_000] = os.urandom(200_000)  # more than one entity's columns
    (tmp_path / "damaged.rrd").write_bytes(whole)
    with pytest.raises(SclaError, match=r"damaged\.rrd is damaged: [^\n]+$"):
        inspect_recording(tmp_path / "damaged.rrd")


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (None, "there is no recording"),
        (b"", "is empty"),
        (b"\x89PNG and so on", "is not a Rerun recording"),
        (b"RRF2", "is damaged"),
    ],
)
def test_what_is_no_recording_is_refused_in_a_sentence(tmp_path, content, sentence):
    if content is not None:
        (tmp_path / "x.rrd").write_bytes(content)
    with pytest.raises(SclaError, match=rf"^[^\n]*{sentence}[^\n]*$"):
        inspect_recording(tmp_path / "x.rrd")


def test_somebody_elses_recording_is_refused_in_a_sentence(tmp_path):
    stream = rr.RecordingStream("another_program")
    stream.save(tmp_path / "x.rrd")
    stream.log("points", rr.Points2D([[0, 0]]))
    stream.flush()
    stream.disconnect()
    with pytest.raises(SclaError, match="was recorded by 'another_program'"):
        inspect_recording(tmp_path / "x.rrd")


def test_a_run_that_recorded_no_decision_is_readable(tmp_path):
    open_recorder(tmp_path / "r.rrd").close()
    seen = inspect_recording(tmp_path / "r.rrd")
    assert (seen.decisions, seen.epochs, seen.weights, seen.path_length_m) == (0, (), {}, 0.0)
