"""One seed, one stream per consumer: nobody's draws can shift anybody else's."""

from __future__ import annotations

import enum

import numpy as np


class Consumer(enum.IntEnum):
    """Who draws. The number is the stream's spawn key: never reuse or renumber one, or old seeds change their bits."""

    SPAWN = 0
    WEIGHTS = 1
    NOISE = 2
    TIES = 3
    BRAIN = 4
    ACTION_NOISE = 5
    DOMAIN_RANDOMISATION = 6
    PERTURBATION = 7
    SENSOR_NOISE = 8


def seed_sequence(seed: int, consumer: Consumer) -> np.random.SeedSequence:
    """Return the child of the run's seed that belongs to one consumer."""
    return np.random.SeedSequence(seed, spawn_key=(int(consumer),))


def generator(seed: int, consumer: Consumer) -> np.random.Generator:
    """Return the consumer's own generator (PCG64)."""
    return np.random.Generator(np.random.PCG64(seed_sequence(seed, consumer)))
