"""The short version of `python tests/range_ends.py 3600`: a moment of network time at both ends of every range."""

import pytest
import range_ends


@pytest.mark.parametrize("kind", ["lazy", "dense", "moves"])
def test_at_both_ends_of_every_range_everything_stays_finite(kind):
    amount = {"lazy": 0.1, "dense": 0.02, "moves": 1}[kind]
    came = {case.name: range_ends.carried_out(case, amount) for case in range_ends.cases(dense=True, moves=True)
            if case.kind == kind}  # fmt: skip
    assert len(came) > 40
    assert {name: what for name, what in came.items() if not what.startswith("finite")} == {}
