"""The bench replays what really happened: bit for bit, or its comparison would be worth nothing."""

import json

import numpy as np

from scla_mj.cli.main import main
from scla_mj.config import RunConfig
from scla_mj.experiments.bench import rollouts as bench
from scla_mj.experiments.assemble import build_trial

CONFIG = RunConfig(epochs=1, decisions=30, protocol="sensed-start")


def test_the_replayed_parts_end_where_the_rollout_ended():
    run = build_trial(CONFIG)
    for decision in range(1, CONFIG.decisions + 1):
        done = run.step(epoch=1, decision=decision)
    tape, bare = bench.record(CONFIG), build_trial(CONFIG)
    bench._replay_network(bare.brain.network, tape)
    np.testing.assert_array_equal(bare.brain.network.weights, run.brain.network.weights)
    np.testing.assert_array_equal(bare.brain.network.state.v, run.brain.network.state.v)
    bench._replay_physics(bare.world, tape, CONFIG.build_clock().physics_steps_per_control)
    np.testing.assert_array_equal(bare.world.data.qpos, done.move.trajectory[-1, 1:10])


def test_the_command_prints_and_writes_every_contender(tmp_path, capsys):
    file = tmp_path / "bench.json"
    options = ["--repetitions", "1", "--decisions", "10", "--json", str(file)]
    assert main(["bench", *options]) == 0
    costs = json.loads(file.read_text())
    assert all(costs[name] > 0 for name in ("physics", "network", "off", "light", "full"))
    assert "over bare parts" in capsys.readouterr().out
    assert main(["bench", *options]) == 2
    assert "exists already" in capsys.readouterr().err
