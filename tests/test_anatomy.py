"""The names and sizes of the paper's Tables 3 and 4, typed in here once more, from the paper; and a brain's own."""

import json

import pytest

from scla_mj.anatomy import (
    INHIBITORY,
    MOTOR,
    NEURON_COUNT,
    PAPER_ANATOMY,
    POPULATIONS,
    PROJECTIONS,
    SENSORY,
    Anatomy,
    Population,
    Projection,
    paper_anatomy,
    read_anatomy,
    stacked,
)
from scla_mj.errors import SclaError

TABLE_4 = "SU->MU SU->MD SD->MU SD->MD SL->ML SL->MR SR->MR SR->ML"


def test_populations_are_table_3_and_share_out_the_thousand_neurons():
    assert " ".join(population.name for population in POPULATIONS) == "SU SD SL SR MU MD ML MR IU ID IL IR"
    owners = [index for population in POPULATIONS for index in range(population.start, population.stop)]
    assert owners == list(range(1000))
    assert NEURON_COUNT == 1000


def test_sensors_and_motors_have_a_hundred_neurons_and_inhibitors_fifty():
    assert {population.size for population in SENSORY + MOTOR} == {100}
    assert {population.size for population in INHIBITORY} == {50}


def test_the_excitatory_neurons_come_first():
    assert MOTOR[-1].stop == 800
    assert {population.name[0] for population in POPULATIONS if population.stop <= 800} == {"S", "M"}


def test_projections_are_table_4():
    assert [projection.name for projection in PROJECTIONS] == TABLE_4.replace("->", "to").split()
    for projection in PROJECTIONS:
        sensor, motor = projection.name.split("to")
        assert (SENSORY[projection.sensor].name, MOTOR[projection.motor].name) == (sensor, motor)


def test_four_projections_agree_and_four_oppose():
    agreeing = {projection.name for projection in PROJECTIONS if projection.agrees}
    assert agreeing == {"SUtoMU", "SDtoMD", "SLtoML", "SRtoMR"}
    assert all(projection.motor is projection.sensor.opposite for projection in PROJECTIONS if not projection.agrees)


def test_a_larger_network_has_larger_populations_and_its_weights_in_blocks():
    anatomy = paper_anatomy(3000)
    assert anatomy.neurons == 3000 and anatomy.population_names == PAPER_ANATOMY.population_names
    assert {projection.shape for projection in anatomy.projections} == {(3, 100, 100)}


def test_an_anatomy_is_the_same_after_a_round_through_json():
    plain = Anatomy(stacked(("a", 3), ("b", 2, "motor")), (Projection("a_b", "a", "b", (6,)),))
    for anatomy in (PAPER_ANATOMY, plain):
        assert read_anatomy(json.loads(json.dumps(anatomy.content()))) == anatomy
    assert read_anatomy(None) is None
    assert plain.neurons == 5 and plain.of_role("motor") == (Population("b", 3, 5, "motor"),)


TWO = stacked(("a", 3), ("b", 2))
JOINED = Projection("ab", "a", "b", (3, 2))
WRONG = {
    "no population": lambda: Anatomy(()),
    "a list": lambda: Anatomy(list(TWO)),
    "a tuple for a population": lambda: Anatomy((("a", 0, 3),)),
    "two of a name": lambda: Anatomy(stacked(("a", 3), ("a", 2))),
    "a name that no column has": lambda: Anatomy(stacked(("a b", 3))),
    "a name that is a path": lambda: Anatomy(stacked(("a/b", 3))),
    "a name that recordings use": lambda: Anatomy(stacked(("windows", 3))),
    "a name that is a number": lambda: Anatomy((Population(7, 0, 3),)),
    "a late beginning": lambda: Anatomy((Population("a", 1, 3),)),
    "a gap": lambda: Anatomy((Population("a", 0, 3), Population("b", 4, 5))),
    "no neuron": lambda: Anatomy((Population("a", 0, 0),)),
    "half a neuron": lambda: Anatomy((Population("a", 0, 2.5),)),
    "no size": lambda: stacked(("a", 0)),
    "a colour's name": lambda: Anatomy((Population("a", 0, 3, "", "red"),)),
    "a role that is no text": lambda: Anatomy((Population("a", 0, 3, None),)),
    "an end that is not there": lambda: Anatomy(TWO, (JOINED._replace(target="c"),)),
    "two projections of a name": lambda: Anatomy(TWO, (JOINED, JOINED)),
    "a shape that is a number": lambda: Anatomy(TWO, (JOINED._replace(shape=6),)),
    "a range upside down": lambda: Anatomy(TWO, (JOINED._replace(weight_range=(1.0, 0.0)),)),
    "a stored one that is none": lambda: read_anatomy({"populations": [{"name": "a"}], "projections": []}),
    "a stored one that is a text": lambda: read_anatomy("a"),
}


@pytest.mark.parametrize("wrong", WRONG.values(), ids=WRONG.keys())
def test_a_wrong_anatomy_is_refused_in_one_sentence(wrong):
    with pytest.raises(SclaError) as refused:
        wrong()
    assert "\n" not in str(refused.value) and len(str(refused.value)) < 200
