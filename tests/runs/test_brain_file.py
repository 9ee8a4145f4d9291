"""`brain.npz`: the same arrays give the same bytes, and nothing else is taken for a brain."""

import zipfile

import numpy as np
import pytest

from scla_mj.anatomy import PAPER_ANATOMY, PROJECTION_NAMES, Anatomy, Projection, stacked
from scla_mj.errors import SclaError
from scla_mj.paths import BRAIN_NPZ
from scla_mj.runs.brain import read_brain, write_brain
from scla_mj.signals import Snapshot


def snapshot(precision=np.float32):
    rng = np.random.default_rng(3)
    probabilities = rng.dirichlet(np.ones(4), (5, 5))
    return Snapshot(rng.uniform(0, 4, (8, 100, 100)).astype(precision), probabilities)


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_a_brain_is_read_back_to_the_bit(tmp_path, precision):
    written = snapshot(precision)
    write_brain(tmp_path, written, anatomy=PAPER_ANATOMY)
    read = read_brain(tmp_path, PAPER_ANATOMY)
    assert read.weights.dtype == precision
    assert np.array_equal(read.weights, written.weights)
    assert np.array_equal(read.probabilities, written.probabilities)


def test_plain_numpy_opens_it_and_finds_the_projections_names(tmp_path):
    write_brain(tmp_path, snapshot(), anatomy=PAPER_ANATOMY)
    with np.load(tmp_path / BRAIN_NPZ, allow_pickle=False) as archive:
        assert set(archive.files) == {"weights", "projections", "probabilities"}
        assert tuple(archive["projections"]) == PROJECTION_NAMES
        assert archive["weights"].shape == (8, 100, 100)


def test_the_same_brain_gives_the_same_bytes_at_any_time_of_day(tmp_path, monkeypatch):
    write_brain(tmp_path, snapshot(), anatomy=PAPER_ANATOMY)
    first = (tmp_path / BRAIN_NPZ).read_bytes()
    monkeypatch.setattr("time.time", lambda: 2e9)
    write_brain(tmp_path, snapshot(), anatomy=PAPER_ANATOMY)
    assert (tmp_path / BRAIN_NPZ).read_bytes() == first
    with zipfile.ZipFile(tmp_path / BRAIN_NPZ) as archive:
        assert {member.date_time[0] for member in archive.infolist()} == {1980}


@pytest.mark.parametrize("part", ["weights", "probabilities"])
def test_a_brain_may_lack_synapses_or_automata(tmp_path, part):
    write_brain(tmp_path, Snapshot(**{part: getattr(snapshot(), part)}), anatomy=PAPER_ANATOMY)
    read = read_brain(tmp_path, PAPER_ANATOMY)
    assert [name for name in read._fields if getattr(read, name) is not None] == [part]


@pytest.mark.parametrize("kept", [0, 1, 2])
def test_a_directory_that_lost_entries_is_not_taken_for_a_brain_that_lacks_them(tmp_path, kept):
    write_brain(tmp_path, snapshot(), anatomy=PAPER_ANATOMY)
    path = tmp_path / BRAIN_NPZ
    content = bytearray(path.read_bytes())
    with zipfile.ZipFile(path) as archive:
        lost = sum(46 + len(entry.filename) + len(entry.extra) for entry in archive.infolist()[kept:])
        directory = sum(46 + len(entry.filename) + len(entry.extra) for entry in archive.infolist())
    end = len(content) - 22  # of a ZIP without a comment: the directory's size stands 12 bytes into its last record
    content[end + 12 : end + 16] = (directory - lost).to_bytes(4, "little")
    path.write_bytes(content)
    with pytest.raises(SclaError, match="damaged"):
        read_brain(tmp_path, PAPER_ANATOMY)


def write_arrays(folder, **changes):
    arrays = {"weights": snapshot().weights, "projections": np.array(PROJECTION_NAMES), **changes}
    np.savez(folder / BRAIN_NPZ, **{name: array for name, array in arrays.items() if array is not None})


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"weights": np.zeros((8, 100, 99), np.float32)}, r"they must be floats of \(8, 100, 100\)"),
        ({"weights": np.zeros((8, 100, 100), np.int64)}, "they must be floats"),
        ({"weights": np.full((8, 100, 100), np.nan)}, "weights must be finite numbers"),
        ({"projections": None}, "projections must name the weights"),
        ({"projections": np.array(PROJECTION_NAMES[::-1])}, "projections must name the weights"),
        ({"probabilities": np.full((5, 5, 4), 0.3)}, "sum to 1"),
        ({"probabilities": np.full((5, 5, 4), np.nan)}, "sum to 1"),
        ({"probabilities": np.tile([1.5, -0.5, 0, 0], (5, 5, 1))}, "0 or more"),
        ({"probabilities": np.full((5, 4), 0.25)}, r"they must be float64 \(W, H, 4\)"),
        ({"extra": np.zeros(1)}, "it holds 'extra'"),
        ({"weights": np.array([{"a": 1}], dtype=object)}, "is damaged"),
    ],
)
def test_what_is_no_brain_of_ours_is_refused(tmp_path, changes, said):
    write_arrays(tmp_path, **changes)
    with pytest.raises(SclaError, match=said):
        read_brain(tmp_path, PAPER_ANATOMY)


def test_no_damage_to_the_arrays_goes_unseen(tmp_path):
    """Every member carries a checksum: a flipped byte is refused, or lies outside all data and changes nothing."""
    write_brain(tmp_path, snapshot(), anatomy=PAPER_ANATOMY)
    path, sound = tmp_path / BRAIN_NPZ, snapshot()
    whole = path.read_bytes()
    refused = 0
    for place in [*range(0, 300, 3), *range(300, len(whole), 3001), *range(len(whole) - 400, len(whole), 3)]:
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x55]) + whole[place + 1 :])
        try:
            read = read_brain(tmp_path, PAPER_ANATOMY)
        except SclaError:
            refused += 1
            continue
        assert np.array_equal(read.weights, sound.weights), place
        assert np.array_equal(read.probabilities, sound.probabilities), place
    assert refused > 100
    for damaged in (b"", b"PK", whole[: len(whole) // 2], whole[100:], b"\0" * 500):
        path.write_bytes(damaged)
        with pytest.raises(SclaError):
            read_brain(tmp_path, PAPER_ANATOMY)


def test_an_absent_brain_is_named(tmp_path):
    with pytest.raises(SclaError, match=r"brain\.npz does not exist"):
        read_brain(tmp_path, PAPER_ANATOMY)


def test_weights_of_different_shapes_have_an_array_each_and_are_read_back_by_name(tmp_path):
    groups = stacked(("left", 3), ("right", 2))
    ends = (Projection("dense", "left", "right", (3, 2)), Projection("sparse", "right", "left", (4,)))
    weights = {"sparse": np.arange(4.0), "dense": np.ones((3, 2), np.float32)}
    write_brain(tmp_path, Snapshot(weights), anatomy=Anatomy(groups, ends))
    for read in (read_brain(tmp_path), read_brain(tmp_path, Anatomy(groups, ends))):
        assert list(read.weights) == ["dense", "sparse"]
        assert all(np.array_equal(array, weights[name]) for name, array in read.weights.items())
    with pytest.raises(SclaError, match=r"weights of sparse are float64 \(4,\), they must be floats of \(5,\)"):
        read_brain(tmp_path, Anatomy(groups, (ends[0], ends[1]._replace(shape=(5,)))))
