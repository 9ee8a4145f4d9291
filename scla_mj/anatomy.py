"""The network's names: 12 populations (Table 3) and 8 projections (Table 4 of the paper), in the paper's order.

The paper's network has 1000 neurons. A larger one, for measurements of growth, has larger populations in the same
proportions; each of its sensory neurons still reaches 100 neurons of two motor populations.
"""

from typing import Final, NamedTuple

from scla_mj.grid import Action


class Population(NamedTuple):
    """A group of neurons, the half-open range [start, stop) of the network's."""

    name: str
    start: int
    stop: int

    @property
    def size(self) -> int:
        """Number of neurons."""
        return self.stop - self.start


class Projection(NamedTuple):
    """A plastic all-to-all connection from one sensory to one motor population."""

    name: str
    sensor: Action
    motor: Action

    @property
    def agrees(self) -> bool:
        """Whether the sensor drives its own motor (agreeing) or the opposite one."""
        return self.sensor == self.motor


def populations_of(neurons: int) -> tuple[Population, ...]:
    """Return the populations of a network of `neurons`, a multiple of 1000."""
    share = neurons // 1000
    sizes = {"S": 100 * share, "M": 100 * share, "I": 50 * share}
    names_and_sizes = [(kind + side, size) for kind, size in sizes.items() for side in "UDLR"]
    populations, start = [], 0
    for name, size in names_and_sizes:
        populations.append(Population(name, start, start + size))
        start += size
    return tuple(populations)


POPULATIONS: Final = populations_of(1000)
POPULATION_NAMES: Final = tuple(population.name for population in POPULATIONS)
SENSORY: Final = POPULATIONS[0:4]
MOTOR: Final = POPULATIONS[4:8]
INHIBITORY: Final = POPULATIONS[8:12]
NEURON_COUNT: Final = POPULATIONS[-1].stop
NEURONS_PER_SIDE: Final = SENSORY[0].size

PROJECTIONS: Final = (
    Projection("SUtoMU", Action.UP, Action.UP),
    Projection("SUtoMD", Action.UP, Action.DOWN),
    Projection("SDtoMU", Action.DOWN, Action.UP),
    Projection("SDtoMD", Action.DOWN, Action.DOWN),
    Projection("SLtoML", Action.LEFT, Action.LEFT),
    Projection("SLtoMR", Action.LEFT, Action.RIGHT),
    Projection("SRtoMR", Action.RIGHT, Action.RIGHT),
    Projection("SRtoML", Action.RIGHT, Action.LEFT),
)
PROJECTION_NAMES: Final = tuple(projection.name for projection in PROJECTIONS)
