"""The names and sizes of the paper's Tables 3 and 4, typed in here once more, from the paper."""

from scla_mj.anatomy import (
    INHIBITORY,
    MOTOR,
    NEURON_COUNT,
    POPULATIONS,
    PROJECTIONS,
    SENSORY,
)

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
