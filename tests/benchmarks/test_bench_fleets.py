"""The bench of fleets: bare parts that end where the robots do, and verdicts only where cores are free."""

import math

import pytest

from benchmarks import fleets
from benchmarks.fleets import Took, cores_sheet, cost_sheet
from scla_mj.config import RunConfig
from scla_mj.errors import SclaError


def test_the_bare_parts_end_where_every_robot_ends_and_the_tables_say_so(monkeypatch):
    monkeypatch.setattr(fleets, "ROBOTS", 3)
    monkeypatch.setattr(fleets, "ask", lambda *_: {"robot": 0.5, "brain": 2.5})
    costs, cores = fleets.measure(RunConfig(brain="scla-printed"), repetitions=1, watch=lambda: None)
    assert {"single_ratio", "vector_ratio", "fleet_ratio", "robot_mb"} < costs.values.keys()
    assert costs.values["fleet_ms"] > costs.values["kernel_ms"] > 0.1
    assert "a single repetition allows no verdict" in costs.note and len(cores.rows) == 2


def test_a_robot_that_ends_elsewhere_than_the_bare_one_voids_the_bench(monkeypatch):
    monkeypatch.setattr(fleets, "ROBOTS", 2)
    bare = fleets.replay_physics
    monkeypatch.setattr(fleets, "replay_physics", lambda stage, done, steps: bare(stage, done, steps + 1))
    with pytest.raises(SclaError, match="ends elsewhere than under bare mj_step; the bench is void"):
        fleets.measure(RunConfig(brain="scla-printed"), repetitions=1, watch=lambda: None)


def turns(cpu_s, wall_s, waited_s=0.0, number=4):
    return [Took(cpu_s, wall_s, waited_s)] * number


def test_a_speed_up_is_of_the_turns_in_which_both_cores_were_free(monkeypatch):
    monkeypatch.setattr(fleets.os, "cpu_count", lambda: 2)
    took = {
        "vector": turns(1.0, 1.0) + turns(1.0, 3.0, 2.0), "vector, 2": turns(1.0, 0.5) + turns(1.0, 5.0, 4.0),
        "fleet": turns(1.0, 1.0), "fleet, 2": turns(1.0, 0.5, 0.4),
    }  # fmt: skip
    sheet = cores_sheet(took)
    assert sheet.values == {"vector_speed_up": pytest.approx(2.0)}
    assert [row[-2:] for row in sheet.rows] == [("2.00", "≥ 1.8 met"), ("", "≥ 1.8 ?")]
    assert "vector: 4 of 8 turns found both free. fleet: 0 of 4" in sheet.note
    unknown = turns(1.0, 1.0, math.nan)
    assert cores_sheet(dict.fromkeys(took, unknown)).values["fleet_speed_up"] == pytest.approx(1.0)


def test_costs_are_over_the_sum_of_the_bare_parts():
    ms = {
        "one": 1.0,
        "single": 1.14,
        "many": 1.0,
        "vector": 1.2,
        "twin": 0.001,
        "physics": 1.0,
        "kernel": 1.0,
        "fleet": 2.1,
    }
    took = {name: turns(value, value) for name, value in ms.items()}
    sheet = cost_sheet(took, {"robot": 0.7, "brain": 3.0})
    assert sheet.values["fleet_ratio"] == pytest.approx(1.05)
    verdicts = [row[3] for row in sheet.rows if row[3]]
    assert verdicts == ["≤ 1.15 met", "≤ 1.1 missed", "≤ 1.1 met", "≤ 0.6 missed"]
