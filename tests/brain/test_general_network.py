"""Networks by description: the paper's is the compiled one to the bit, and each part has its closed form."""

import math

import numpy as np
import pytest
from scipy.stats import binom

from scla_mj.brain.network.description import (
    Modulator,
    NetworkDescription,
    Neurons,
    Normal,
    Synapses,
    Uniform,
)
from scla_mj.brain.network.models import LIF
from scla_mj.brain.network.network import Network
from scla_mj.brain.network.paper import paper_description
from scla_mj.brain.network.rules import modulated_stdp, triplet_stdp
from scla_mj.config import NetworkConfig, RunConfig

EXACT = RunConfig(network=NetworkConfig(precision="float64"))
QUIET = RunConfig(network=NetworkConfig(precision="float64", sensory_noise=0.0, motor_noise=0.0, inhibitory_noise=0.0))
PROJECTIONS = [projection.name for projection in paper_description(EXACT).plastic]
KICK = 1e3
"""A current that makes any neuron here fire in the very step."""


def described(populations, projections=(), modulators=(), **settings):
    return Network.from_description(
        NetworkDescription(populations, projections, modulators, precision="float64", **settings), seed=1
    )


def scalar(rng):
    return np.full(8, rng.uniform(-0.5, 0.5))


def signed(rng):
    return rng.uniform(-0.5, 0.5, 8)


@pytest.mark.parametrize(("config", "release"), [(QUIET, signed), (QUIET, scalar), (EXACT, signed)])
def test_five_plastic_seconds_of_the_papers_network_are_those_of_the_lazy_kernel(config, release):
    lazy = Network(config.network, config.plasticity, seed=5)
    general = Network.from_description(paper_description(config), seed=5)
    rng, spikes = np.random.default_rng(3), 0
    for chunk in range(100):  # a robot's input; under stronger drives a last bit changes spikes within two seconds
        drive, side = np.zeros(1000), rng.integers(4)
        drive[100 * side : 100 * side + 100] = rng.uniform(6.0, 12.0, 100)
        for network in (lazy, general):
            if chunk % 4 == 3:
                network.release_dopamine(release(np.random.default_rng(chunk)), delay_steps=20)
            network.advance(50, drive)
        for ours, theirs in zip(general.spikes(), lazy.spikes(), strict=True):
            np.testing.assert_array_equal(ours, theirs)
        spikes += general.spike_count
    assert spikes > 10_000
    weights = np.stack([general.weights(name) for name in PROJECTIONS])
    assert np.ptp(weights) > 1.0
    np.testing.assert_allclose(weights, lazy.weights, rtol=0, atol=1e-12)
    eligibility = np.stack([general.eligibility(name) for name in PROJECTIONS])
    np.testing.assert_allclose(eligibility, lazy.eligibility, rtol=0, atol=1e-12)
    np.testing.assert_allclose(general.dopamine, lazy.dopamine, rtol=0, atol=1e-15)


@pytest.mark.parametrize("delay", [1, 2, 7])
def test_a_spike_arrives_exactly_its_delay_later_along_each_pair_of_a_one_to_one_projection(delay):
    a, b = Neurons("a", 4, LIF()), Neurons("b", 4, LIF(refractory_ms=0.0))
    network = described([a, b], [Synapses("a", "b", KICK, "one to one", delay)])
    for neuron in range(4):
        spikes = network.run(1.0, {"a": KICK * np.eye(4)[neuron]})
        later = network.run(delay + 20.0)
        assert spikes["a"].neuron.tolist() == later["b"].neuron.tolist() == [neuron]
        assert later["b"].time_ms - spikes["a"].time_ms == [delay]


@pytest.mark.parametrize("current", [20.5, 25.0, 40.0, 300.0])
@pytest.mark.parametrize("step_ms", [1.0, 0.1])
def test_a_leaky_neuron_under_a_constant_current_fires_with_the_closed_forms_period(current, step_ms):
    cell = LIF(tau_ms=20.0, rest_mv=-70.0, reset_mv=-70.0, threshold_mv=-50.0, resistance=1.0, refractory_ms=3.0)
    network = described([Neurons("a", 1, cell)], step_ms=step_ms)
    times = network.run(1000.0, {"a": current})["a"].time_ms
    rise_ms = -cell.tau_ms * math.log(1.0 - 20.0 / current)
    period_ms = step_ms * math.ceil(rise_ms / step_ms) + cell.refractory_ms
    np.testing.assert_allclose(np.diff(times), period_ms, rtol=0, atol=1e-9)


def test_a_leaky_neurons_potential_follows_its_exponential_and_a_lasting_current_its_own():
    cell = LIF(tau_ms=20.0, threshold_mv=900.0)
    network = described(
        [Neurons("a", 1, "fast spiking"), Neurons("b", 1, cell), Neurons("c", 1, cell, synaptic_tau_ms=5.0)],
        [Synapses("a", "c", 2.0)],
    )
    seen = [network.monitor("v", name, every_ms=2.0) for name in ("b", "c")]
    network.run(1.0, {"a": KICK})
    network.run(99.0, {"b": 10.0})
    time_ms = seen[0].time_ms
    assert time_ms.tolist() == list(range(2, 101, 2))
    np.testing.assert_allclose(seen[0].values[:, 0], -60.0 - 10.0 * np.exp(-(time_ms - 1.0) / 20.0), atol=1e-9)
    keep, fade, n = math.exp(-1 / 20), math.exp(-1 / 5), time_ms - 1.0  # the current is 2 fade^k in its step k = 0, ...
    expected = -70.0 + 2.0 * (1.0 - keep) * (keep**n - fade**n) / (keep - fade)
    np.testing.assert_allclose(seen[1].values[:, 0], expected, atol=1e-9)


@pytest.mark.parametrize("probability", [0.02, 0.5, 0.97])
def test_pairs_are_connected_with_the_asked_probability(probability):
    network = described([Neurons("a", 200), Neurons("b", 150)], [Synapses("a", "b", 1.0, probability)])
    low, high = binom.interval(0.999, 200 * 150, probability)
    source, target = network.synapses("atob")
    assert low <= len(source) <= high
    assert len(set(zip(source.tolist(), target.tolist(), strict=True))) == len(source)
    for ends, size in ((source, 200), (target, 150)):
        per_neuron = np.bincount(ends, minlength=size)
        assert abs(per_neuron.mean() - len(source) / size) < 1e-9
        assert per_neuron.std() < 2.0 * math.sqrt(200 * probability * (1 - probability))


def test_weights_have_their_distribution_and_nobody_is_connected_with_itself_unless_asked():
    network = described(
        [Neurons("a", 200)],
        [
            Synapses("a", "a", Uniform(1.0, 3.0), name="flat"),
            Synapses("a", "a", Normal(-2.0, 0.5), self_connections=False, name="bell"),
        ],
    )
    flat, bell = network.weights("flat"), network.weights("bell")
    assert flat.shape == (200, 200)
    assert 1.0 <= flat.min() < flat.max() < 3.0
    assert flat.mean() == pytest.approx(2.0, abs=4.0 * math.sqrt(1 / 3 / 40_000))
    assert bell.shape == (200 * 199,)
    assert bell.mean() == pytest.approx(-2.0, abs=4.0 * 0.5 / 199)
    assert bell.std() == pytest.approx(0.5, rel=0.02)


def kicks(network, trains, duration_ms):
    """Let neurons fire at given steps: `trains` is {population: set of steps}."""
    for step in range(duration_ms):
        network.run(1.0, {name: KICK for name, steps in trains.items() if step in steps})


def test_the_triplet_rule_is_its_sum_over_pairs_and_triplets():
    rule, start = triplet_stdp(5e-10, 7e-3, 6.2e-3, 2.3e-4), 1.0
    cells = [Neurons(name, 1, LIF(refractory_ms=0.0)) for name in "ab"]
    network = described(cells, [Synapses("a", "b", start, rule=rule)])
    pre, post = [3, 10, 30, 36, 60, 61], [5, 12, 28, 36, 59, 63]
    kicks(network, {"a": pre, "b": post}, 70)

    def trace(times, now, tau):
        return sum(math.exp(-(now - t) / tau) for t in times if t < now)

    expected = start
    for t in sorted({*pre, *post}):
        if t in pre:
            expected -= trace(post, t, 33.7) * (7e-3 + 2.3e-4 * trace(pre, t, 101.0))
        if t in post:  # pairs with a presynaptic spike of its own step
            expected += (trace(pre, t, 16.8) + (t in pre)) * (5e-10 + 6.2e-3 * trace(post, t, 125.0))
    assert network.weights("atob")[0, 0] == pytest.approx(expected, abs=1e-12)
    assert abs(expected - start) > 0.01


def test_one_pairing_met_by_one_release_changes_a_weight_as_model_md_has_it():
    cells = [Neurons(name, 1, LIF()) for name in "ab"]
    network = described(cells, [Synapses("a", "b", 1.0, rule=modulated_stdp())])
    kicks(network, {"a": {0}, "b": {5}}, 6)
    c = 0.1 * math.exp(-5 / 20)
    assert network.eligibility("atob")[0, 0] == pytest.approx(c, abs=1e-15)
    network.run(94.0)
    network.release(0.5)
    network.run(5000.0)
    q = math.exp(-1 / 1000 - 1 / 200)
    assert network.weights("atob")[0, 0] - 1.0 == pytest.approx(
        0.05 * c * 0.5 * math.exp(-94 / 1000) * q / (1 - q), abs=1e-9
    )


def test_a_modulator_is_shared_by_name_released_by_name_or_by_spikes_and_returns_to_its_baseline():
    network = described(
        [Neurons("a", 1, LIF()), Neurons("b", 1, LIF()), Neurons("dopaminergic", 10, LIF())],
        [Synapses("a", "b", rule=modulated_stdp(), modulator=m, name=m) for m in ("d", "own")],
        [Modulator("d", tau_ms=50.0, baseline=-0.2, source="dopaminergic", per_spike=0.03), Modulator("own")],
    )
    assert network.modulators == {"d": -0.2, "own": 0.0}
    network.release({"own": 0.5})
    network.run(1.0, {"dopaminergic": KICK})
    assert network.modulators == pytest.approx({"d": -0.2 + 0.3, "own": 0.5 * math.exp(-1 / 200)})
    network.run(50.0)
    assert network.modulators["d"] == pytest.approx(-0.2 + 0.3 / math.e)
    np.testing.assert_allclose(network.dopamine, list(network.modulators.values()))
