"""Rows come out as they went in, whatever their number."""

import numpy as np
import pytest

from scla_mj.telemetry.pile import Pile


@pytest.mark.parametrize("shape", [(), (3,)])
def test_rows_come_out_in_the_order_in_which_they_went_in(shape):
    rng, pile = np.random.default_rng(0), Pile(shape, np.float64)
    for _ in range(2):  # what was cleared is not seen again
        added = [rng.normal(size=(size, *shape)) for size in (1, 0, 1023, 1, 7000, 5)]
        for rows in added:
            pile.add(rows)
        np.testing.assert_array_equal(pile.rows, np.concatenate(added))
        assert len(pile) == 8030
        pile.clear()
        assert len(pile) == len(pile.rows) == 0


def test_a_pile_keeps_copies():
    pile, rows = Pile((), np.int32), np.arange(5, dtype=np.int32)
    pile.add(rows)
    rows[:] = -1
    np.testing.assert_array_equal(pile.rows, np.arange(5))


def test_records_come_one_by_one():
    kind = np.dtype([("number", np.int64), ("pair", np.float64, (2,))])
    pile = Pile((), kind)
    for number in range(3000):
        pile.append((number, np.array([number, -number])))
    np.testing.assert_array_equal(pile.rows["number"], np.arange(3000))
    np.testing.assert_array_equal(pile.rows["pair"], np.outer(np.arange(3000), [1, -1]))
