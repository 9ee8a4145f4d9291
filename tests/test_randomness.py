"""One seed, many streams: repeatable, and independent of one another."""

import numpy as np
import pytest

from scla_mj.randomness import Consumer, generator


@pytest.mark.parametrize("consumer", list(Consumer))
def test_the_same_seed_gives_the_same_stream(consumer):
    assert (generator(7, consumer).random(64) == generator(7, consumer).random(64)).all()


def test_every_consumer_and_every_seed_has_a_stream_of_its_own():
    draws = {generator(seed, consumer).bytes(16) for seed in range(20) for consumer in Consumer}
    assert len(draws) == 20 * len(Consumer)


def test_streams_of_one_seed_are_uncorrelated():
    """Of 10,000 uniforms, sample correlations beyond 0.05 (5 standard errors) would be no accident."""
    streams = np.array([generator(0, consumer).random(10_000) for consumer in Consumer])
    off_diagonal = np.corrcoef(streams)[~np.eye(len(streams), dtype=bool)]
    assert np.abs(off_diagonal).max() < 0.05


def test_stream_numbers_are_the_ones_old_seeds_were_run_with():
    """A consumer may be added, never renumbered: a renumbered one would change every run's bits."""
    known = {"SPAWN": 0, "WEIGHTS": 1, "NOISE": 2, "TIES": 3, "BRAIN": 4}
    assert {consumer.name: consumer.value for consumer in Consumer}.items() >= known.items()
