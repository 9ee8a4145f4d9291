"""From a configuration to a robot with a brain on a floor: the one place where the parts are joined."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scla_mj.brain.registry import BRAINS, build_brain
from scla_mj.experiments.checked_brain import CheckedBrain
from scla_mj.loop.drive import Driver
from scla_mj.loop.floor import DirectionNoise
from scla_mj.loop.trial import Trial
from scla_mj.randomness import Consumer, generator
from scla_mj.world.world import World

if TYPE_CHECKING:
    from scla_mj.config import RunConfig


def build_trial(config: RunConfig) -> Trial:
    """Return a robot with a brain, standing in its first start cell.

    Raises:
        SclaError: the configuration cannot be run.
    """
    config.check()
    grid, clock = config.build_grid(), config.build_clock()
    world = World(grid, clock)
    brain = build_brain(config, clock)
    return Trial(
        grid=grid,
        clock=clock,
        protocol=config.protocol,
        world=world,
        brain=brain if config.brain in BRAINS else CheckedBrain(brain, config.brain, cells=grid.cells),
        driver=Driver(world, clock, config.controller),
        noise=DirectionNoise(config.world.direction_noise, rng=generator(config.seed, Consumer.DIRECTION_NOISE)),
        spawn=generator(config.seed, Consumer.SPAWN),
    )
