"""`checkpoint.npz`: what was saved is what is read, to the bit; a damaged byte is never taken for sound."""

import hashlib
import io
import json
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from scla_mj.errors import SclaError
from scla_mj.paths import CHECKPOINT_NPZ
from scla_mj.runs.checkpoint import FORMAT, check_state, read_checkpoint, write_checkpoint

numbers = st.floats() | st.integers() | st.booleans() | st.none() | st.text()
array = arrays.arrays(st.sampled_from(["f4", "f8", "i8", "u4", "u1", "?"]), arrays.array_shapes(min_dims=0, min_side=0))
words = st.from_regex(r"[A-Za-z_]\w*", fullmatch=True)
leaves = numbers | array
states = st.dictionaries(
    words, st.recursive(leaves, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(words, inner, max_size=3))
)


def same(a, b):
    if isinstance(a, np.ndarray):
        return isinstance(b, np.ndarray) and (a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes())
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, list):
        return len(a) == len(b) and all(map(same, a, b))
    return type(a) is type(b) and (a == b or (a != a and b != b))


@given(state=states)
@settings(max_examples=60, deadline=None)
def test_any_state_is_read_back_to_the_bit(state, tmp_path_factory):
    folder = tmp_path_factory.mktemp("state")
    write_checkpoint(folder, state)
    assert same(state, read_checkpoint(folder))


def test_a_generator_goes_on_where_it_was(tmp_path):
    rng = np.random.Generator(np.random.PCG64(5))
    rng.random(7)
    write_checkpoint(tmp_path, {"rng": rng.bit_generator.state})
    twin = np.random.Generator(np.random.PCG64(0))
    twin.bit_generator.state = read_checkpoint(tmp_path)["rng"]
    assert twin.integers(10**9, size=20).tolist() == rng.integers(10**9, size=20).tolist()


def test_the_arrays_are_plain_numpy_and_the_rest_is_json(tmp_path):
    write_checkpoint(tmp_path, {"a": {"v": np.arange(3.0)}, "n": 4})
    with np.load(tmp_path / CHECKPOINT_NPZ, allow_pickle=False) as archive:
        assert archive["a/v"].tolist() == [0, 1, 2]
        assert json.loads(archive["state.json"]) == {"format": FORMAT, "state": {"a": {"v": {"$array": "a/v"}}, "n": 4}}


@pytest.mark.parametrize(
    ("state", "place"),
    [
        ({"a": {1, 2}}, "a is set"),
        ({"a": {"b": (1, 2)}}, "a/b is tuple"),
        ({"a": [np.array([object()])]}, "a/0 is ndarray"),
        ({"a": {3: 1}}, "a has the key 3"),
        ({"a/b": 1}, "'a/b'"),
        ({"a": np.complex128(3)}, "a is complex128"),
        ({"a": np.ma.masked_array([1.0, 2.0], [True, False])}, "a is MaskedArray"),
        ([1], "a state is a dict, not list"),
    ],
)
def test_what_a_checkpoint_cannot_hold_is_refused_by_its_place(state, place):
    with pytest.raises(SclaError, match=r"^[^\n]*$") as caught:
        check_state(state)
    assert place in str(caught.value)


STATE = {"arrays": {"v": np.arange(30.0), "n": np.arange(9, dtype=np.uint32)}, "epoch": 3, "rng": {"state": 2**100}}


def test_every_damaged_byte_and_every_cut_is_refused_with_a_sentence(tmp_path):
    write_checkpoint(tmp_path, STATE)
    path = tmp_path / CHECKPOINT_NPZ
    sound = path.read_bytes()
    for place in range(len(sound)):
        path.write_bytes(sound[:place] + bytes([sound[place] ^ 0x40]) + sound[place + 1 :])
        with pytest.raises(SclaError, match=r"checkpoint\.npz is damaged"):
            read_checkpoint(tmp_path)
    for size in (*range(0, len(sound), 13), len(sound) - 1):
        path.write_bytes(sound[:size])
        with pytest.raises(SclaError, match=r"checkpoint\.npz is damaged"):
            read_checkpoint(tmp_path)
    path.write_bytes(sound)
    assert same(read_checkpoint(tmp_path), STATE)


def sealed(members, *, compress=zipfile.ZIP_STORED):
    """Return a zip file that ends with its own digest, as ours do."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", compress) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
        archive.comment = bytes(64)
    body = buffer.getvalue()[:-64]
    return body + hashlib.sha256(body).hexdigest().encode()


def pickled():
    buffer = io.BytesIO()
    np.save(buffer, np.array([{}], dtype=object), allow_pickle=True)
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (sealed({"state.json": json.dumps({"format": 1, "state": {}})}), "has format 1: this scla-mj reads format 2"),
        (sealed({"other": "x"}), "is not a checkpoint of scla-mj"),
        (sealed({"state.json": "{"}), "is not a checkpoint of scla-mj"),
        (sealed({"state.json": "[" * 100_000}), "is not a checkpoint of scla-mj"),
        (sealed({"state.json": "{" + " " * 10**7 + "}"}, compress=zipfile.ZIP_DEFLATED), "is not a checkpoint"),
        (
            sealed({"state.json": json.dumps({"format": 1, "state": {"a": {"$array": "a"}}}), "a.npy": pickled()}),
            "is not a checkpoint of scla-mj",
        ),
    ],
)
def test_a_sound_file_that_is_not_ours_is_refused(tmp_path, content, said):
    (tmp_path / CHECKPOINT_NPZ).write_bytes(content)
    with pytest.raises(SclaError) as caught:
        read_checkpoint(tmp_path)
    assert said in str(caught.value)


def test_no_checkpoint_is_no_state_and_a_folder_is_refused(tmp_path):
    assert read_checkpoint(tmp_path) is None
    (tmp_path / CHECKPOINT_NPZ).mkdir()
    with pytest.raises(SclaError, match=r"checkpoint\.npz"):
        read_checkpoint(tmp_path)


def test_a_checkpoint_that_cannot_be_written_leaves_the_one_before(tmp_path, monkeypatch):
    write_checkpoint(tmp_path, {"n": 1})

    def full(handle):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(SclaError, match="No space left on device"):
        write_checkpoint(tmp_path, {"n": 2})
    assert read_checkpoint(tmp_path) == {"n": 1}
    assert [path.name for path in tmp_path.iterdir()] == [CHECKPOINT_NPZ]
