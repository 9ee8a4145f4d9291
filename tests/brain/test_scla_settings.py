"""The paper's brain with other neurons: more of them, of other types, with two STDP time constants."""

import numpy as np
import pytest

from scla_mj import NetworkConfig, PlasticityConfig, RunConfig, SclaError, simulate
from scla_mj.anatomy import paper_anatomy
from scla_mj.brain.network.general import GeneralNetwork
from scla_mj.brain.network.network import Network
from scla_mj.brain.network.paper import paper_description

CHATTERING = NetworkConfig(motor_type="chattering", inhibitory_type="low-threshold-spiking")
OTHER_TAU = PlasticityConfig(stdp_tau_ms=20.0, stdp_tau_minus_ms=40.0)


@pytest.mark.parametrize("brain", ["scla", "scla-printed"])
def test_a_larger_network_decides_and_shows_all_its_neurons(brain):
    simulation = simulate(RunConfig(brain=brain, network=NetworkConfig(neurons=2000)))
    record = [simulation.step() for _ in range(3)][-1]
    assert simulation.brain.anatomy == paper_anatomy(2000)
    assert simulation.brain.snapshot().weights.shape == (8, 2, 100, 100)
    thinking = record.activity.spike_neuron[: record.activity.thinking_spikes]
    assert record.chosen.motor_spikes == tuple(np.histogram(thinking, [800, 1000, 1200, 1400, 1599.5])[0])


@pytest.mark.parametrize("settings", [{"network": CHATTERING}, {"plasticity": OTHER_TAU}])
def test_other_types_and_time_constants_run_as_a_description_of_the_same_anatomy(settings):
    simulation = simulate(RunConfig(brain="scla-printed", **settings))
    simulation.step()
    assert isinstance(simulation.network, GeneralNetwork) and simulation.brain.anatomy == paper_anatomy()
    assert simulation.brain.snapshot().weights.shape == (8, 100, 100)


def test_a_larger_network_by_description_is_the_papers_kernels_to_the_bit():
    config = RunConfig(network=NetworkConfig(neurons=2000, precision="float64"))
    lazy = Network(config.network, config.plasticity, seed=3)
    general = GeneralNetwork(paper_description(config), seed=3)
    drive = np.repeat([8.0, 0.0], [400, 1600])
    for _ in range(10):
        for network in (lazy, general):
            network.advance(50, drive)
            network.release_dopamine(np.linspace(-0.4, 0.5, 8))
        np.testing.assert_array_equal(general.spikes().neuron, lazy.spikes().neuron)
    assert general.spike_count > 100
    weights = np.stack([general.weights(projection.name) for projection in lazy.projections])
    np.testing.assert_allclose(weights, lazy.weights, rtol=0, atol=1e-12)


def test_more_neurons_of_another_type_and_more_projections_go_together():
    network = NetworkConfig(neurons=2000, motor_type="chattering", projections=("SUtoML", "IUtoSU", "MUtoMD:-0.5"))
    simulation = simulate(RunConfig(brain="scla-printed", network=network, protocol="sensed-start"))
    brain, (added, back) = simulation.brain, simulation.brain.anatomy.projections[8:]
    assert (added.source, added.target, added.shape) == ("SU", "ML", (2, 100, 100))
    assert (back.source, back.target, back.shape) == ("IU", "SU", (2, 50, 100))
    np.testing.assert_array_equal(brain.network.weights("MUtoMD"), np.full((200, 200), np.float32(-0.25)))
    for _ in range(20):
        record = simulation.step()
        assert (record.activity.dopamine[8:] > 0).all() == record.hit
    snapshot = brain.snapshot().weights
    assert {name: weights.shape for name, weights in snapshot.items()} == {
        projection.name: projection.shape for projection in brain.anatomy.projections
    }
    assert np.ptp(snapshot["SUtoML"]) > 0.5
    state = simulation.state()
    then = [simulation.step().chosen for _ in range(3)]
    simulation.restore(state)
    assert [simulation.step().chosen for _ in range(3)] == then


def test_equal_time_constants_are_one_and_keep_the_papers_kernel():
    same = PlasticityConfig(stdp_tau_ms=20.0, stdp_tau_minus_ms=20.0)
    assert isinstance(simulate(RunConfig(brain="scla-printed", plasticity=same)).network, Network)


def test_the_description_has_the_parameters_of_the_types_and_the_two_time_constants():
    described = paper_description(RunConfig(network=CHATTERING, plasticity=OTHER_TAU))
    models = {population.role: population.model for population in described.populations}
    assert tuple(vars(models["sensory"]).values()) == (0.02, 0.2, -65.0, 8.0)  # Izhikevich 2003, Figure 2
    assert tuple(vars(models["motor"]).values()) == (0.02, 0.2, -50.0, 2.0)
    assert tuple(vars(models["inhibitory"]).values()) == (0.02, 0.25, -65.0, 2.0)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"network": NetworkConfig(neurons=1500)}, "--network.neurons is 1500: it must be a multiple of 1000"),
        ({"network": NetworkConfig(projections=("SUtoXX",))}, "--network.projections has 'SUtoXX': write SUtoML"),
        ({"network": NetworkConfig(projections=("MUtoMD:nan",))}, "--network.projections has 'MUtoMD:nan'"),
        ({"network": NetworkConfig(projections=("SUtoMD",))}, "--network.projections has SUtoMD, which is there"),
        ({"network": NetworkConfig(projections=("SUtoML", "SUtoML:1"))}, "--network.projections has SUtoML, which is"),
        ({"plasticity": PlasticityConfig(stdp_tau_minus_ms=0.5)}, "--plasticity.stdp-tau-minus-ms is 0.5"),
    ],
)
def test_what_does_not_go_together_is_refused(settings, words):
    with pytest.raises(SclaError) as refused:
        simulate(RunConfig(brain="scla-printed", **settings))
    assert words in str(refused.value)


def test_the_compiled_network_refuses_what_it_has_not():
    for settings in ({"network": CHATTERING}, {"plasticity": OTHER_TAU}):
        with pytest.raises(SclaError, match="for others describe it"):
            Network(**settings)
