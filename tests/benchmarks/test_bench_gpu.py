"""The bench on a GPU: its kernels come to what the CPU comes to. On Warp's CPU device here, where Warp is installed."""

import ctypes
import re

import numpy as np
import pytest

from benchmarks import preflight
from scla_mj.checked import check
from scla_mj.cli.main import main
from scla_mj.config import RunConfig
from scla_mj.engine.build import simulate_fleet
from scla_mj.errors import SclaError
from scla_mj.loop import fleet
from scla_mj.loop.fleet import Fleet

CHECKED = check(RunConfig(brain="scla-printed"))


def has_driver():
    try:
        return ctypes.CDLL("libcuda.so.1") is not None
    except OSError:
        return False


@pytest.mark.skipif(has_driver(), reason="this machine has a GPU's driver")
def test_without_a_gpu_the_bench_is_refused_in_one_sentence(capsys):
    assert main(["bench", "--gpu"]) == 2
    sentence = capsys.readouterr().err
    assert sentence.count("\n") == 1
    assert main(["bench", "--gpu", "--network.precision", "float64"]) == 2
    assert "has the printed network alone" in capsys.readouterr().err
    assert "pip install 'scla-mj[warp]'" in sentence or "--gpu needs an NVIDIA GPU" in sentence


def test_a_mujoco_warp_of_another_version_than_mujoco_is_refused_with_the_line_that_installs_the_right_one(monkeypatch):
    monkeypatch.setattr(preflight, "need", lambda *_: None)
    monkeypatch.setattr(preflight.metadata, "version", {"mujoco": "3.17.0", "mujoco-warp": "4.0.0"}.get)
    with pytest.raises(SclaError, match=re.escape("run pip install 'mujoco-warp==3.17.*'")):
        preflight.require_gpu("--gpu")


@pytest.fixture
def warp():
    """Return Warp, on its CPU device."""
    pytest.importorskip("mujoco_warp", reason="the kernels need the extra `warp`, which no lock has")
    warp = pytest.importorskip("warp")
    warp.config.log_level = warp.LOG_WARNING
    with warp.ScopedDevice("cpu"):
        yield warp


def test_moves_end_in_the_same_cells_after_the_same_times_as_the_cpus_and_a_micron_apart(warp):
    from benchmarks.gpu.drive import WarpBodies

    robots = 8
    one, many = Fleet(CHECKED, robots), Fleet(CHECKED, robots, body=WarpBodies)
    for robot in range(robots):
        one.reseed(robot, robot)
        many.reseed(robot, robot)
    actions = np.arange(robots) % 4
    came, same = one.act(actions), many.act(actions)
    assert set(came.outcome.tolist()) == {0, 1}  # some were blocked
    for name in ("executed", "outcome", "hit", "fallen", "duration_s", "crossed_s"):
        assert np.array_equal(getattr(came, name), getattr(same, name)), name
    assert np.array_equal(one.cells, many.cells)
    for robot in range(robots):
        assert np.allclose(one.qpos(robot)[:7], many.qpos(robot)[:7], rtol=0.0, atol=2e-5)


def test_networks_are_the_cpus_to_the_bit_whatever_their_steps_and_their_dopamine(warp):
    from benchmarks.gpu.network import WarpNetworks
    from scla_mj.brain.network.network import Network

    config, brains, rng = CHECKED.config, 3, np.random.default_rng(0)
    many = WarpNetworks(CHECKED, range(brains))
    each = [Network(config.network, config.plasticity, seed=seed) for seed in range(brains)]
    for _ in range(7):
        for steps, current in ((np.full(brains, 50), 8.0), (rng.integers(0, 130, brains), 0.0)):
            driven = rng.integers(0, 8, brains)
            counts = many.advance(steps, driven, np.full(brains, current))
            for brain, network in enumerate(each):
                drive = np.where(network.parameters.population_of == driven[brain], current, 0.0)
                assert np.array_equal(counts[brain], network.advance(int(steps[brain]), drive))
                for name, values in many.state(brain).items():
                    assert np.array_equal(values, getattr(network.arrays, name)), name
        for released, network in zip(many.released, each, strict=True):
            amount = rng.uniform(-5.0, 5.0, 8) * (rng.random(8) < 0.4)
            network.release_dopamine(amount)
            released += amount


def test_brains_decide_and_learn_as_in_the_cpus_fleet(warp, monkeypatch):
    from benchmarks.gpu import simulation

    class Bodies(fleet._Bodies):
        """The CPU's, whose moves take less time to start."""

        took_s = 0.0

        def __init__(self, checked, number):
            super().__init__(checked, number, lambda work: work(0, number))

    monkeypatch.setattr(simulation, "WarpBodies", Bodies)
    one, many = simulate_fleet(CHECKED, range(2), threads=1), simulation.WarpSimulation(CHECKED, range(2))
    for _ in range(5):
        came, same = one.step(), many.step()
        assert one.chosen == many.chosen
        assert all(np.array_equal(*values) for values in zip(came, same, strict=True))
    for ours, theirs in zip(one.brains, many.brains, strict=True):
        assert np.array_equal(ours.automata.probabilities, theirs.automata.probabilities)


def test_the_table_says_how_much_came_to_the_same(warp):
    from benchmarks.gpu.race import MORE_ROBOTS, ROBOTS, Alike, Took, sheet

    moves = Took([9.0, 9.0, 1.0, 1.0], [9.0, 9.0, 0.1, 0.1], [], [])
    brains = Took([9.0, 9.0, 2.0, 2.0], [9.0, 9.0, 0.2, 0.2], [9.0, 9.0, 0.1, 0.1], [9.0, 9.0, 0.05, 0.05])
    table = sheet(moves, brains, [9.0, 9.0, 0.2, 0.2], Alike(8, 8, 7, 2e-6), Alike(8, 6, 6, 0.0))
    assert [row[3] for row in table.rows] == ["", "10.0", f"{MORE_ROBOTS / ROBOTS / 0.2:.1f}", "", "10.0", "", ""]
    assert "8 of 8 decisions" in table.note and "7 in the same times, at most 2.0 µm apart" in table.note
    assert table.values["decisions alike"] == 0.75
