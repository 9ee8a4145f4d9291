"""`decisions.parquet`: what was written is what is read, whatever happens to the run in between."""

import io
import resource
import signal
import subprocess
import sys
import tracemalloc
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from scla_mj.errors import SclaError
from scla_mj.paths import DECISIONS_PARQUET, DECISIONS_PARTIAL
from scla_mj.runs.decisions import BATCH_ROWS, DecisionLog, read_decisions, schema

HERE = str(Path(__file__).parent)
MOTORS = ("MU", "MD", "ML", "MR")
SCHEMA = schema(MOTORS)
COLUMNS = (
    "epoch decision time_s x y sensed advised action to_x to_y outcome hit duration_s position_error_m "
    "heading_error_rad spikes_MU spikes_MD spikes_ML spikes_MR executed"
)


def write_all(folder, records):
    with DecisionLog(folder, MOTORS) as log:
        for record in records:
            log.write(record)


def test_the_columns_are_the_documented_ones():
    assert " ".join(SCHEMA.names) == COLUMNS


def test_every_decision_is_read_back_as_it_was_made(tmp_path, walk):
    records = list(walk(2, 600))
    write_all(tmp_path, records)
    rows = pq.read_table(tmp_path / DECISIONS_PARQUET).to_pylist()
    assert len(rows) == 1200
    for record, row in zip(records, rows, strict=True):
        assert (row["epoch"], row["decision"], row["time_s"]) == (record.epoch, record.decision, record.time_s)
        assert (row["x"], row["y"]) == record.percept.cell
        assert (row["to_x"], row["to_y"]) == record.move.after
        assert row["sensed"] == (record.percept.sensed.name.lower() if record.percept.sensed is not None else "none")
        assert row["action"] == record.chosen.action.name.lower()
        assert (row["outcome"], row["hit"]) == (str(record.move.outcome), record.hit)
        assert row["position_error_m"] == record.move.position_error_m
        assert tuple(row[f"spikes_{name}"] for name in ("MU", "MD", "ML", "MR")) == record.chosen.motor_spikes


def test_directions_are_words_and_an_absent_one_is_none(tmp_path, walk):
    write_all(tmp_path, walk(1, 2000))
    table = read_decisions(tmp_path)
    assert set(table["sensed"].unique().to_pylist()) == {"up", "down", "left", "right", "none"}
    assert set(table["advised"].unique().to_pylist()) == {"up", "down", "left", "right", "none"}
    assert set(table["action"].unique().to_pylist()) == {"up", "down", "left", "right"}
    assert not set(table["outcome"].unique().to_pylist()) - {"moved", "blocked", "failed"}


def test_a_brain_without_motor_populations_has_no_columns_of_spikes(tmp_path, walk):
    with DecisionLog(tmp_path) as log:
        for record in walk(1, 10, spiking=False):
            log.write(record)
    assert read_decisions(tmp_path).column_names == [name for name in COLUMNS.split() if "spikes" not in name]


def test_a_brain_that_counts_no_spikes_this_time_has_nulls(tmp_path, walk):
    write_all(tmp_path, walk(1, 10, spiking=False))
    assert read_decisions(tmp_path)["spikes_MU"].null_count == 10


def test_columns_of_spikes_are_named_after_the_brains_own_motor_populations(tmp_path, walk):
    with DecisionLog(tmp_path, ("left", "right")) as log:
        for record in walk(1, 10):
            log.write(record._replace(chosen=record.chosen._replace(motor_spikes=(3, 4))))
    assert read_decisions(tmp_path)["spikes_right"].to_pylist() == [4] * 10


def test_the_same_decisions_give_the_same_bytes_however_they_were_batched(tmp_path, walk):
    for name, every in (("a", 10**9), ("b", 7)):
        (tmp_path / name).mkdir()
        with DecisionLog(tmp_path / name, MOTORS) as log:
            for number, record in enumerate(walk(2, 400)):
                log.write(record)
                if number % every == 0:
                    log.flush()
    first, second = (tmp_path / name / DECISIONS_PARQUET for name in "ab")
    assert first.read_bytes() == second.read_bytes()


def test_a_run_without_a_decision_still_has_a_table(tmp_path):
    DecisionLog(tmp_path, MOTORS).close()
    assert read_decisions(tmp_path).num_rows == 0


def test_closing_leaves_the_table_alone_in_the_folder_and_closing_twice_is_harmless(tmp_path, walk):
    log = DecisionLog(tmp_path, MOTORS)
    for record in walk(1, 3):
        log.write(record)
    log.close()
    log.close()
    assert [path.name for path in tmp_path.iterdir()] == [DECISIONS_PARQUET]


def test_an_interrupted_run_keeps_its_decisions(tmp_path, walk):
    def interrupted():
        yield from walk(1, 300)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_all(tmp_path, interrupted())
    assert read_decisions(tmp_path).num_rows == 300


KILLED = """
import sys; sys.path.insert(0, sys.argv[2])
from pathlib import Path
from conftest import walk
from scla_mj.runs.decisions import DecisionLog, schema
log = DecisionLog(Path(sys.argv[1]), ("MU", "MD", "ML", "MR"))
for number, record in enumerate(walk(2, 600)):
    log.write(record)
    if number == 1109:
        print("here", flush=True); sys.stdin.read()
"""


def test_a_run_killed_outright_is_read_up_to_its_last_whole_batch(tmp_path, walk):
    run = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(tmp_path), HERE], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert run.stdout.readline() == b"here\n"
    run.send_signal(signal.SIGKILL)
    run.communicate()
    table = read_decisions(tmp_path)
    assert table.num_rows == 600 + 2 * BATCH_ROWS  # an epoch's end, then two batches of 1110 - 600 decisions
    (tmp_path / "whole").mkdir()
    write_all(tmp_path / "whole", walk(2, 600))
    assert table.equals(read_decisions(tmp_path / "whole").slice(0, table.num_rows))


def test_a_stream_cut_anywhere_is_read_up_to_its_last_whole_batch(tmp_path, walk):
    log = DecisionLog(tmp_path, MOTORS)
    ends = [(tmp_path / DECISIONS_PARTIAL).stat().st_size]
    for record in walk(1, 12):
        log.write(record)
        if record.decision % 4 == 0:
            log.flush()
            ends.append((tmp_path / DECISIONS_PARTIAL).stat().st_size)
    whole = (tmp_path / DECISIONS_PARTIAL).read_bytes()
    log.close()
    (tmp_path / "cut").mkdir()
    for size in sorted(
        {*range(0, len(whole), 29), *(end + near for end in ends[1:] for near in (-1, 0, 1)), len(whole)}
    ):
        (tmp_path / "cut" / DECISIONS_PARTIAL).write_bytes(whole[:size])
        assert read_decisions(tmp_path / "cut").num_rows == 4 * sum(size >= end for end in ends[1:]), size


def test_a_full_disk_ends_in_a_sentence_and_every_whole_batch_stays_readable(tmp_path, walk):
    script = KILLED.replace('print("here", flush=True); sys.stdin.read()', "log.close()")
    limit = 60_000

    def fill():
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    run = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path), HERE],
        preexec_fn=fill,
        capture_output=True,
        text=True,
        check=False,
    )
    assert "SclaError: cannot write" in run.stderr.splitlines()[-1]
    rows = read_decisions(tmp_path).num_rows
    assert rows >= BATCH_ROWS
    assert rows % BATCH_ROWS == 0


FULL_FOR_A_WHILE = """
import resource, sys; sys.path.insert(0, sys.argv[2])
from pathlib import Path
from conftest import walk
from scla_mj.errors import SclaError
from scla_mj.runs.decisions import DecisionLog

log = DecisionLog(Path(sys.argv[1]), ("MU", "MD", "ML", "MR"))
resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, resource.RLIM_INFINITY))
try:
    for record in walk(2, 600):
        log.write(record)
except SclaError:
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    log.close()
    print("closed")
"""


def test_nothing_is_written_after_half_a_batch_even_when_the_disk_has_room_again(tmp_path):
    run = subprocess.run(
        [sys.executable, "-c", FULL_FOR_A_WHILE, str(tmp_path), HERE], capture_output=True, text=True, check=True
    )
    assert run.stdout == "closed\n"
    assert [path.name for path in tmp_path.iterdir()] == [DECISIONS_PARTIAL]
    rows = read_decisions(tmp_path).num_rows
    assert rows >= BATCH_ROWS
    assert rows % BATCH_ROWS == 0


def test_memory_does_not_grow_with_the_run(tmp_path, walk, monkeypatch):
    monkeypatch.setattr("scla_mj.runs.decisions.ROW_GROUP_ROWS", 500)

    def peak_bytes(folder, decisions):
        folder.mkdir()
        tracemalloc.start()
        arrow = pa.total_allocated_bytes()
        write_all(folder, walk(1, decisions))
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert pa.total_allocated_bytes() - arrow < 100_000
        return peak

    peak_bytes(tmp_path / "first", 1000)
    # 4000 rows that stayed would be some 4 MB; what waits for the garbage collector is a tenth of that.
    assert peak_bytes(tmp_path / "long", 5000) < peak_bytes(tmp_path / "short", 1000) + 500_000


def test_two_runs_cannot_share_a_folder_and_a_finished_one_is_not_written_over(tmp_path, walk):
    log = DecisionLog(tmp_path, MOTORS)
    with pytest.raises(SclaError, match="in use by another run"):
        DecisionLog(tmp_path, MOTORS)
    log.close()
    with pytest.raises(SclaError, match="already holds the decisions"):
        DecisionLog(tmp_path, MOTORS)


def test_a_folder_without_decisions_is_named(tmp_path):
    with pytest.raises(SclaError, match=r"decisions\.parquet is missing"):
        read_decisions(tmp_path)


def test_a_table_of_other_columns_or_words_is_refused(tmp_path, walk):
    write_all(tmp_path, walk(1, 5))
    table = read_decisions(tmp_path)
    pq.write_table(table.drop_columns(["hit"]), tmp_path / DECISIONS_PARQUET)
    with pytest.raises(SclaError, match="not a table of decisions"):
        read_decisions(tmp_path)
    words = pa.array(["up", "up", "sideways", "up", "up"])
    pq.write_table(table.set_column(7, SCHEMA.field("action"), words), tmp_path / DECISIONS_PARQUET)
    with pytest.raises(SclaError, match="action is 'sideways', it must be one of"):
        read_decisions(tmp_path)


def test_no_damage_to_the_table_goes_unseen(tmp_path, walk):
    """Pages carry checksums: a flipped byte is refused, or lies outside all data and changes nothing."""
    write_all(tmp_path, walk(1, 60))
    path, sound = tmp_path / DECISIONS_PARQUET, read_decisions(tmp_path)
    whole = path.read_bytes()
    refused = 0
    for place in range(0, len(whole), 23):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x55]) + whole[place + 1 :])
        try:
            assert read_decisions(tmp_path).equals(sound), place
        except SclaError:
            refused += 1
    assert refused > 0
    for damaged in (b"", b"PAR1", whole[:-1], io.BytesIO(whole).read(len(whole) // 2), b"\0" * 500):
        path.write_bytes(damaged)
        with pytest.raises(SclaError, match="is damaged"):
            read_decisions(tmp_path)


@pytest.mark.parametrize("content", [b"hello", b"\xff\xff\xff\xff\x10\0\0\0garbage", b"\0" * 4096])
def test_a_foreign_stream_is_not_taken_for_a_killed_run(tmp_path, content):
    (tmp_path / DECISIONS_PARTIAL).write_bytes(content)
    with pytest.raises(SclaError, match="is damaged"):
        read_decisions(tmp_path)
