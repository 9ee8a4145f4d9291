"""The small table at the end of a sweep: what varies and what it earned, of many configurations the best."""

import io

import pyarrow as pa
import pyarrow.parquet as pq
from rich.console import Console

from scla_mj.cli.tables import sweep_table


def printed(folder, rows, width=100):
    pq.write_table(pa.Table.from_pylist(rows), folder / "sweep.parquet")
    console = Console(width=width, file=io.StringIO())
    console.print(sweep_table(folder / "sweep.parquet"))
    lines = console.file.getvalue().splitlines()
    return lines, [[word.strip() for word in line.strip("│").split("│")] for line in lines if line.startswith("│")]


def row(percent, low=None, high=None, **settings):
    ends = {"percent_of_ceiling": percent, "percent_of_ceiling_low": low, "percent_of_ceiling_high": high}
    earned = {"folder": "runs/x", "seeds": [0, 1], "hits_per_1000_by_seed_and_epoch": [[1.0, 50.0], [2.0, 51.0]]}
    return {"brain": "[bold]x", "protocol": "any-start", **settings, **earned, **ends}


def test_each_setting_that_varies_has_a_column_and_the_hits_are_the_last_epochs_mean_over_seeds(tmp_path):
    given = [{"cells": [5, 5], "brain.epsilon": 0.1}, {"cells": [6, 6], "brain.epsilon": None}]
    _, rows = printed(tmp_path, [row(80.0, 70.0, 90.0, **given[0]), row(20.0, **given[1])])
    assert rows == [["5 5", "0.1", "2", "50.5", "80.0 (70.0 to 90.0)"], ["6 6", "-", "2", "50.5", "20.0"]]
    assert printed(tmp_path, [row(80.0)])[1][0][0] == "[bold]x", "where nothing varies, the brain"


def test_of_many_configurations_the_best_are_shown_and_the_title_says_so(tmp_path):
    lines, rows = printed(tmp_path, [row(float(n), **{"task.action-noise": n}) for n in range(30)])
    assert "the best 24 of 30 configurations" in lines[0]
    assert [int(one[0]) for one in rows] == list(range(29, 5, -1))


def test_numbers_stay_on_one_line_and_settings_give_way(tmp_path):
    names = {"brain_settings.exploration_of_the_first_epoch": 0.125, "network.projections": "SUtoML SUtoMR SUtoMD"}
    given = [names | {"protocol": "sensed-start"}, dict.fromkeys(names, None)]
    _, rows = printed(tmp_path, [row(100.0, 99.5, 100.5, **one) for one in given], width=80)
    assert [one[-3:] for one in rows if one[-1]] == [["2", "50.5", "100.0 (99.5 to 100.5)"]] * 2
