"""One decision after another, as whoever looks at it sees it."""

import math

import numpy as np
import pytest

from scla_mj.brain.baselines import RandomBrain
from scla_mj.config import RunConfig
from scla_mj.engine.build import simulate
from scla_mj.runs.decisions import row
from scla_mj.world.rangefinder import ranges_m


class FeelingItsWay(RandomBrain):
    """Decides as a random walk, and senses besides how far it is to the wall ahead."""

    reads = ()
    sensors = {"ahead_m": lambda world: float(ranges_m(world, np.zeros(1), reach_m=4.0)[0])}  # noqa: RUF012


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


def test_a_brains_own_sensors_are_read_for_every_percept_and_change_nothing():
    plain, sensing = simulate(RunConfig(brain="random")), simulate(RunConfig(brain=FeelingItsWay))
    for _ in range(30):
        pose = sensing.world.pose()
        expected, record = plain.step(), sensing.step()
        assert row(record) == row(expected)
        assert not expected.percept.readings
        towards = math.cos(pose.heading_rad), math.sin(pose.heading_rad)
        ahead = [(math.copysign(0.75, d) - at) / d for at, d in zip(pose[:2], towards, strict=True) if abs(d) > 1e-6]
        assert record.percept.readings["ahead_m"] == pytest.approx(min(ahead), abs=0.01)


def test_a_resumed_simulation_senses_the_same():
    whole, first, resumed = (simulate(RunConfig(brain=FeelingItsWay)) for _ in range(3))
    expected = [whole.step().percept for _ in range(12)]
    assert [first.step().percept for _ in range(6)] == expected[:6]
    resumed.restore(first.state())
    assert [resumed.step().percept for _ in range(6)] == expected[6:]


def test_a_simulation_takes_another_robot():
    simulation = simulate(RunConfig(brain="random", robot="mouse"))
    assert simulation.world.dimensions.wheel_radius_m == 0.016
    assert "failed" not in [simulation.step().move.outcome for _ in range(20)]
