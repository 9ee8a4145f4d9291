"""Robots with brains in one process: each is the run of its own seed, to the bit."""

import dataclasses

import numpy as np
import pytest

import scla_mj
from scla_mj import RunConfig, SclaError, TaskConfig, simulate, simulate_fleet, with_sets
from scla_mj.disturbances import DisturbanceConfig

HARD = TaskConfig(action_noise=0.2, jump_epoch=2, jump_target=(1, 5), crossed_epoch=3)


class Sighted(scla_mj.SclaBrain):
    """A brain with a sensor of its own."""

    sensors = {"time_s": lambda world: world.data.time}  # noqa: RUF012


@pytest.mark.parametrize(
    "config",
    [
        RunConfig(brain="scla-printed", protocol="sensed-start"),
        RunConfig(brain="scla", epochs=3, decisions=10, task=HARD, protocol="sensed-start"),
        RunConfig(brain="dyna-q", protocol="sensed-start"),
    ],
    ids=["scla-printed", "scla with noise, jump and crossed wheels", "dyna-q"],
)
def test_every_robot_of_a_fleet_decides_moves_and_learns_as_in_its_own_run_to_the_bit(config):
    seeds = [3, 1, 7]
    fleet = simulate_fleet(config, seeds, threads=2)
    runs = [simulate(dataclasses.replace(config, seed=seed)) for seed in seeds]
    hits = 0
    for _ in range(30):
        came, records = fleet.step(), [run.step(observe=False) for run in runs]
        assert fleet.chosen == [record.chosen for record in records]
        assert came.hit.tolist() == [record.hit for record in records]
        assert came.duration_s.tolist() == [record.move.duration_s for record in records]
        assert came.position_error_m.tolist() == [record.move.position_error_m for record in records]
        hits += came.hit.sum()
    assert hits > 3
    assert fleet.fleet.time_s.tolist() == [run.time_s for run in runs]
    for robot, (run, brain) in enumerate(zip(runs, fleet.brains, strict=True)):
        assert fleet.fleet.qpos(robot).tobytes() == run.world.data.qpos.tobytes()
        ours, alone = brain.snapshot(), run.brain.snapshot()
        assert np.array_equal(ours.weights, alone.weights) or ours.weights is None
        assert np.array_equal(ours.probabilities, alone.probabilities) or ours.probabilities is None
    fleet.close()


@pytest.mark.parametrize(
    ("config", "seeds", "sentence"),
    [
        (RunConfig(disturbance=with_sets(DisturbanceConfig(), ["mass"])), [1], "a fleet of robots can neither be dis"),
        (RunConfig(brain="q-learning"), [], "the number of robots is 0"),
        (RunConfig(brain="q-learning"), 3, "it must be a list of seeds"),
        (RunConfig(brain="q-learning"), [1, -1], "--seed is -1"),
        (RunConfig(brain=f"{__name__}:Sighted"), [1], "has sensors of its own"),
    ],
)
def test_what_a_fleet_with_brains_cannot_be_is_refused(config, seeds, sentence):
    with pytest.raises(SclaError, match=sentence):
        simulate_fleet(config, seeds)
