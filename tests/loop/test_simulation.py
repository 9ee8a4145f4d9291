"""One decision after another, as whoever looks at it sees it."""

from scla_mj.config import RunConfig
from scla_mj.engine.build import simulate
from scla_mj.runs.decisions import row


def test_a_robot_does_the_same_whether_it_is_observed_or_not():
    seen, unseen = (
        [simulation.step(observe=observe) for number in range(1, 41)]
        for simulation, observe in ((simulate(RunConfig()), True), (simulate(RunConfig()), False))
    )
    assert [row(record) for record in seen] == [row(record) for record in unseen]
    assert all(len(record.activity.spike_step) and len(record.move.trajectory) for record in seen)
    assert not any(record.activity or len(record.move.trajectory) for record in unseen)


def test_an_observed_move_begins_where_the_one_before_ended_though_that_was_not_observed():
    simulation = simulate(RunConfig())
    records = [simulation.step(observe=number % 2 == 0) for number in range(1, 21)]
    observed = [record for record in records if len(record.move.trajectory)]
    assert len(observed) == 10
    for record in observed:
        first_s, last_s = record.move.trajectory[[0, -1], 0]
        assert abs(first_s - (record.time_s + 0.01)) < 1e-9
        assert abs(last_s - (record.time_s + 0.05 + record.move.duration_s)) < 1e-9
