"""The stream under `decisions.parquet`: its batches are checked, and it can be taken back and gone on with."""

import pyarrow as pa
import pytest

from scla_mj.errors import SclaError
from scla_mj.paths import DECISIONS_PARQUET, DECISIONS_PARTIAL
from scla_mj.runs.decisions import DecisionLog, read_decisions, schema, take_back
from scla_mj.runs.stream import header

MOTORS = ("MU", "MD", "ML", "MR")
SCHEMA = schema(MOTORS)


def write_all(folder, records, **options):
    with DecisionLog(folder, MOTORS, **options) as log:
        for record in records:
            log.write(record)


def leave_open(folder, records, every):
    """Leave the stream of a killed run, in batches of `every` decisions."""
    with DecisionLog(folder, MOTORS) as log:
        for number, record in enumerate(records, 1):
            log.write(record)
            if number % every == 0:
                log.sync()
        log.sync()
        content = (folder / DECISIONS_PARTIAL).read_bytes()
    (folder / DECISIONS_PARQUET).unlink()
    (folder / DECISIONS_PARTIAL).write_bytes(content)


@pytest.fixture
def stream(tmp_path, walk):
    """An open stream of five batches of four decisions."""
    leave_open(tmp_path, walk(1, 20), 4)
    return tmp_path / DECISIONS_PARTIAL


def test_a_damaged_byte_is_never_taken_for_sound(stream):
    sound, rows = stream.read_bytes(), read_decisions(stream.parent)
    assert rows.num_rows == 20
    refused = 0
    for place in range(0, len(sound), 11):
        stream.write_bytes(sound[:place] + bytes([sound[place] ^ 0x20]) + sound[place + 1 :])
        try:
            read = read_decisions(stream.parent)
        except SclaError:
            refused += 1
        else:  # padding, or the length of the last batch, which then looks like one that was cut
            assert read.equals(rows.slice(0, read.num_rows)), place
            assert read.num_rows >= 16, place
    assert refused > len(sound) / 11 / 2


def test_a_stream_whose_end_is_zeros_after_a_power_cut_is_read_up_to_them(stream):
    sound = stream.read_bytes()
    stream.write_bytes(sound + bytes(500))
    assert read_decisions(stream.parent).num_rows == 20
    for lost in range(600, len(sound) - len(header(SCHEMA)), 97):
        stream.write_bytes(sound[:-lost] + bytes(lost))
        assert read_decisions(stream.parent).num_rows in (0, 4, 8, 12, 16), lost


@pytest.mark.parametrize("kept", [0, 1, 4, 299, 300, 700])
@pytest.mark.parametrize("closed", [True, False])
def test_a_log_that_was_taken_back_and_continued_has_the_same_bytes(tmp_path, walk, kept, closed):
    records = list(walk(3, 250))
    for name in ("whole", "cut"):
        (tmp_path / name).mkdir()
    write_all(tmp_path / "whole", records)
    if closed:
        write_all(tmp_path / "cut", records[:720])
    else:
        leave_open(tmp_path / "cut", records[:720], 100)
    take_back(tmp_path / "cut", kept, MOTORS)
    assert [path.name for path in (tmp_path / "cut").iterdir()] == [DECISIONS_PARTIAL]
    assert read_decisions(tmp_path / "cut").equals(pa.table(read_decisions(tmp_path / "whole").slice(0, kept)))
    write_all(tmp_path / "cut", records[kept:], resumed=True)
    first, second = (tmp_path / name / DECISIONS_PARQUET for name in ("whole", "cut"))
    assert first.read_bytes() == second.read_bytes()


def test_what_lies_after_the_kept_decisions_need_not_be_sound(stream):
    sound = stream.read_bytes()
    stream.write_bytes(sound[:-200] + b"\xff" * 200)
    take_back(stream.parent, 16, MOTORS)
    assert read_decisions(stream.parent).num_rows == 16


def test_a_log_shorter_than_its_checkpoint_is_refused_and_left_as_it_is(stream):
    sound = stream.read_bytes()
    with pytest.raises(SclaError, match="it holds 20 of 21 decisions"):
        take_back(stream.parent, 21, MOTORS)
    assert stream.read_bytes() == sound
    stream.unlink()
    with pytest.raises(SclaError, match="does not exist"):
        take_back(stream.parent, 1, MOTORS)


def test_a_stream_without_digests_is_not_taken_for_ours(tmp_path):
    with pa.OSFile(str(tmp_path / DECISIONS_PARTIAL), "wb") as file, pa.ipc.new_stream(file, SCHEMA) as writer:
        writer.write_batch(pa.RecordBatch.from_pylist([], schema=SCHEMA))
    with pytest.raises(SclaError, match="does not fit its SHA-256"):
        read_decisions(tmp_path)
