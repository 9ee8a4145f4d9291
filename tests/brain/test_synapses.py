"""Lazy synapses where laziness could go wrong: at the bounds, over long silence, for readers, under the compiler."""

import dataclasses
import itertools

import numpy as np
import pytest
from network_oracle import DenseNetwork
from network_pair import PLASTICITY, QUIET, build, dyadic, run_both

from scla_mj.brain.network.memory import PAGE_BYTES, STAGGER_BYTES, WALKED_TOGETHER, arrays_of, copy_of
from scla_mj.config import NetworkConfig

AT_THE_BOUNDS = {"lower bound, rewarded": (0.0, 0.05, 0.4), "upper bound, punished": (3.95, 4.0, -0.4)}


@pytest.mark.parametrize(("low", "high", "release"), AT_THE_BOUNDS.values(), ids=AT_THE_BOUNDS)
def test_a_weight_that_meets_its_bound_and_turns_back_is_clipped_when_it_meets_it(low, high, release):
    """A depressed synapse is driven into its bound and then, once its motor neuron fires, away from it again."""
    rng = np.random.default_rng(5)
    weights = dyadic(rng, (8, 100, 100), low, high)
    network, oracle = build(), DenseNetwork(weights)
    network.weights = weights
    expected, found = run_both(oracle, network, rng, chunks=30, reward=lambda _: np.full(8, release))
    np.testing.assert_array_equal(found, expected)
    bound = 0.0 if release > 0 else 4.0
    assert (oracle.w == bound).sum() > 100
    np.testing.assert_allclose(network.weights, oracle.w, rtol=0, atol=1e-12)
    np.testing.assert_allclose(network.eligibility, oracle.c, rtol=0, atol=1e-12)


def test_a_minute_of_silence_between_two_spikes_loses_nothing():
    network = build()
    network.weights = np.ones((8, 100, 100))
    pre, post = np.zeros(1000), np.zeros(1000)
    pre[3], post[405] = 200.0, 200.0
    for _ in range(2):
        network.run(1, pre)
        network.run(6)
        network.run(1, post)
        network.release_dopamine(np.full(8, 0.5))
        network.run(60_000)
    q = np.exp(-1 / 1000 - 1 / 200)
    once = 0.05 * 0.1 * np.exp(-7 / 20) * 0.5 * q / (1 - q)
    assert network.weights[0, 3, 5] == pytest.approx(1.0 + 2 * once, abs=1e-9)
    assert np.count_nonzero(network.weights != 1.0) == 1


def test_who_reads_weights_changes_no_bit():
    drive = np.zeros(1000)
    drive[:100] = 8.0
    read, unread = build(NetworkConfig()), build(NetworkConfig())
    for network in (read, unread):
        for _ in range(10):
            network.release_dopamine(np.full(8, 0.3))
            network.run(70, drive)
            if network is read:
                assert network.mean_weights().shape == network.weights.shape[:1]
    for name, array in read.arrays._asdict().items():
        np.testing.assert_array_equal(array, getattr(unread.arrays, name), err_msg=name)


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_the_mean_weights_are_the_means_of_the_weights_whether_dopamine_comes_or_not(precision):
    network = build(NetworkConfig(precision=precision))
    drive = np.zeros(1000)
    drive[:400] = 8.0
    for release in (0.0, 0.5, 0.0, -0.5, 0.0):
        network.release_dopamine(np.full(8, release))
        network.run(130, drive)
        expected = network.weights.astype(float).mean(axis=(1, 2))
        np.testing.assert_allclose(network.mean_weights(), expected, rtol=0, atol=1e-12)


def test_dopamine_on_its_way_is_seen_when_it_is_due():
    network = build()
    network.release_dopamine(np.full(8, 0.5), delay_steps=10)
    assert not network.dopamine.any()
    network.run(10)
    assert (network.dopamine == 0.5).all()


def test_a_longer_stdp_trace_than_a_stretch_is_kept_over_it():
    plasticity = dataclasses.replace(PLASTICITY, stdp_tau_ms=200.0)
    network = build(QUIET, plasticity)
    pre, post = np.zeros(1000), np.zeros(1000)
    pre[3], post[405] = 200.0, 200.0
    network.run(1, pre)
    network.run(179)
    network.run(1, post)
    assert network.eligibility[0, 3, 5] == pytest.approx(0.1 * np.exp(-180 / 200), rel=1e-12)


@pytest.mark.parametrize("neurons", [1000, 3000])
def test_what_the_neurons_loop_walks_through_lies_apart_within_its_pages(neurons):
    memory = build(NetworkConfig(), neurons=neurons).memory
    places = sorted(memory[name][0].ctypes.data % PAGE_BYTES for name in WALKED_TOGETHER)
    assert places == [number * STAGGER_BYTES for number in range(len(WALKED_TOGETHER))]


def test_no_two_fields_of_the_memory_overlap_but_the_spikes_and_their_octets():
    fields = build().memory.dtype.fields
    assert fields["fired_octets"][1] == fields["fired"][1]
    places = sorted((offset, offset + dtype.itemsize) for name, (dtype, offset) in fields.items() if name != "fired")
    assert all(end <= start for (_, end), (start, _) in itertools.pairwise(places))


def test_a_copy_of_the_memory_is_another_network_alike():
    network = build(NetworkConfig())
    network.run(100)
    copy = copy_of(network.memory)
    before = {name: array.copy() for name, array in network.arrays._asdict().items()}
    network.run(100)
    for name, array in arrays_of(copy)._asdict().items():
        np.testing.assert_array_equal(array, before[name], err_msg=name)
