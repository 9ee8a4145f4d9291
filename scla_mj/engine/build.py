"""From a configuration to a robot with a brain in an arena: the one place where the parts are joined."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from scla_mj.brain.base import Brain
from scla_mj.brain.registry import BRAINS, build_brain
from scla_mj.brain.scla import SclaBrain
from scla_mj.checked import CheckedConfig, check, require_undisturbed
from scla_mj.config import RunConfig
from scla_mj.engine.checked_brain import CheckedBrain
from scla_mj.engine.compile_ahead import CompiledAhead
from scla_mj.errors import SclaError
from scla_mj.loop.action_noise import ActionNoise
from scla_mj.loop.drive import Driver
from scla_mj.loop.fleet import Fleet
from scla_mj.loop.fleet_simulation import FleetSimulation
from scla_mj.loop.localiser import Localiser
from scla_mj.loop.periods import run_periods
from scla_mj.loop.simulation import Simulation
from scla_mj.loop.task import Task
from scla_mj.loop.twin import NoRandomisation, TwinDriver, TwinWorld
from scla_mj.randomness import Consumer, generator
from scla_mj.world.domain_randomisation import DomainRandomisation
from scla_mj.world.robot import robot_of
from scla_mj.world.world import World

if TYPE_CHECKING:
    import numpy as np

_Streams: TypeAlias = "Mapping[Consumer, np.random.Generator]"
_Sensors: TypeAlias = "Mapping[str, Callable[[World], Any]] | None"
_OF_THE_TASK: Final = (
    Consumer.SPAWN,
    Consumer.ACTION_NOISE,
    Consumer.DOMAIN_RANDOMISATION,
    Consumer.PERTURBATION,
    Consumer.SENSOR_NOISE,
)


def simulate(config: RunConfig | CheckedConfig) -> Simulation:
    """Return a robot with its brain, standing in its first start cell: each `step()` makes one decision.

    Raises:
        SclaError: the configuration cannot be run.
    """
    checked = check(config)
    name = checked.config.brain
    # Of the brains only those with a network compile something in the meantime: the plain drive is compiled ahead.
    ahead = CompiledAhead(run_periods) if issubclass(BRAINS.get(name, Brain), SclaBrain) else None
    brain = watched_brain(checked)
    before_first_drive = None if ahead is None else ahead.join
    task = build_task(checked, sensors=brain.sensors, before_first_drive=before_first_drive)
    return Simulation(checked, task, brain)


def simulate_fleet(
    config: RunConfig | CheckedConfig, seeds: Iterable[int], *, threads: int | None = None
) -> FleetSimulation:
    """Return one robot with a brain for each seed, in one process: each `step()` makes one decision of all of them.

    Every robot decides and moves as the one that `simulate` returns for its seed, to the bit.

    Args:
        config: the settings of all robots, but for the seed.
        seeds: one for each robot.
        threads: how many run them; None for one per core that this process may use.

    Raises:
        SclaError: the configuration or a seed cannot be run; the robots are disturbed or localise themselves, or the
            brain has sensors of its own: those need a process each (`scla-mj reproduce`, or `simulate`).
    """
    if not isinstance(seeds, Iterable):
        raise SclaError(f"seeds is {seeds!r}: it must be a list of seeds, such as range(8)")
    checked, seeds = check(config), list(seeds)
    fleet = Fleet(checked, len(seeds), threads=threads)
    brains = [watched_brain(check(dataclasses.replace(checked.config, seed=seed))) for seed in seeds]
    if any(brain.sensors for brain in brains):
        raise SclaError(f"--brain {checked.config.brain} has sensors of its own, which a fleet has not: use simulate")
    for robot, seed in enumerate(seeds):
        fleet.reseed(robot, seed)
    return FleetSimulation(fleet, brains)


def watched_brain(checked: CheckedConfig) -> Brain:
    """Return the brain that the configuration names; what one of a user's own answers is checked.

    Raises:
        SclaError: as `build_brain`.
    """
    brain, name = build_brain(checked), checked.config.brain
    return brain if name in BRAINS else CheckedBrain(brain, name, cells=checked.config.grid.cells)


def build_task(
    config: RunConfig | CheckedConfig,
    *,
    sensors: Mapping[str, Callable[[World], Any]] | None = None,
    before_first_drive: Callable[[], None] | None = None,
    lean: bool = True,
    body: bool = True,
) -> Task:
    """Return the robot in its arena, without a brain: `act(action)` drives it.

    Args:
        config: the run's settings; those of a brain are not read.
        sensors: functions of the world by name; `percept.readings` has what they return.
        before_first_drive: called once, for example to wait for code that another process compiles.
        lean: leave out of the model what is only for looks.
        body: whether there is any physics; without it a task is the discrete twin (`scla_mj.loop.twin`).

    Raises:
        SclaError: the configuration cannot be run.
    """
    checked = check(config)
    settings, grid, clock = checked.config, checked.grid(), checked.clock
    streams = {consumer: generator(settings.seed, consumer) for consumer in _OF_THE_TASK}
    if not body:
        require_undisturbed(checked, "a task without a body")
        return _twin_task(checked, streams, sensors)
    world, period_s = World(grid, clock, robot_of(checked), lean=lean), clock.control_period_s
    randomisation = DomainRandomisation(
        world,
        settings.disturbance,
        control_period_s=period_s,
        model_rng=streams[Consumer.DOMAIN_RANDOMISATION],
        drive_rng=streams[Consumer.PERTURBATION],
    )
    localiser = Localiser(settings.localisation, world, control_period_s=period_s, rng=streams[Consumer.SENSOR_NOISE])
    driver = Driver(
        world,
        clock,
        settings.controller,
        perturbation=randomisation.perturbation,
        odometer=localiser.odometer,
        look=localiser.look,
        before_first_drive=before_first_drive,
    )
    return _join(checked, streams, sensors, world, driver, randomisation, localiser)


def _twin_task(checked: CheckedConfig, streams: _Streams, sensors: _Sensors) -> Task:
    world: Any = TwinWorld(checked.grid())
    localiser = Localiser("truth", world, control_period_s=1.0, rng=streams[Consumer.SENSOR_NOISE])
    return _join(checked, streams, sensors, world, TwinDriver(world, checked.clock), NoRandomisation(), localiser)


def _join(
    checked: CheckedConfig,
    streams: _Streams,
    sensors: _Sensors,
    world: Any,
    driver: Any,
    randomisation: Any,
    localiser: Localiser,
) -> Task:
    return Task(
        grid=checked.grid(),
        protocol=checked.config.protocol,
        decision_window=checked.clock.thinking_controls,
        world=world,
        driver=driver,
        noise=ActionNoise(checked.config.task.action_noise, rng=streams[Consumer.ACTION_NOISE]),
        randomisation=randomisation,
        localiser=localiser,
        streams=streams,
        sensors={} if sensors is None else sensors,
        crossed=checked.has_crossed(1),
    )
