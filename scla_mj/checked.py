"""A checked configuration: what is asked of a run, known to be possible, and what follows from it, made once."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any, Final, NamedTuple

from scla_mj.anatomy import POPULATION_NAMES, PROJECTION_NAMES
from scla_mj.clock import Clock, resolve_clock
from scla_mj.config import NetworkConfig, PlasticityConfig, RunConfig, flatten, option_of
from scla_mj.errors import SclaError
from scla_mj.floor import floor_of, with_files
from scla_mj.grid import Cell, Grid
from scla_mj.markov import ceiling_hits_per_1000, chance_hits_per_1000
from scla_mj.validation import shown, validated


class _Condition(NamedTuple):
    """A setting that is read only under another one: changed without it, it would silently do nothing."""

    setting: str
    is_read: Callable[[RunConfig], bool]
    wanted: str


_CONDITIONS: Final = (
    _Condition("task.jump-target", lambda run: run.task.jump_epoch > 0, "--task.jump-epoch"),
    _Condition(
        "automaton.epsilon",
        lambda run: run.automaton.scheme == "reward-epsilon-penalty",
        "--automaton.scheme reward-epsilon-penalty",
    ),
    _Condition(
        "automaton.penalty-rate",
        lambda run: run.automaton.scheme != "reward-inaction",
        "another scheme than --automaton.scheme reward-inaction",
    ),
    _Condition("automaton.discount", lambda run: run.automaton.local_rule, "--automaton.local-rule"),
    _Condition("automaton.trace-tau-moves", lambda run: run.automaton.distal_reward, "--automaton.distal-reward"),
)


_MOST_WEIGHT: Final = 100.0


class CheckedConfig:
    """A `RunConfig` that can be run, with its grid, its clock and its ceilings.

    Attributes:
        config: the settings, plain and of the right types.
        clock: the periods of the run.

    Raises:
        SclaError: a value cannot be taken; one sentence names the option, the value and what would be right.
    """

    def __init__(self, config: RunConfig) -> None:
        self.config: Final = with_files(_validated(config))
        self.clock: Final[Clock] = resolve_clock(self.config.clock)
        _check_weights(self.config)
        check_time_constants(self.config.plasticity, self.clock.neural_step_ms)
        _check_neurons(self.config)
        _check_ranges(self.config)
        _check_epochs(self.config)
        _check_read(self.config)
        self._stages: Final = self._schedule()
        self._known: Final = dict[tuple[Callable[..., float], int], float]()

    def stage(self, epoch: int) -> int:
        """Return how often the targets have moved by that epoch; epochs count from 1."""
        return sum(begin <= epoch for begin, _ in self._stages) - 1

    def jumps_in(self, epoch: int) -> bool:
        """Return whether the targets move as that epoch begins."""
        return any(begin == epoch for begin, _ in self.jumps)

    @property
    def jumps(self) -> tuple[tuple[int, Grid], ...]:
        """Each epoch in which the targets move, and the arena from then on."""
        return self._stages[1:]

    @property
    def grids(self) -> tuple[Grid, ...]:
        """The arena at every stage: at first, and after each move of the targets."""
        return tuple(grid for _, grid in self._stages)

    def has_crossed(self, epoch: int) -> bool:
        """Return whether every move goes the opposite way in that epoch."""
        return 0 < self.config.task.crossed_epoch <= epoch

    def grid(self, epoch: int = 1) -> Grid:
        """Return the arena's cells, with the targets where they are in that epoch."""
        return self._stages[self.stage(epoch)][1]

    def ceiling_hits_per_1000(self, epoch: int = 1) -> float:
        """Return what the best policy earns in that epoch: by search, or under action noise by value iteration."""
        return self._earned(ceiling_hits_per_1000, self.stage(epoch))

    def chance_hits_per_1000(self, epoch: int = 1) -> float:
        """Return what a brain earns in that epoch that has learned nothing of what the protocol asks for."""
        return self._earned(chance_hits_per_1000, self.stage(epoch))

    def _earned(self, earned: Callable[..., float], stage: int) -> float:
        if (earned, stage) not in self._known:
            config = self.config
            self._known[earned, stage] = earned(
                self._stages[stage][1], config.protocol, action_noise=config.task.action_noise
            )
        return self._known[earned, stage]

    def _schedule(self) -> tuple[tuple[int, Grid], ...]:
        """Return the arena's stages: the epoch from which each is there (the first before any), and its grid."""
        config, task = self.config, self.config.task
        by_epoch = dict(floor_of(config.grid).targets if config.grid.floor_text else {1: (Cell(*config.grid.target),)})
        stages = [(0, _grid(config, by_epoch.pop(1)))]
        if task.jump_epoch:
            if by_epoch or stages[0][1].others:
                raise SclaError("--task.jump-epoch moves a single target: write the schedule into the --floor instead")
            if task.jump_target == config.grid.target:
                raise SclaError("--task.jump-target is --target: choose another cell, or leave out --task.jump-epoch")
            by_epoch[task.jump_epoch] = (Cell(*task.jump_target),)
        for epoch, targets in by_epoch.items():
            try:
                stages.append((epoch, _grid(config, targets)))
            except SclaError as error:
                named = "--task.jump-target" if task.jump_epoch else f"--floor, from epoch {epoch}"
                raise SclaError(f"{named}: {error}") from error
        return tuple(stages)


def check(config: RunConfig | CheckedConfig) -> CheckedConfig:
    """Return the checked configuration; one that is checked already as it is.

    Raises:
        SclaError: it cannot be run; the sentence says why.
    """
    if isinstance(config, CheckedConfig):
        return config
    if not isinstance(config, RunConfig):
        raise SclaError(f"the configuration is {shown(config)}: it must be a RunConfig, such as RunConfig(seed=3)")
    return CheckedConfig(config)


def require_undisturbed(checked: CheckedConfig, who: str) -> None:
    """Refuse disturbances, and a robot that must find out where it is, for `who` has no place for them.

    Raises:
        SclaError: there are some.
    """
    config = checked.config
    if config.localisation != "truth" or config.disturbance != type(config.disturbance)():
        raise SclaError(
            f"{who} can neither be disturbed nor localise itself: leave out --disturbance.* and --localisation"
        )


def check_time_constants(plasticity: PlasticityConfig, neural_step_ms: float) -> None:
    """Refuse a trace or a concentration that has decayed before the next step.

    Raises:
        SclaError: a time constant is shorter than a neural step.
    """
    for name in ("stdp_tau_ms", "stdp_tau_minus_ms", "eligibility_tau_ms", "dopamine_tau_ms"):
        tau_ms = getattr(plasticity, name)
        if tau_ms < neural_step_ms and not (name == "stdp_tau_minus_ms" and tau_ms == 0.0):
            raise SclaError(
                f"{option(('plasticity', name))} is {tau_ms:g}: it must be at least a neural step, "
                f"{neural_step_ms:g} ms; raise it or choose a shorter --clock.neural-step-ms"
            )


def option(path: tuple[str | int, ...]) -> str:
    """Return how a sentence names a setting: as the command line spells it."""
    return f"--{option_of(*path)}" if path else "the configuration"


def _validated(config: RunConfig) -> RunConfig:
    content = {field.name: _content(getattr(config, field.name)) for field in dataclasses.fields(config)}
    if isinstance(config.brain, type):  # a class says where it can be imported from
        content["brain"] = f"{config.brain.__module__}:{config.brain.__qualname__}"
    return validated(RunConfig, content, spell=option)


def _content(value: Any) -> Any:
    return dataclasses.asdict(value) if dataclasses.is_dataclass(value) and not isinstance(value, type) else value


def _grid(config: RunConfig, targets: tuple[Cell, ...]) -> Grid:
    own = config.grid
    closed = frozenset(Cell(*cell) for cell in own.closed_cells)
    floor = floor_of(own) if own.floor_text else None
    starts, grip = (frozenset[Cell](), {}) if floor is None else (floor.starts, floor.grip)
    grid = Grid(own.cells, targets[0], own.cell_size_m, closed, targets[1:], starts, grip)
    grid.start_cells(config.protocol)
    return grid


def _check_weights(config: RunConfig) -> None:
    if config.network.weight_low > config.network.weight_high:
        raise SclaError("--network.weight-low is above --network.weight-high: swap them")
    if config.network.weight_high > config.network.weight_max:
        raise SclaError("--network.weight-high is above --network.weight-max: initial weights must lie within the clip")


def is_papers(network: NetworkConfig, plasticity: PlasticityConfig) -> bool:
    """Return whether types of neurons and projections are the paper's, and both STDP traces of one time constant."""
    types = network.sensory_type, network.motor_type, network.inhibitory_type
    of_one = plasticity.stdp_tau_minus_ms in (0.0, plasticity.stdp_tau_ms)
    return of_one and not network.projections and types == ("regular-spiking", "regular-spiking", "fast-spiking")


class AddedProjection(NamedTuple):
    """A projection beyond the paper's; `weight` is None if it is plastic."""

    name: str
    source: str
    target: str
    weight: float | None


def added_projections(network: NetworkConfig) -> list[AddedProjection]:
    """Return the projections that `network` adds to the paper's.

    Raises:
        SclaError: one is not written SOURCEtoTARGET or SOURCEtoTARGET:WEIGHT, or is there already.
    """
    named = {f"{source}to{target}": (source, target) for source in POPULATION_NAMES for target in POPULATION_NAMES}
    taken = {
        *PROJECTION_NAMES,
        *(f"I{i}toM{m}" for i in "UDLR" for m in "UDLR" if i != m),
        *(f"M{i}toI{i}" for i in "UDLR"),
    }
    added = []
    for text in network.projections:
        name, colon, number = text.partition(":")
        try:
            weight = float(number) if colon else None
        except ValueError:
            weight = math.nan
        if name not in named or not (weight is None or abs(weight) <= _MOST_WEIGHT):
            raise SclaError(
                f"--network.projections has {shown(text)}: write SUtoML, from one of the populations "
                f"{', '.join(POPULATION_NAMES)} to another, or SUtoML:0.5 with a fixed weight from -100 to 100"
            )
        if name in taken:
            raise SclaError(f"--network.projections has {name}, which is there already: leave it out")
        taken.add(name)
        added.append(AddedProjection(name, *named[name], weight))
    return added


def _check_neurons(config: RunConfig) -> None:
    neurons = config.network.neurons
    if neurons % 1000:
        raise SclaError(f"--network.neurons is {neurons}: it must be a multiple of 1000, as 2000")
    added_projections(config.network)


def _check_ranges(config: RunConfig) -> None:
    for name in ("friction_scale", "mass_scale"):
        ends = getattr(config.disturbance, name)
        if ends[0] > ends[1]:
            raise SclaError(
                f"{option(('disturbance', name))} is {shown(ends)}: a range wants its lower end first, swap them"
            )


def _check_epochs(config: RunConfig) -> None:
    for name in ("jump_epoch", "crossed_epoch"):
        epoch = getattr(config.task, name)
        if epoch > config.epochs:
            raise SclaError(
                f"{option(('task', name))} is {epoch}: the run ends after epoch {config.epochs}; choose one of them"
            )


def _check_read(config: RunConfig) -> None:
    """Refuse a setting that was changed although nothing reads it."""
    values, defaults = flatten(config), flatten(RunConfig())
    for setting, is_read, wanted in _CONDITIONS:
        if values[setting] != defaults[setting] and not is_read(config):
            raise SclaError(
                f"--{setting} is {shown(values[setting])}, which nothing reads: leave it out or choose {wanted}"
            )
