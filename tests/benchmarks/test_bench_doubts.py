"""A figure that noise or a single repetition could have made is not called met."""

import numpy as np
import pytest

from benchmarks import kernel_parts, moves, processes, replay, rollouts, suites
from benchmarks.table import BOUND_ABOVE, ONE_REPETITION, Sheet, against
from scla_mj.config import RunConfig
from scla_mj.grid import Action, Cell

PARTS = kernel_parts.Parts(
    bound=0.5, neurons=0.6, decay=0.1, stretch=0.2, sensory=0.1, dosed=0.1, motor=0.1, whole=1.5, chunked=1.6,
    sensory_spikes=2.0, motor_spikes=5.0, share=0.5,
)  # fmt: skip
LONG = {"cpu_s": [5.0, 8.0, 11.0], "simulated_s": [10.0, 20.0, 30.0], "peak_mb": 360.0, "total_cpu_s": 11.0}


def rollout_sheet(bare_ms):
    """A rollout of 1 ms per decision and bare parts of this much."""
    milliseconds = dict.fromkeys(rollouts.TELEMETRY, 1.0)
    sizes = {"light": 5e3, "full": 1e4, "long": 4e3}
    cost = rollouts.Cost(1000, 900.0, 2000.0, bare_ms / 2, bare_ms / 2, milliseconds, milliseconds, sizes)
    return rollouts.sheets(cost)[0]


def move_sheet(moves_s):
    """A move of this much and bare physics of one second."""
    attempt = replay.Attempt(Action.LEFT, Cell(1, 1), np.zeros((10, 2)))
    played = replay.Recorded(episodes=[replay.Episode(np.zeros(1), [attempt])])
    seconds = {"bare": 1.0, "moves": moves_s, "python": 2.0, "dm_control": 3.0}
    return moves._sheet(seconds, played, decisions=1)


def verdicts(sheet):
    """Every cell that judges a figure."""
    return [cell for row in sheet.rows for cell in row if cell.startswith(("≤", "≥"))]


def test_a_lower_bound_above_what_contains_it_gives_no_verdict_and_says_why():
    for sound, noisy in (
        (kernel_parts.sheet(PARTS), kernel_parts.sheet(PARTS._replace(bound=0.61))),
        (rollout_sheet(0.95), rollout_sheet(1.01)),
        (move_sheet(1.05), move_sheet(0.95)),
    ):
        assert verdicts(sound)
        assert all(cell.endswith(" met") for cell in verdicts(sound))
        assert all(cell.endswith(" ?") for cell in verdicts(noisy))
        assert BOUND_ABOVE in noisy.note
        assert BOUND_ABOVE not in sound.note
        assert noisy.values.keys() == sound.values.keys()


def test_bare_parts_above_a_long_run_leave_its_other_verdicts():
    noisy = processes.long_sheet({"peak_mb": 330.0}, LONG, bare_s=[4.0, 4.0, 4.0])
    assert verdicts(noisy) == ["≤ 50 met", "≤ 1.1 met", "≤ 1.1 met", "≤ 1.25 ?"]
    assert BOUND_ABOVE in noisy.note


@pytest.mark.parametrize(("repetitions", "judged"), [(1, "≤ 2 ?"), (2, "≤ 2 met")])
def test_a_single_repetition_is_not_judged_but_counted_bytes_are(repetitions, judged, monkeypatch):
    def run(*_):
        rows = (("what", "1.0", against(1.0, 2.0)),)
        return suites.Result([Sheet(key, "", (), rows, "A note.", {}) for key in ("move", "recording")], {})

    monkeypatch.setitem(suites.SUITES, "rollout", suites.SUITES["rollout"]._replace(run=run))
    timed, counted = suites.measure("rollout", suites.Order(RunConfig(), repetitions, None), lambda: None).sheets
    assert verdicts(timed) == [judged]
    assert (ONE_REPETITION in timed.note) == (repetitions == 1)
    assert verdicts(counted) == ["≤ 2 met"]


def test_every_table_that_is_timed_by_repetitions_belongs_to_a_suite():
    assert set(suites._TIMED) < {key for suite in suites.SUITES.values() for key in suite.keys}
