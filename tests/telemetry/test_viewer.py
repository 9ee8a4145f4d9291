"""A viewer follows a run by its files: it gets all of them, whole frames only, and the run does nothing but write."""

import io
import os
import subprocess
import threading
import warnings

import pytest
import rerun as rr

from scla_mj import RunConfig, resume, rollout
from scla_mj.paths import WATCHED, recordings
from scla_mj.telemetry import viewer
from scla_mj.telemetry.names import HIT


def hits_of(file):
    """The decisions whose hit a file holds, in their order, as Rerun's own reader finds them."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the file has no end yet
        chunks = rr.chunk.RrdReader(file).stream().filter(content=f"/{HIT}", is_static=False)
        return [row for chunk in chunks for row in chunk.to_record_batch().column("decision").to_pylist()]


@pytest.fixture(scope="module")
def in_two_parts(tmp_path_factory):
    """A run that was stopped at decision 25 of 60 and resumed; the first part's last frame is cut short."""
    folder = tmp_path_factory.mktemp("viewer") / "run"

    def stop(record, account):
        if account.decisions == 25:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        rollout(RunConfig(brain="dyna-q", epochs=2, decisions=30), folder, watch=stop)
    resume(folder)
    first, _ = recordings(folder)
    with first.open("ab") as file:
        file.write(b"\x02" + bytes(7) + b"\xff" * 8 + b"cut short")
    return folder


def test_a_viewer_gets_every_decision_of_every_part_once_and_nothing_that_is_not_whole(in_two_parts, tmp_path):
    stream = io.BytesIO()
    viewer.feed(in_two_parts, stream, lambda: True)
    seen = tmp_path / "seen.rrd"
    seen.write_bytes(stream.getvalue())
    assert sorted(hits_of(seen)) == list(range(1, 61))
    assert seen.read_bytes().count(b"RRF2") == 1
    assert not (in_two_parts / WATCHED).exists()


def test_following_says_when_the_run_is_over_for_the_viewer_stays_open(in_two_parts, monkeypatch, caplog):
    how = {"stdin": subprocess.PIPE, "stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    monkeypatch.setattr(viewer, "_start", lambda *words, **_: subprocess.Popen(["cat"], **how))
    with caplog.at_level("INFO"):
        assert viewer.follow(in_two_parts, lambda: True) == 0
    assert caplog.messages == [f"{in_two_parts} is over; the viewer stays open until you close it"]


def test_a_viewer_gets_what_a_growing_file_has_whole_and_the_rest_when_it_is_there(in_two_parts, tmp_path):
    whole = recordings(in_two_parts)[1].read_bytes()
    growing, stream = tmp_path / "recording.rrd", io.BytesIO()
    lengths = iter([0, 5, 12, 20, 5000, 5003, len(whole) // 2, len(whole)])

    def grow():
        length = next(lengths)
        growing.write_bytes(whole[:length])
        return length == len(whole)

    viewer.feed(tmp_path, stream, grow)
    assert whole.startswith(stream.getvalue())
    seen = tmp_path / "seen.rrd"
    seen.write_bytes(stream.getvalue())
    assert hits_of(seen) == list(range(26, 61))


@pytest.mark.parametrize(
    ("first", "second"), [(0, []), (5, []), (None, [5])], ids=["empty", "cut in its header", "the second just begun"]
)
def test_a_viewer_gets_one_header_whatever_of_a_part_is_there(first, second, in_two_parts, tmp_path):
    parts, stream = [part.read_bytes() for part in recordings(in_two_parts)], io.BytesIO()
    (tmp_path / "recording.rrd").write_bytes(parts[0][:first])
    lengths = iter([*second, len(parts[1])])

    def grow():
        (tmp_path / "recording-2.rrd").write_bytes(parts[1][: (length := next(lengths))])
        return length == len(parts[1])

    viewer.feed(tmp_path, stream, grow)
    assert stream.getvalue().startswith(b"RRF2") and stream.getvalue().count(b"RRF2") == 1


def test_a_viewer_that_is_closed_ends_its_feed_and_one_that_takes_nothing_holds_up_nobody_else(in_two_parts):
    reading, writing = os.pipe()
    with os.fdopen(writing, "wb") as sink:
        feed = threading.Thread(target=viewer.feed, args=(in_two_parts, sink, lambda: False))
        feed.start()
        feed.join(0.3)
        assert feed.is_alive()  # it waits for the viewer, or for more
        os.close(reading)
        feed.join(10)
        assert not feed.is_alive()


def test_a_followed_run_writes_every_second_the_rows_that_one_that_nobody_follows_writes_at_its_end(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(viewer, "_WRITE_EVERY_S", 0.0)
    config, sizes = RunConfig(brain="dyna-q", epochs=1, decisions=100), {}

    def run(name, *, followed):
        folder = tmp_path / name

        def watch(record, account):
            if followed:
                (folder / WATCHED).touch()
            if record.decision == 99:
                sizes[name] = len(hits_of(folder / "recording.rrd"))

        rollout(config, folder, watch=watch, pictures=False)
        return hits_of(folder / "recording.rrd"), (folder / "decisions.parquet").read_bytes()

    seen = run("followed", followed=True)
    assert seen == run("alone", followed=False)
    assert sizes["alone"] == 0 < sizes["followed"] <= 99
