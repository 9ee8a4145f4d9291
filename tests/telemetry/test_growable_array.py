"""Rows come out as they went in, whatever their number."""

import numpy as np
import pytest

from scla_mj.telemetry.growable_array import GrowableArray


@pytest.mark.parametrize("shape", [(), (3,)])
def test_rows_come_out_in_the_order_in_which_they_went_in(shape):
    rng, array = np.random.default_rng(0), GrowableArray(np.float64, shape)
    for _ in range(2):  # what was cleared is not seen again
        added = [rng.normal(size=(size, *shape)) for size in (1, 0, 1023, 1, 7000, 5)]
        for rows in added:
            array.extend(rows)
        np.testing.assert_array_equal(array.rows, np.concatenate(added))
        assert len(array) == 8030
        array.clear()
        assert len(array) == len(array.rows) == 0


def test_the_array_keeps_copies():
    array, rows = GrowableArray(np.int32), np.arange(5, dtype=np.int32)
    array.extend(rows)
    rows[:] = -1
    np.testing.assert_array_equal(array.rows, np.arange(5))


def test_records_come_one_by_one():
    kind = np.dtype([("number", np.int64), ("pair", np.float64, (2,))])
    array = GrowableArray(kind)
    for number in range(3000):
        array.append((number, np.array([number, -number])))
    np.testing.assert_array_equal(array.rows["number"], np.arange(3000))
    np.testing.assert_array_equal(array.rows["pair"], np.outer(np.arange(3000), [1, -1]))
