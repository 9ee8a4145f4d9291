"""A network larger than the paper's."""

import numpy as np
from network_pair import CHUNK_MS, build, dyadic, oracle_and_network

from scla_mj.anatomy import populations_of


def halves_of(neurons):
    """Which neurons of a network of 2000 are the first, and which the second, of two networks of 1000: (2, 1000)."""
    ranges = [np.arange(population.start, population.stop) for population in populations_of(neurons)]
    return np.concatenate([np.split(members, 2) for members in ranges], axis=1)


def test_a_network_of_2000_neurons_fed_twice_alike_is_the_oracle_twice():
    rng = np.random.default_rng(4)
    oracle, small = oracle_and_network(rng)
    large = build(neurons=2000)
    large.weights = np.stack([small.weights, small.weights], axis=1)
    halves = halves_of(2000)
    spikes = 0
    for chunk in range(20):
        drive, doubled = dyadic(rng, 1000, 0.0, 12.0), np.empty(2000)
        doubled[halves] = drive
        release = rng.uniform(-0.5, 0.5, 8) if chunk % 4 == 3 else np.zeros(8)
        oracle.d = oracle.d + release
        large.release_dopamine(release)
        found = large.run(CHUNK_MS, doubled)
        expected = [(step, neuron) for step in range(CHUNK_MS) for neuron in oracle.step(drive)]
        for half in halves:
            mine = np.isin(found.neuron, half)
            neuron = np.searchsorted(half, found.neuron[mine])
            np.testing.assert_array_equal(np.column_stack((found.step[mine], neuron)), expected)
        spikes += len(expected)
    assert spikes > 5_000
    for block in range(2):
        np.testing.assert_allclose(large.weights[:, block], oracle.w, rtol=0, atol=1e-12)
