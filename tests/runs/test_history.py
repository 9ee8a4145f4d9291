"""The mean weights over a run of any length fit in the same memory and keep its shape."""

import numpy as np
import pytest

from scla_mj.runs.checkpoint import read_checkpoint, write_checkpoint
from scla_mj.runs.history import WeightHistory


@pytest.mark.parametrize("decisions", [1, 7, 8, 9, 16, 17, 100, 1000])
def test_samples_are_evenly_spaced_and_never_more_than_the_capacity(walk, decisions):
    history = WeightHistory(capacity=8, stride=1)
    records = list(walk(1, decisions))
    for record in records:
        history.add(record)
    curve = history.curve()
    assert min(decisions, 4) <= len(curve.decision) <= 8
    stride = -(-decisions // 8)
    stride = 1 << (stride - 1).bit_length()  # the smallest power of two that fits
    assert curve.decision.tolist() == list(range(1, decisions + 1, stride))
    for number, time_s, means in zip(*curve, strict=True):
        assert time_s == records[number - 1].time_s
        assert (means == np.float64(number)).all()  # the walk's mean weights are its decisions' numbers


def test_a_brain_without_synapses_has_an_empty_curve(walk):
    history = WeightHistory()
    for record in walk(1, 10, spiking=False):
        history.add(record)
    assert history.curve().mean_weights.shape == (0, 0)


@pytest.mark.parametrize("cut", [0, 1, 8, 9, 50])
def test_a_history_that_was_saved_goes_on_as_if_it_had_not_been(walk, tmp_path, cut):
    whole, before, after = (WeightHistory(capacity=8, stride=3) for _ in range(3))
    records = list(walk(1, 70))
    for number, record in enumerate(records):
        whole.add(record)
        if number == cut:
            write_checkpoint(tmp_path, before.state())
            after.restore(read_checkpoint(tmp_path))
        (before if number < cut else after).add(record)
    for one, other in zip(whole.curve(), after.curve(), strict=True):
        assert one.tobytes() == other.tobytes()


@pytest.mark.parametrize("decisions", [1, 5, 70, 333])
def test_only_the_decisions_that_are_due_are_looked_at(walk, decisions):
    asked, given = (WeightHistory(capacity=8, stride=4) for _ in range(2))
    for record in walk(1, decisions):
        given.add(record)
        asked.add(record if asked.is_due else record._replace(activity=None))
    for one, other in zip(asked.curve(), given.curve(), strict=True):
        assert one.tobytes() == other.tobytes()
    assert given.curve().decision[0] == 1
