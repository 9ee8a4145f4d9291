"""From a configuration to a robot with a brain in an arena: the one place where the parts are joined."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from scla_mj.brain.base import Brain
from scla_mj.brain.registry import BRAINS, build_brain
from scla_mj.brain.scla import SclaBrain
from scla_mj.checked import CheckedConfig, check
from scla_mj.config import RunConfig
from scla_mj.engine.checked_brain import CheckedBrain
from scla_mj.engine.compile_ahead import CompiledAhead
from scla_mj.loop.action_noise import ActionNoise
from scla_mj.loop.drive import Driver
from scla_mj.loop.localiser import Localiser
from scla_mj.loop.periods import run_periods
from scla_mj.loop.simulation import Simulation
from scla_mj.loop.task import Task
from scla_mj.randomness import Consumer, generator
from scla_mj.world.domain_randomisation import DomainRandomisation
from scla_mj.world.robot import ROBOT, Robot
from scla_mj.world.world import World

_OF_THE_TASK: Final = (
    Consumer.SPAWN,
    Consumer.ACTION_NOISE,
    Consumer.DOMAIN_RANDOMISATION,
    Consumer.PERTURBATION,
    Consumer.SENSOR_NOISE,
)


def simulate(config: RunConfig | CheckedConfig, *, robot: Robot = ROBOT) -> Simulation:
    """Return a robot with its brain, standing in its first start cell: each `step()` makes one decision.

    Raises:
        SclaError: the configuration cannot be run.
    """
    checked = check(config)
    name = checked.config.brain
    # Of the brains only those with a network compile something in the meantime: the plain drive is compiled ahead.
    ahead = CompiledAhead(run_periods) if issubclass(BRAINS.get(name, Brain), SclaBrain) else None
    brain = build_brain(checked)
    if name not in BRAINS:
        brain = CheckedBrain(brain, name, cells=checked.config.grid.cells)
    before_first_drive = None if ahead is None else ahead.join
    task = build_task(checked, robot=robot, sensors=brain.sensors, before_first_drive=before_first_drive)
    return Simulation(checked, task, brain)


def build_task(
    config: RunConfig | CheckedConfig,
    *,
    robot: Robot = ROBOT,
    sensors: Mapping[str, Callable[[World], Any]] | None = None,
    before_first_drive: Callable[[], None] | None = None,
) -> Task:
    """Return the robot in its arena, without a brain: `act(action)` drives it.

    `sensors` are functions of the world by name; `percept.readings` has what they return.

    Raises:
        SclaError: the configuration cannot be run.
    """
    checked = check(config)
    settings, grid, clock = checked.config, checked.grid(), checked.clock
    streams = {consumer: generator(settings.seed, consumer) for consumer in _OF_THE_TASK}
    world, period_s = World(grid, clock, robot), clock.control_period_s
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
    return Task(
        grid=grid,
        protocol=settings.protocol,
        decision_window=clock.thinking_controls,
        world=world,
        driver=driver,
        noise=ActionNoise(settings.task.action_noise, rng=streams[Consumer.ACTION_NOISE]),
        randomisation=randomisation,
        localiser=localiser,
        streams=streams,
        sensors={} if sensors is None else sensors,
        crossed=checked.has_crossed(1),
    )
