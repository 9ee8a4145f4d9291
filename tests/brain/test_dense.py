"""The dense network against the independent oracle and the compiled network, and a learning rule of one's own in it."""

import dataclasses

import numpy as np
import pytest
from network_oracle import DenseNetwork as Oracle
from network_pair import CHUNK_MS, PLASTICITY, QUIET, dyadic, run_both

from scla_mj.brain.network.dense import DenseNetwork, PairSTDP
from scla_mj.brain.network.network import Network
from scla_mj.brain.scla import SclaBrain
from scla_mj.checked import check
from scla_mj.config import NetworkConfig, RunConfig
from scla_mj.errors import SclaError
from scla_mj.grid import Action, Cell
from scla_mj.signals import Feedback, Outcome, Percept

EXACT = NetworkConfig(precision="float64")


def test_two_rewarded_seconds_give_the_spikes_and_the_weights_of_the_oracle():
    rng = np.random.default_rng(2)
    weights = dyadic(rng, (8, 100, 100), 0.5, 1.5)
    oracle, dense = Oracle(weights), DenseNetwork(QUIET)
    dense.weights = weights
    expected, found = run_both(oracle, dense, rng, chunks=40, reward=lambda rng: rng.uniform(-0.5, 0.5, 8))
    np.testing.assert_array_equal(found, expected)
    assert np.abs(oracle.w - weights).max() > 0.5
    np.testing.assert_allclose(dense.weights, oracle.w, rtol=0, atol=1e-12)
    np.testing.assert_allclose(dense.eligibility, oracle.c, rtol=0, atol=1e-12)
    np.testing.assert_allclose(dense.dopamine, oracle.d, rtol=0, atol=1e-12)


@pytest.mark.parametrize("step_ms", [1.0, 0.5])
def test_it_draws_the_noise_and_fires_the_spikes_of_the_compiled_network(step_ms):
    settings = {"neural_step_ms": step_ms, "seed": 3}
    networks, rng = (Network(EXACT, **settings), DenseNetwork(EXACT, **settings)), np.random.default_rng(0)
    for _ in range(16):
        drive, release = rng.uniform(0.0, 10.0, 1000), rng.uniform(-0.5, 0.5, 8)
        for network in networks:
            network.release_dopamine(release, delay_steps=7)
        compiled, dense = (network.run(CHUNK_MS, drive) for network in networks)
        np.testing.assert_array_equal(dense.step, compiled.step)
        np.testing.assert_array_equal(dense.neuron, compiled.neuron)
        np.testing.assert_array_equal(dense.counts, compiled.counts)
        means = [network.mean_weights() for network in networks]
        np.testing.assert_allclose(means[1], means[0], rtol=0, atol=1e-12)
    compiled, dense = networks
    assert np.ptp(compiled.weights) > 0.5
    np.testing.assert_allclose(dense.weights, compiled.weights, rtol=0, atol=1e-12)


def test_a_restored_dense_network_continues_bit_identically():
    drive = np.full(1000, 6.0)
    dense, other = DenseNetwork(seed=1), DenseNetwork(seed=2)
    dense.release_dopamine(np.full(8, 0.5), delay_steps=60)
    dense.run(40, drive)
    other.restore(dense.state())
    for network in (dense, other):
        network.run(60, drive)
    for name, array in dense.state()["rule"].items():
        np.testing.assert_array_equal(other.state()["rule"][name], array, err_msg=name)
    np.testing.assert_array_equal(other.weights, dense.weights)
    np.testing.assert_array_equal(other.spikes().neuron, dense.spikes().neuron)


def test_currents_without_measure_are_refused_and_the_largest_that_is_taken_leaves_it_sound():
    network = DenseNetwork(EXACT)
    with pytest.raises(SclaError, match="within 1e6"):
        network.run(20, np.full(1000, 1e200))
    for drive in (1e6, -1e6, 0.0):
        network.run(20, np.full(1000, drive))
    assert np.isfinite((network.arrays.v, network.arrays.u)).all()


class Hebb(PairSTDP):
    """A rule without dopamine, which changes weights at the spike; `calls` is part of what it keeps."""

    def __init__(self, plasticity, *, neural_step_ms):
        super().__init__(plasticity, neural_step_ms=neural_step_ms)
        self.calls = np.zeros(2, int)

    def on_presynaptic(self, weights, k, i):
        super().on_presynaptic(weights, k, i)
        self.calls[0] += len(i)

    def on_postsynaptic(self, weights, k, j):
        super().on_postsynaptic(weights, k, j)
        weights[k][:, j] += 10.0 * self.pre[k][:, None]
        self.calls[1] += len(j)


def test_a_rule_of_ones_own_hears_every_spike_of_every_projection_and_changes_weights_within_their_bounds():
    network = DenseNetwork(rule=Hebb)
    start, drive = network.weights, np.zeros(1000)
    drive[:800] = 8.0
    counts = network.run(60, drive).counts
    assert network.rule.calls.tolist() == [2 * counts[:4].sum(), 2 * counts[4:8].sum()]
    assert network.weights.max() == 4.0
    assert (network.weights >= start).all()


class DenseBrain(SclaBrain):
    def build_network(self, checked):
        config, clock = checked.config, checked.clock
        return DenseNetwork(
            config.network, config.plasticity, neural_step_ms=clock.neural_step_ms, seed=config.seed, rule=PairSTDP
        )


def test_a_brain_with_a_dense_network_decides_as_the_compiled_one_does():
    config = RunConfig(network=dataclasses.replace(EXACT), plasticity=PLASTICITY)
    brains = [kind(check(config)) for kind in (SclaBrain, DenseBrain)]
    for sensed in (Action.UP, Action.LEFT):
        percept = Percept(Cell(3, 2), sensed)
        compiled, dense = [brain.decide(percept) for brain in brains]
        assert dense == compiled
        for brain in brains:
            brain.elapse(0.3)
            brain.learn(Feedback(percept, sensed, sensed, Outcome.MOVED, Percept(Cell(3, 3), None), True))
    for part, expected in zip(brains[1].activity()[:-1], brains[0].activity()[:-1], strict=True):
        np.testing.assert_allclose(part, expected, rtol=0, atol=1e-12)


def test_the_kernel_hands_out_the_potentials_that_the_reference_has_after_each_step():
    compiled = Network(EXACT, PLASTICITY, seed=3)
    dense = DenseNetwork(EXACT, PLASTICITY, seed=3)
    drive = np.zeros(1000)
    drive[:100] = 12.0
    counts = compiled.advance(60, drive)
    seen = compiled.activity(50, 0, counts).potentials
    wanted, fired = [], []
    for _ in range(50):
        dense.advance(1, drive)
        wanted.append(dense.arrays.v[list(compiled.watched)])
        fired.append(np.isin(compiled.watched, dense.spikes().neuron))
    assert [neuron // 100 for neuron in compiled.watched] == list(range(8)) and np.any(fired)
    np.testing.assert_allclose(seen, np.where(fired, 30.0, wanted), rtol=0, atol=1e-9)
