"""The short version of `python tests/range_ends.py 3600`: a moment of network time at both ends of every range."""

import pytest
import range_ends


@pytest.mark.parametrize(("kind", "second"), [("lazy", 0.2), ("dense", 0.06), ("moves", None)])
def test_at_both_ends_of_every_range_everything_stays_finite(kind, second, monkeypatch):
    monkeypatch.setattr(range_ends, "DECISION_S", second)
    cases = [case for case in range_ends.cases(dense=True, moves=True) if case.kind == kind]
    if kind == "dense":  # slow
        cases = cases[::5]
    came = {case.name: range_ends.carried_out(case, 1) for case in cases}
    assert len(came) > 20
    assert {name: what for name, what in came.items() if not what.startswith("finite")} == {}
