"""A described network as a library: monitors, weights, states, rules of one's own, and what is refused."""

import dataclasses
import math
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from scla_mj.brain.network.description import Modulator, NetworkDescription, Neurons, Synapses
from scla_mj.brain.network.models import LIF, Izhikevich
from scla_mj.brain.network.network import Network
from scla_mj.brain.network.paper import paper_description
from scla_mj.brain.network.rules import Rule, fingerprint, modulated_stdp, triplet_stdp
from scla_mj.config import NetworkConfig, RunConfig
from scla_mj.errors import SclaError

DOCS = Path(__file__).parents[2] / "docs" / "network.md"
RULE = modulated_stdp(high=3.0)
DESCRIPTION = NetworkDescription(
    [Neurons("a", 20, noise=5.0, drive=4.0), Neurons("b", 10, LIF(), noise=20.0, drive=15.0, role="motor")],
    [
        Synapses("a", "b", 1.0, 0.5, delay_steps=3, rule=RULE),
        Synapses("b", "b", 0.5, rule=RULE, self_connections=False, modulator="own"),
        Synapses("b", "a", -1.0),
        Synapses("a", "a", 1.0, "one to one", name="loop"),
    ],
    [Modulator(), Modulator("own")],
    precision="float64",
)


def network(seed=1, description=DESCRIPTION):
    return Network.from_description(description, seed=seed)


def lived(one, windows=20):
    """Let it live through releases of both signs; return its spikes and plastic weights."""
    spikes = []
    for window in range(windows):
        one.release({"dopamine": 0.5 - window % 3 / 2, "own": -0.2}, delay_ms=7.0)
        spikes.append(one.run(50.0, {"a": 6.0}).neuron)
    return np.concatenate([*spikes, one.weights("atob"), one.weights("btob"), one.memory.v])


def test_a_run_with_monitors_has_the_bits_of_one_without_and_they_see_what_there_is():
    plain, watched = network(), network()
    asked = {"v": "a", "u": "b", "x": "atob", "y": "btob", "eligibility": "atob"}
    seen = {name: watched.monitor(name, of, every_ms=10.0) for name, of in asked.items()}
    weight = watched.monitor("weight", "atob", [0, 7, 3])
    np.testing.assert_array_equal(lived(watched), lived(plain))
    assert weight.values.shape == (1000, 3)
    assert weight.time_ms.tolist() == list(range(1, 1001))
    assert np.ptp(weight.values) > 0.01
    np.testing.assert_array_equal(weight.values[-1], watched.weights("atob")[[0, 7, 3]])
    np.testing.assert_array_equal(seen["eligibility"].values[-1], watched.eligibility("atob"))
    np.testing.assert_array_equal(seen["v"].values[-1], watched.memory.v[:20])
    for monitor, size in ((seen["u"], 10), (seen["x"], 20), (seen["y"], 10)):
        assert monitor.values.shape == (100, size)
        assert np.ptp(monitor.values) > 0.1


def test_monitors_and_spikes_become_data_frames_and_a_missing_library_is_named(monkeypatch):
    one = network()
    monitor = one.monitor("v", "b", [2, 5], every_ms=25.0)
    spikes = one.run(100.0)
    frame, table = monitor.to_pandas(), spikes.to_pandas()
    assert (frame.index.name, frame.index.tolist(), frame.columns.tolist()) == ("time_ms", [25, 50, 75, 100], [2, 5])
    of_b = table[table.population == "b"]
    assert of_b.neuron.tolist() == spikes["b"].neuron.tolist()
    assert of_b.time_ms.tolist() == spikes["b"].time_ms.tolist()
    assert len(table) == sum(spikes.counts.values())
    assert spikes.rates_hz()["b"] == pytest.approx(spikes.counts["b"] / 10 / 0.1)
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(SclaError, match=r"to_xarray needs xarray.*: run pip install 'scla-mj\[analysis\]'"):
        monitor.to_xarray()


def test_monitors_and_spikes_become_labelled_arrays():
    pytest.importorskip("xarray")
    one = network()
    monitor = one.monitor("weight", "atob", [0, 4], every_ms=25.0)
    spikes = one.run(100.0)
    array = monitor.to_xarray()
    assert array.dims == ("time_ms", "synapse")
    assert array.sel(time_ms=50.0, synapse=4) == monitor.values[1, 1]
    assert spikes.to_xarray().sizes == {"spike": len(spikes.neuron)}


def test_weights_that_are_written_act_and_keep_the_eligibility():
    one = network()
    one.run(200.0, {"a": 6.0})
    before = one.eligibility("btob")
    one.set_weights("btob", np.full(90, 2.5))
    one.set_weights("atob", 0.0)
    one.set_weights("btoa", -3.0)
    np.testing.assert_array_equal(one.weights("btob"), 2.5)
    np.testing.assert_array_equal(one.eligibility("btob"), before)
    assert one.weights("btoa").shape == (10, 20)
    silent = NetworkDescription([Neurons("a", 2, LIF()), Neurons("b", 2, LIF())], [Synapses("a", "b", 0.0)])
    for weight, expected in (([[0, 500], [0, 0]], [1]), ([[500, 0], [0, 0]], [0])):
        explicit = dataclasses.replace(silent.projections[0], rule=modulated_stdp(high=1000.0))
        other = network(description=dataclasses.replace(silent, projections=[explicit], precision="float64"))
        other.set_weights("atob", weight)
        other.run(1.0, {"a": [1e3, 0.0]})
        assert other.run(1.0)["b"].neuron.tolist() == expected


def test_a_restored_network_continues_bit_identically_and_another_ones_state_is_refused():
    one, other = network(), network()
    lived(one, 3)
    one.release(0.3, delay_ms=70.0)
    one.set_weights("btoa", -2.0)
    other.restore(one.state())
    np.testing.assert_array_equal(lived(other), lived(one))
    larger = network(description=dataclasses.replace(DESCRIPTION, populations=[Neurons("a", 21), Neurons("b", 10)]))
    with pytest.raises(SclaError, match="array"):
        other.restore(larger.state())


@pytest.fixture(scope="module")
def soft():
    """The rule of docs/network.md: dw/dt = rate c m times the distance to the bound ahead."""
    section = DOCS.read_text(encoding="utf-8").split("\n## A rule of your own")[1]
    program = re.search(r"```python\n(.*?)\nsoft = Rule", section, re.DOTALL)[1]
    assert len(program.splitlines()) < 40
    known = {}
    exec(program, known)
    numbers = {"potentiation": 0.1, "depression": 0.12, "rate": 0.05, "top": 2.0}
    return Rule(known["on_pre"], known["on_post"], known["follow"], numbers, high=2.0)


def test_a_rule_of_ones_own_is_three_functions_in_one_file(soft):
    cells = [Neurons(name, 1, LIF()) for name in "ab"]
    one = network(description=NetworkDescription(cells, [Synapses("a", "b", 1.0, rule=soft)]))
    one.run(1.0, {"a": 1e3})
    one.run(1.0, {"b": 1e3})
    one.run(98.0)
    one.release(20.0)
    one.run(3000.0)
    q = math.exp(-1 / 1000 - 1 / 200)
    dose = 0.1 * math.exp(-1 / 20) * 20.0 * math.exp(-98 / 1000) * q / (1 - q)
    assert one.weights("atob")[0, 0] == pytest.approx(2.0 - math.exp(-0.05 * dose), abs=2e-6)


def test_rules_of_other_code_or_other_numbers_never_share_compiled_code():
    def like(number):
        def follow(w, dose, p):
            return w + number * dose

        return (follow,)

    marks = [fingerprint(like(number)) for number in (1.0, 2.0, 1.0)]
    assert marks[0] == marks[2] != marks[1]
    assert (
        fingerprint(RULE.functions) == fingerprint(modulated_stdp().functions) != fingerprint(triplet_stdp().functions)
    )


def test_float32_with_noise_has_the_rates_of_the_papers_network():
    config = RunConfig(network=NetworkConfig(precision="float32"))
    ours = Network.from_description(paper_description(config), seed=7)
    lazy = Network(config.network, config.plasticity, seed=8)
    drive = np.zeros(1000)
    drive[:100] = 8.0
    counts = [one.advance(4000, drive).reshape(3, 4).sum(axis=1) for one in (ours, lazy)]
    np.testing.assert_allclose(*counts, rtol=0.1)
    drawn = np.stack([ours.weights(projection.name) for projection in ours.description.plastic])
    assert drawn.mean() == pytest.approx(lazy.weights.mean(), abs=0.01)


def test_an_anatomy_names_populations_and_plastic_projections():
    anatomy = network().anatomy
    assert anatomy.population_names == ("a", "b")
    assert [population.role for population in anatomy.populations] == ["", "motor"]
    assert anatomy.projection_names == ("atob", "btob")
    assert [projection.shape for projection in anatomy.projections] == [network().weights("atob").shape, (90,)]
    assert anatomy.projections[0].weight_range == (0.0, 3.0)


WRONG = {
    "two populations are called 'a'": [[Neurons("a", 1), Neurons("a", 2)], []],
    "size is 0": [[Neurons("a", 0)], []],
    "known types are regular spiking": [[Neurons("a", 1, "pyramidal")], []],
    "a is nan": [[Neurons("a", 1, Izhikevich(math.nan, 0.2, -65.0, 8.0))], []],
    "reset_mv must lie below": [[Neurons("a", 1, LIF(reset_mv=0.0))], []],
    "'c' is no population: known are a": [[Neurons("a", 1)], [Synapses("a", "c")]],
    "one to one from 1 neurons to 2": [[Neurons("a", 1), Neurons("b", 2)], [Synapses("a", "b", 1.0, "one to one")]],
    "a probability, is 1.5": [[Neurons("a", 1)], [Synapses("a", "a", 1.0, 1.5)]],
    "delay_steps is 0": [[Neurons("a", 1)], [Synapses("a", "a", delay_steps=0)]],
    "two projections are called 'atoa'": [[Neurons("a", 1)], [Synapses("a", "a"), Synapses("a", "a")]],
    "follow raised AttributeError.*'speed'; p has potentiation": [
        [Neurons("a", 1)],
        [Synapses("a", "a", rule=dataclasses.replace(RULE, follow=lambda w, dose, p: p.speed))],
    ],
    "on_pre returned 2.0: it must return w, c": [
        [Neurons("a", 1)],
        [Synapses("a", "a", rule=dataclasses.replace(RULE, on_pre=lambda w, c, x, y, p: 2.0))],
    ],
    "source is 'z'": [[Neurons("a", 1)], [], [Modulator(source="z")]],
    "projection atoa: modulator is 'dopamne': known are dopamine; any other": [
        [Neurons("a", 1)], [Synapses("a", "a", rule=RULE, modulator="dopamne")],
    ],
    "modulator is 'dopamine': known are reward, own": [
        [Neurons("a", 1)], [Synapses("a", "a", rule=RULE)], [Modulator("reward"), Modulator("own")],
    ],
    "all must be of one": [
        [Neurons("a", 1)],
        [Synapses("a", "a", rule=RULE), Synapses("a", "a", name="b", rule=triplet_stdp())],
    ],
}  # fmt: skip


@pytest.mark.parametrize("sentence", WRONG)
def test_what_does_not_fit_together_is_refused_in_a_sentence(sentence):
    with pytest.raises(SclaError, match=sentence):
        network(description=NetworkDescription(*WRONG[sentence]))


@pytest.mark.parametrize(
    ("sentence", "ask"),
    [
        ("shape", lambda one: one.set_weights("btob", np.ones(89))),
        ("from 0 to 3", lambda one: one.set_weights("btob", np.nan)),
        ("from 0 to 3", lambda one: one.set_weights("atob", 3.5)),
        ("one weight for all its pairs", lambda one: one.set_weights("btoa", np.arange(200.0).reshape(10, 20))),
        ("no projection", lambda one: one.weights("nothing")),
        ("is fixed", lambda one: one.eligibility("btoa")),
        ("no population", lambda one: one.run(1.0, {"c": 1.0})),
        ("shape", lambda one: one.run(1.0, {"a": [1.0, 2.0]})),
        ("whole number of steps", lambda one: one.run(0.5)),
        ("number of ms", lambda one: one.run(-1.0)),
        ("no modulator", lambda one: one.release({"serotonin": 1.0})),
        ("from -1000 to 1000", lambda one: one.release(math.nan)),
        ("variables are", lambda one: one.monitor("weight", "btoa")),
        ("variables are", lambda one: one.monitor("x1", "atob")),
        ("0 to 19", lambda one: one.monitor("v", "a", [20])),
    ],
)
def test_what_is_asked_wrongly_is_refused_at_once_and_changes_nothing(sentence, ask):
    one, untouched = network(), network()
    with pytest.raises(SclaError, match=sentence):
        ask(one)
    for name, array in untouched.state()["arrays"].items():
        np.testing.assert_array_equal(one.state()["arrays"][name], array)
