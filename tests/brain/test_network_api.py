"""The network as a library: its seed, names, windows and weights, and what it refuses."""

import numpy as np
import pytest
from network_pair import build

from scla_mj.brain.network import kernel
from scla_mj.brain.network.network import Network
from scla_mj.brain.scla import SclaBrain
from scla_mj.checked import check
from scla_mj.config import NetworkConfig, PlasticityConfig, RunConfig
from scla_mj.errors import SclaError


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda network: network.run(5, np.zeros(999)), r"drive has the shape \(999,\): it must be \(1000,\)"),
        (lambda network: network.advance(5, np.zeros((2, 1000))), r"drive has the shape \(2, 1000\)"),
        (lambda network: network.release_dopamine(np.ones(3)), r"amount has the shape \(3,\): it must be \(8,\)"),
        (lambda network: network.run(5, "a"), "drive is an array of <U1 values: it must be one of integers or floats"),
        (
            lambda network: network.run(5, [[1.0], [1.0, 2.0]]),
            r"drive is \[\[1.0\], \[1.0, 2.0\]\]: it must be an array",
        ),
        (lambda network: network.run(5, np.zeros(1000, complex)), "drive is an array of complex128 values"),
        (lambda network: network.run(5, np.zeros(1000, bool)), "drive is an array of bool values"),
        (lambda network: network.run(5, np.zeros(1000, object)), "drive is an array of object values"),
        (lambda network: network.run(5, np.ma.masked_less(np.zeros(1000), 1.0)), "drive is an array of masked values"),
        (lambda network: network.run(5, np.full(1000, np.nan)), "drive goes from nan to nan: every current must be"),
        (lambda network: network.run(5, [np.inf] * 1000), "drive goes from inf to inf"),
        (
            lambda network: network.run(5, [-1e39] * 1000),
            "drive goes from .* every current must be a number within 1e6",
        ),
        (lambda network: network.run(True), "steps is True: it must be a whole number, 0 to 2147483647"),
        (lambda network: network.run(np.array(3)), r"steps is array\(3\): it must be a whole number"),
        (lambda network: network.run(10**30), "steps is 10{30}: it must be a whole number"),
        (lambda network: (network.run(3), network.advance(2**31 - 3, extend=True)), "steps is 2147483645"),
        (lambda network: network.release_dopamine([1e30] * 8), r"amount is 1e\+30, 1e\+30.*from -1000 to 1000"),
        (lambda network: network.release_dopamine([True] * 8), "amount is an array of bool values"),
        (lambda network: network.release_dopamine(None), "amount is an array of object values"),
        (lambda network: network.release_dopamine(np.ones(8), delay_steps=2**31), "delay_steps is 2147483648"),
        (lambda network: setattr(network, "weights", "a"), "weights is an array of <U1 values"),
        (
            lambda network: setattr(network, "weights", np.ones((8, 100, 100), complex)),
            "weights is an array of complex",
        ),
        (lambda network: network.run(-1), "steps is -1: it must be a whole number"),
        (lambda network: network.run(2.5), "steps is 2.5: it must be a whole number"),
        (
            lambda network: network.release_dopamine(np.full(8, np.nan)),
            "every amount of dopamine must be a number from -1000 to 1000",
        ),
        (lambda network: network.release_dopamine(np.ones(8), delay_steps=-1), "delay_steps is -1"),
        (lambda network: setattr(network, "weights", np.full((8, 100, 100), np.nan)), "must be a number from 0 to 4"),
        (lambda network: setattr(network, "weights", np.full((8, 100, 100), 4.5)), "weights go from 4.5 to 4.5"),
        (lambda network: setattr(network, "weights", np.full((8, 100, 100), -0.5)), "from 0 to 4"),
        (lambda network: setattr(network, "weights", np.ones((100, 100, 8))), r"weights has the shape \(100, 100, 8\)"),
        (lambda _: build(neurons=1500), "choose a multiple of 1000"),
        (lambda _: build(neurons=1000.0), "neurons is 1000.0: it must be a whole number"),
        (lambda _: build(neurons=10**9), "neurons is 1000000000: it must be a whole number, 0 to 1000000"),
        (lambda _: build(seed=-1), "--seed is -1"),
        (lambda _: build(seed=2**63), "--seed is 9223372036854775808"),
        (lambda _: build(neural_step_ms="1"), "--clock.neural-step-ms is '1'"),
        (
            lambda _: build(plasticity=PlasticityConfig(stdp_tau_ms=0.5)),
            "--plasticity.stdp-tau-ms is 0.5: it must be at l",
        ),
        (lambda _: Network(NetworkConfig(precision="float16")), "--network.precision is 'float16'"),
        (lambda _: Network(NetworkConfig(weight_high=5.0)), "above --network.weight-max"),
        (lambda _: build(neural_step_ms=5.0), "--clock.neural-step-ms is 5.0"),
    ],
)
def test_what_no_network_can_take_is_refused_in_a_sentence(ask, sentence):
    network = build()
    network.run(20)
    with pytest.raises(SclaError, match=sentence) as refusal:
        ask(network)
    assert "\n" not in str(refusal.value) and len(str(refusal.value)) < 250
    assert network.advance(5).shape == (12,)
    assert np.isfinite(network.weights).all()


@pytest.mark.parametrize(
    "alike",
    [
        lambda drive: drive.tolist(),
        lambda drive: drive.astype(np.float32),
        lambda drive: drive.astype(np.int8),
        lambda drive: drive.astype(">f8"),
        lambda drive: np.repeat(drive, 2)[::2],
        lambda drive: np.frombuffer(drive.tobytes()),  # read-only
        lambda drive: np.frombuffer(b"x" + drive.tobytes(), offset=1),  # not aligned
        lambda drive: np.ma.MaskedArray(drive),
    ],
)
def test_whatever_holds_the_same_currents_drives_alike_and_nothing_is_compiled_again(alike):
    networks = [Network(), Network()]
    drive = np.zeros(1000)
    drive[100:200] = 8.0
    networks[0].run(60, drive)
    compiled = len(kernel.run.signatures)
    found = networks[1].run(60, alike(drive))
    assert found.neuron.tolist() == networks[0].spikes().neuron.tolist() and len(found.neuron)
    assert len(kernel.run.signatures) == compiled


def test_dopamine_of_any_number_format_is_released_alike():
    networks = [Network() for _ in range(3)]
    for network, amounts in zip(networks, ([1] * 8, np.ones(8, np.float16), tuple(np.ones(8, ">i2"))), strict=True):
        network.release_dopamine(amounts)
        network.run(30)
    for network in networks[1:]:
        np.testing.assert_array_equal(network.dopamine, networks[0].dopamine)
        np.testing.assert_array_equal(network.weights, networks[0].weights)


def test_an_extended_window_counts_all_of_it_and_hands_out_copies():
    drive = np.zeros(1000)
    drive[:100] = 8.0
    whole, parts = build(NetworkConfig()), build(NetworkConfig())
    expected = whole.run(80, drive)
    first = parts.advance(50, drive)
    first[:] = 0
    parts.spikes().counts[:] = 0
    counts = parts.advance(30, drive, extend=True)
    np.testing.assert_array_equal(counts, expected.counts)
    np.testing.assert_array_equal(parts.spikes().step, expected.step)
    np.testing.assert_array_equal(parts.spikes().neuron, expected.neuron)
    assert parts.spike_count == len(expected.step) > 0


def test_the_network_of_a_seed_is_that_of_a_run_with_the_seed():
    config = RunConfig(seed=7)
    brain = SclaBrain(check(config))
    alone = Network(seed=7)
    drive = np.zeros(1000)
    drive[300:400] = 8.0
    np.testing.assert_array_equal(alone.weights, brain.network.weights)
    np.testing.assert_array_equal(alone.run(100, drive).neuron, brain.network.run(100, drive).neuron)


def test_assigned_weights_are_those_of_the_next_spikes_and_an_edit_in_place_is_refused():
    network = build()
    weights = np.zeros((8, 100, 100))
    weights[0, 3, 5] = 4.0
    network.weights = weights.tolist()
    drive = np.zeros(1000)
    drive[3] = 200.0
    network.run(1, drive)
    assert np.flatnonzero(network.arrays.synaptic).tolist() == [405]
    for array in (network.weights, network.eligibility, network.dopamine):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 99.0


def test_weights_that_were_read_can_be_assigned_in_any_number_format():
    network = Network(NetworkConfig(weight_low=0.1, weight_high=0.7, weight_max=0.7))
    network.release_dopamine(np.full(8, 5.0))
    network.run(1000, np.full(1000, 8.0))
    weights = network.weights
    assert float(weights.max()) == float(np.float32(0.7)) < 0.7
    network.weights = weights.astype(float)
    np.testing.assert_array_equal(network.weights, weights)
    network.weights = np.full((8, 100, 100), 0.7)
    assert (network.weights == np.float32(0.7)).all()


def test_populations_and_projections_are_known_by_name():
    network = Network()
    up = next(population for population in network.populations if population.name == "SU")
    drive = np.zeros(1000)
    drive[up.start : up.stop] = 200.0
    assert network.run(1, drive).neuron.tolist() == list(range(up.start, up.stop))
    assert [projection.name for projection in network.projections][:2] == ["SUtoMU", "SUtoMD"]
