"""From a configuration to a robot with a brain on a floor: the one place where the parts are joined."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scla_mj.brain.registry import BRAINS, build_brain
from scla_mj.engine.checked_brain import CheckedBrain
from scla_mj.engine.compile_ahead import CompiledAhead
from scla_mj.loop.action_noise import ActionNoise
from scla_mj.loop.drive import Driver
from scla_mj.loop.localiser import Localiser
from scla_mj.loop.periods import run_periods
from scla_mj.loop.simulation import Simulation
from scla_mj.randomness import Consumer, generator
from scla_mj.world.disturbance import Disturbance
from scla_mj.world.world import World

if TYPE_CHECKING:
    from scla_mj.config import RunConfig


def build_simulation(config: RunConfig) -> Simulation:
    """Return a robot with a brain, standing in its first start cell.

    Raises:
        SclaError: the configuration cannot be run.
    """
    config.check()
    grid, clock = config.build_grid(), config.build_clock()
    # Of the brains only these have a network to compile in the meantime; the plain drive is what is compiled ahead.
    ahead = CompiledAhead(run_periods) if config.brain in ("scla", "network") else None
    world = World(grid, clock)
    brain = build_brain(config, clock)
    disturbance = Disturbance(
        world,
        config.disturbance,
        control_period_s=clock.control_period_s,
        model_rng=generator(config.seed, Consumer.MODEL_DISTURBANCE),
        drive_rng=generator(config.seed, Consumer.DRIVE_DISTURBANCE),
    )
    localiser = Localiser(
        config.localisation,
        world,
        control_period_s=clock.control_period_s,
        rng=generator(config.seed, Consumer.SENSOR_NOISE),
    )
    return Simulation(
        grid=grid,
        clock=clock,
        protocol=config.protocol,
        world=world,
        brain=brain if config.brain in BRAINS else CheckedBrain(brain, config.brain, cells=grid.cells),
        driver=Driver(
            world,
            clock,
            config.controller,
            disturbance=disturbance.interference,
            odometer=localiser.odometer,
            look=localiser.look,
            before_first_drive=None if ahead is None else ahead.join,
        ),
        noise=ActionNoise(config.task.action_noise, rng=generator(config.seed, Consumer.ACTION_NOISE)),
        disturbance=disturbance,
        localiser=localiser,
        spawn=generator(config.seed, Consumer.SPAWN),
    )
