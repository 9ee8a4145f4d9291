"""A brain's anatomy: its populations of neurons and the projections between them, by name. And the paper's own.

The paper's network has 1000 neurons in 12 populations (Table 3) and 8 plastic projections (Table 4). A larger one has
larger populations in the same proportions; each of its sensory neurons still reaches 100 neurons of two motor
populations.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from numbers import Integral
from typing import Any, Final, NamedTuple

from scla_mj.errors import SclaError
from scla_mj.grid import Action

_NAME: Final = re.compile(r"[A-Za-z]\w*", re.ASCII)
_COLOUR: Final = re.compile(r"#[0-9a-fA-F]{6}")
_TAKEN: Final = "windows"
"""Next to the populations' spikes a recording keeps what they were decided in."""
SENSORY_ROLE: Final = "sensory"
MOTOR_ROLE: Final = "motor"
INHIBITORY_ROLE: Final = "inhibitory"


class Population(NamedTuple):
    """A group of neurons, the half-open range [start, stop) of the brain's.

    `role` is free text; "motor" has a column of spikes in decisions.parquet, and "sensory", "motor" and "inhibitory"
    have shades of their own. `colour` is "#rrggbb", None for one that follows from the role.
    """

    name: str
    start: int
    stop: int
    role: str = ""
    colour: str | None = None

    @property
    def size(self) -> int:
        """Number of neurons."""
        return self.stop - self.start


class Projection(NamedTuple):
    """The synapses from one population to another, by their names, whose mean weight is recorded.

    `shape` is that of its weights in a `Snapshot`: (presynaptic, postsynaptic) where all are connected, (synapses,) for
    a list. Curves have its `colour`, "#rrggbb" or None for one of the palette's, and may be `dashed`; `weight_range`,
    mV, is what a picture of its weights spans, None for that of the weights.
    """

    name: str
    source: str
    target: str
    shape: tuple[int, ...]
    colour: str | None = None
    dashed: bool = False
    weight_range: tuple[float, float] | None = None


@dataclass(frozen=True)
class Anatomy:
    """What a brain consists of; recordings, tables and figures name what they show by it.

    Args:
        populations: in the order of their neurons, from neuron 0, without gaps (see `stacked`).
        projections: in the order of a brain's mean weights and released dopamine.
        watched: the neurons whose membrane potentials it hands out (`Activity.potentials`); no file keeps this.

    Raises:
        SclaError: a name is taken twice or cannot name a column, a range has a gap, or a projection's population is
            none.

    Example:
        >>> Anatomy(stacked(("retina", 100, "sensory"), ("left", 50, "motor"), ("right", 50, "motor"))).neurons
        200
    """

    populations: tuple[Population, ...]
    projections: tuple[Projection, ...] = ()
    watched: tuple[int, ...] = field(default=(), compare=False)

    def __post_init__(self) -> None:
        for part, kind in (("populations", Population), ("projections", Projection)):
            items = getattr(self, part)
            if not (isinstance(items, tuple) and all(isinstance(item, kind) for item in items)):
                raise SclaError(f"an anatomy's {part} must be a tuple of {kind.__name__}, such as stacked() returns")
            _check_names(part[:-1], items)
        if not self.populations:
            raise SclaError("an anatomy has at least one population: a brain without neurons has the anatomy None")
        _check_ranges(self.populations)
        for projection in self.projections:
            _check_projection(projection, {population.name for population in self.populations})
        if not all(type(neuron) is int and 0 <= neuron < self.neurons for neuron in self.watched):
            raise SclaError(f"the anatomy watches {self.watched!r}: name neurons from 0 to {self.neurons - 1}")

    @property
    def neurons(self) -> int:
        """Number of neurons."""
        return self.populations[-1].stop

    def of_role(self, role: str) -> tuple[Population, ...]:
        """Return the populations that have the role, in order."""
        return tuple(population for population in self.populations if population.role == role)

    @property
    def population_names(self) -> tuple[str, ...]:
        """The populations' names, in order."""
        return tuple(population.name for population in self.populations)

    @property
    def projection_names(self) -> tuple[str, ...]:
        """The projections' names, in order."""
        return tuple(projection.name for projection in self.projections)

    def by_projection(self, weights: Any) -> dict[str, Any]:
        """Return the weights of a `Snapshot` by the name of their projection; {} for None."""
        if weights is None:
            return {}
        return dict(weights if isinstance(weights, dict) else zip(self.projection_names, weights, strict=True))

    def content(self) -> dict[str, Any]:
        """Return what JSON can hold, for `read_anatomy`."""
        return {
            "populations": [population._asdict() for population in self.populations],
            "projections": [projection._asdict() for projection in self.projections],
        }


def motors_of(anatomy: Anatomy | None) -> tuple[str, ...]:
    """Return the names of the populations whose spikes a decision counts."""
    return () if anatomy is None else tuple(population.name for population in anatomy.of_role(MOTOR_ROLE))


def read_anatomy(content: Any) -> Anatomy | None:
    """Return the anatomy of which `content` was made; None for None.

    Raises:
        SclaError: it is none.
    """
    if content is None:
        return None
    try:
        populations = tuple(Population(**item) for item in content["populations"])
        projections = [Projection(**item) for item in content["projections"]]
        return Anatomy(populations, tuple(_with_tuples(projection) for projection in projections))
    except (KeyError, IndexError, TypeError) as error:
        raise SclaError("it holds no anatomy as scla-mj writes it") from error


def _with_tuples(projection: Projection) -> Projection:
    low_high = projection.weight_range
    weight_range = None if low_high is None else (low_high[0], low_high[1])
    return projection._replace(shape=tuple(projection.shape), weight_range=weight_range)


def stacked(*groups: tuple[str, int] | tuple[str, int, str]) -> tuple[Population, ...]:
    """Return populations one after the other, from their names, sizes and, if any, roles.

    Raises:
        SclaError: a size is not a whole number of at least 1.
    """
    populations: list[Population] = []
    start = 0
    for name, size, *role in groups:
        if not (isinstance(size, Integral) and size >= 1):
            raise SclaError(f"the population {name} has {size!r} neurons: it must be a whole number of at least 1")
        populations.append(Population(name, start, start + int(size), *role))
        start += int(size)
    return tuple(populations)


def _is_count(value: Any) -> bool:
    return type(value) is int and value >= 1


def _check_names(kind: str, items: Iterable[Population | Projection]) -> None:
    names = [item.name for item in items]
    for number, item in enumerate(items):
        if not (isinstance(item.name, str) and _NAME.fullmatch(item.name)) or item.name == _TAKEN:
            raise SclaError(
                f"the {kind} {item.name!r} has no possible name: begin with a letter, go on with letters, digits and "
                f"_, and leave {_TAKEN!r} to the recordings"
            )
        if item.name in names[:number]:
            raise SclaError(f"two {kind}s are called {item.name!r}: give each a name of its own")
        if not (item.colour is None or (isinstance(item.colour, str) and _COLOUR.fullmatch(item.colour))):
            raise SclaError(f"the {kind} {item.name} has the colour {item.colour!r}: write it as '#2b7bd6', or None")


def _check_ranges(populations: tuple[Population, ...]) -> None:
    expected = 0
    for name, start, stop, role, _ in populations:
        if type(start) is not int or start != expected or not _is_count(stop) or stop <= start:
            raise SclaError(
                f"the population {name} has neurons {start!r} to {stop!r}: it must begin at {expected}, where the one "
                "before stops, and hold at least one"
            )
        if not isinstance(role, str):
            raise SclaError(f"the population {name} has the role {role!r}: it must be a text, such as 'motor'")
        expected = stop


def _check_projection(projection: Projection, populations: set[str]) -> None:
    name, shape, bounds = projection.name, projection.shape, projection.weight_range
    for end in (projection.source, projection.target):
        if end not in populations:
            raise SclaError(f"the projection {name} names the population {end!r}, which the anatomy lacks")
    if not (isinstance(shape, tuple) and shape and all(map(_is_count, shape))):
        raise SclaError(f"the projection {name} has the shape {shape!r}: it must be a tuple such as (100, 50)")
    if not (bounds is None or (isinstance(bounds, tuple) and len(bounds) == 2 and _rises(*bounds))):
        raise SclaError(f"the projection {name} has the weight_range {bounds!r}: it must be (low, high), or None")
    if not isinstance(projection.dashed, bool):
        raise SclaError(f"the projection {name} has dashed {projection.dashed!r}: it must be True or False")


def _rises(low: Any, high: Any) -> bool:
    return all(type(end) in (int, float) for end in (low, high)) and -math.inf < low < high < math.inf


_SIDES: Final[Mapping[str, Action]] = dict(zip("UDLR", Action, strict=True))


class SensorimotorProjection(Projection):
    """One of the paper's: all to all, plastic, from a sensory to a motor population."""

    @property
    def sensor(self) -> Action:
        """The direction that drives it."""
        return _SIDES[self.source[-1]]

    @property
    def motor(self) -> Action:
        """The direction that it drives."""
        return _SIDES[self.target[-1]]

    @property
    def agrees(self) -> bool:
        """Whether the sensor drives its own motor (agreeing) or the opposite one."""
        return self.sensor == self.motor


def populations_of(neurons: int) -> tuple[Population, ...]:
    """Return the populations of the paper's network with `neurons`, a multiple of 1000."""
    share = neurons // 1000
    groups = (("S", 100, SENSORY_ROLE), ("M", 100, MOTOR_ROLE), ("I", 50, INHIBITORY_ROLE))
    return stacked(*((kind + side, size * share, role) for kind, size, role in groups for side in "UDLR"))


POPULATIONS: Final = populations_of(1000)
POPULATION_NAMES: Final = tuple(population.name for population in POPULATIONS)
SENSORY: Final = POPULATIONS[0:4]
MOTOR: Final = POPULATIONS[4:8]
INHIBITORY: Final = POPULATIONS[8:12]
NEURON_COUNT: Final = POPULATIONS[-1].stop
NEURONS_PER_SIDE: Final = SENSORY[0].size

# By the sensor's direction; opposite projections are dashed. Distinct for colour-blind readers too, and each stands out
# at 3 : 1 or more (WCAG 2.1's bound for graphics) on white and on the dashboard's dark.
_COLOURS: Final = {"U": "#bd7e15", "D": "#1f57f2", "L": "#3ba471", "R": "#d433ad"}
_PROJECTIONS: Final = ("SUtoMU", "SUtoMD", "SDtoMU", "SDtoMD", "SLtoML", "SLtoMR", "SRtoMR", "SRtoML")


def paper_anatomy(neurons: int = NEURON_COUNT, weight_max: float = 4.0) -> Anatomy:
    """Return the anatomy of the paper's network: of `neurons`, a multiple of 1000, and weights from 0 to `weight_max`.

    A larger network's sensory neuron reaches those of its own block of 100: its weights are (blocks, 100, 100).
    """
    blocks, side = neurons // NEURON_COUNT, NEURONS_PER_SIDE
    shape = (side, side) if blocks == 1 else (blocks, side, side)
    projections = []
    for name in _PROJECTIONS:
        source, _, target = name.partition("to")
        colour, dashed = _COLOURS[source[-1]], source[-1] != target[-1]
        projections.append(SensorimotorProjection(name, source, target, shape, colour, dashed, (0.0, weight_max)))
    return Anatomy(populations_of(neurons), tuple(projections))


PAPER_ANATOMY: Final = paper_anatomy()
PROJECTIONS: Final = tuple(SensorimotorProjection(*projection) for projection in PAPER_ANATOMY.projections)
PROJECTION_NAMES: Final = PAPER_ANATOMY.projection_names
