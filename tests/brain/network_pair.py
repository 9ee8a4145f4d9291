"""Networks without noise beside their dense oracle, fed the same dyadic input."""

import numpy as np
from network_oracle import DenseNetwork

from scla_mj.brain.network.network import Network
from scla_mj.config import NetworkConfig, PlasticityConfig

QUIET = NetworkConfig(
    precision="float64", sensory_noise=0.0, motor_noise=0.0, inhibitory_noise=0.0, inhibitory_to_motor=-0.625
)
PLASTICITY = PlasticityConfig()
CHUNK_MS = 50


def build(network=QUIET, plasticity=PLASTICITY, **settings):
    return Network(network, plasticity, **settings)


def dyadic(rng, shape, low, high):
    """Multiples of 2^-10: their sums are exact in any order."""
    return rng.integers(int(low * 1024), int(high * 1024), shape) / 1024.0


def oracle_and_network(rng, plasticity=PLASTICITY):
    """Both with the same dyadic weights; the constants come from two places on purpose."""
    weights = dyadic(rng, (8, 100, 100), 0.5, 1.5)
    network = build(plasticity=plasticity)
    network.weights = weights
    return DenseNetwork(weights), network


def run_both(oracle, network, rng, chunks, reward=None):
    """Deterministic input that changes every 50 ms; returns both spike trains as (step, neuron) rows."""
    expected, found = [], []
    for chunk in range(chunks):
        drive = dyadic(rng, 1000, 0.0, 12.0)
        if reward is not None and chunk % 4 == 3:
            release = reward(rng)
            oracle.d = oracle.d + release
            network.release_dopamine(release)
        spikes = network.run(CHUNK_MS, drive)
        found.append(np.column_stack((spikes.step + chunk * CHUNK_MS, spikes.neuron)))
        for step in range(chunk * CHUNK_MS, (chunk + 1) * CHUNK_MS):
            expected += [(step, neuron) for neuron in oracle.step(drive)]
    return np.array(expected), np.concatenate(found)
