"""A recording in parts says what one in a single file would: every decision once, nothing missing."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from synthetic_run import open_part, records, snapshot

from scla_mj.errors import SclaError
from scla_mj.paths import part_number, recording_part, recordings
from scla_mj.telemetry.reading.reader import inspect_recording


@pytest.fixture(scope="module")
def run():
    return list(records(epochs=2, decisions=60, spikes=300, thinking_spikes=80))


def record_in_parts(folder, run, mode, saved, killed):
    """Record until a kill at one decision, and go on from what was saved at an earlier one."""
    memory = snapshot(np.random.default_rng(5))
    with open_part(folder, 1, mode) as first:
        for number, record in enumerate(run[:killed], 1):
            first.write(record)
            if number == saved:
                first.sync()
                state = first.state()
        first.sync()
        shutil.copy(folder / recording_part(1), folder / "killed")
    (folder / "killed").replace(folder / recording_part(1))
    with open_part(folder, 2, mode, first=saved + 1) as second:
        second.restore(state)
        for record in run[saved:]:
            second.write(record)
        second.close(memory)
    with open_part(folder, 9, mode) as whole:
        for record in run:
            whole.write(record)
        whole.close(memory)
    (folder / recording_part(9)).replace(folder / "whole.rrd")


def figures(seen):
    return {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in (seen._asdict() | seen.weights).items()
        if name not in ("parts", "properties", "path_length_m", "weights")
    }


@pytest.mark.parametrize(
    ("mode", "saved", "killed"), [("light", 37, 37), ("full", 37, 59), ("light", 60, 75), ("light", 59, 61)]
)
def test_two_parts_say_what_one_file_says(tmp_path, run, mode, saved, killed):
    record_in_parts(tmp_path, run, mode, saved, killed)
    parts = recordings(tmp_path)
    assert [path.name for path in parts] == ["recording.rrd", "recording-2.rrd"]
    assert not inspect_recording(parts[0]).finished
    assert inspect_recording(parts[0]).decisions == killed
    seen, whole = inspect_recording(*parts), inspect_recording(tmp_path / "whole.rrd")
    assert figures(seen) == figures(whole)
    assert seen.decisions == 120
    assert seen.path_length_m == pytest.approx(whole.path_length_m)


def test_a_missing_part_is_seen(tmp_path, run):
    record_in_parts(tmp_path, run, "light", 37, 59)
    third = open_part(tmp_path, 3, "light", first=130)
    third.write(run[0])
    third.close()
    with pytest.raises(SclaError, match="it holds 121 of 130 decisions"):
        inspect_recording(*recordings(tmp_path))


@pytest.mark.parametrize("content", [b"", 12])
def test_a_part_that_was_cut_off_at_its_birth_is_left_out(tmp_path, run, content):
    record_in_parts(tmp_path, run, "light", 37, 59)
    start = (tmp_path / recording_part(2)).read_bytes()[:12]
    (tmp_path / recording_part(3)).write_bytes(content if content == b"" else start)
    assert inspect_recording(*recordings(tmp_path)).decisions == 120
    with pytest.raises(SclaError, match="stopped before it wrote anything"):
        inspect_recording(tmp_path / recording_part(3))


@pytest.mark.parametrize("other", [{"run_id": "another"}, {"seed": 8}])
def test_a_part_of_another_recording_is_refused(tmp_path, run, other):
    record_in_parts(tmp_path, run, "light", 37, 59)
    with open_part(tmp_path, 3, "light", first=121, **other) as stray:
        stray.write(run[0])
    with pytest.raises(SclaError, match=r"recording-3\.rrd is not part of the recording"):
        inspect_recording(*recordings(tmp_path))


def test_a_recording_that_vanished_is_told_at_the_next_sync(tmp_path, run):
    with open_part(tmp_path, 1, "light") as recorder:
        recorder.write(run[0])
        (tmp_path / recording_part(1)).unlink()
        with pytest.raises(SclaError, match="cannot be written: No such file"):
            recorder.sync()


def test_nothing_more_is_recorded_where_the_disk_has_no_room(tmp_path, run, monkeypatch):
    """Rerun's threads would wait for ever; what was recorded before is whole."""
    with open_part(tmp_path, 1, "light") as recorder:
        for record in run[:10]:
            recorder.write(record)
        recorder.sync()
        monkeypatch.setattr("shutil.disk_usage", lambda path: shutil._ntuple_diskusage(10**9, 10**9, 1_900_000))
        recorder.write(run[10])
        with pytest.raises(SclaError, match=r"1\.9 MB are free, 2\.\d MB are wanted; free the disk"):
            recorder.sync()
        with pytest.raises(SclaError, match="are wanted"):
            recorder.close()
    assert inspect_recording(tmp_path / recording_part(1)).decisions == 10


def test_parts_are_named_and_ordered_by_number():
    for number in (1, 2, 10):
        assert part_number(recording_part(number)) == number
    for name in ("recording-1.rrd", "recording-0.rrd", "recording-02.rrd", "my-recording.rrd", "recording.rrd.tmp"):
        assert part_number(name) is None
