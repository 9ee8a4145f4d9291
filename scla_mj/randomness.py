"""One seed, one stream per consumer: nobody's draws can shift anybody else's."""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING, Any, Final

from scla_mj.validation import whole_number

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


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


MOST_SEED: Final = 2**63 - 1
"""The largest that a recording's and a table's 64-bit integers hold."""


def require_seed(seed: int) -> int:
    """Return a seed as Python's integer.

    Raises:
        SclaError: it is not a whole number from 0 to `MOST_SEED`.
    """
    return whole_number(seed, "seed", 0, MOST_SEED)


def seed_sequence(seed: int, consumer: Consumer) -> np.random.SeedSequence:
    """Return the child of the run's seed that belongs to one consumer."""
    import numpy as np  # the command line's help needs the range of seeds alone

    return np.random.SeedSequence(seed, spawn_key=(int(consumer),))


def generator(seed: int, consumer: Consumer) -> np.random.Generator:
    """Return the consumer's own generator (PCG64)."""
    import numpy as np

    return np.random.Generator(np.random.PCG64(seed_sequence(seed, consumer)))


def noise_lanes(seed: int, neurons: int) -> NDArray[np.uint32]:
    """Return the state of each neuron's own generator of noise, (2, neurons)."""
    import numpy as np

    lanes: Any = seed_sequence(seed, Consumer.NOISE).generate_state(2 * neurons, np.uint32).reshape(2, -1)
    lanes[0][(lanes == 0).all(axis=0)] = 1  # an all-zero generator would stay at zero
    return np.asarray(lanes)
