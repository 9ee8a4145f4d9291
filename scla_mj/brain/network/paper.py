"""The paper's network as a description (docs/model.md, wiring)."""

from __future__ import annotations

from typing import Final

from scla_mj.anatomy import INHIBITORY, MOTOR, PROJECTIONS, SENSORY
from scla_mj.brain.network.description import (
    IZHIKEVICH_TYPES,
    Modulator,
    NetworkDescription,
    Neurons,
    Synapses,
    Uniform,
)
from scla_mj.brain.network.rules import modulated_stdp
from scla_mj.config import RunConfig

_TYPES: Final = {name.replace(" ", "-"): name for name in IZHIKEVICH_TYPES}
"""The neurons' types, by their names among the settings."""


def paper_description(config: RunConfig) -> NetworkDescription:
    """Return the network of a run with this configuration: 12 populations, 8 plastic and 16 fixed projections.

    With the same seed it starts with the weights and draws the noise of `Network(config.network, config.plasticity)`.
    """
    network, plasticity, step_ms = config.network, config.plasticity, config.clock.neural_step_ms
    rule = modulated_stdp(
        plasticity.stdp_potentiation,
        plasticity.stdp_depression,
        pre_tau_ms=plasticity.stdp_tau_ms,
        post_tau_ms=plasticity.stdp_tau_minus_ms or plasticity.stdp_tau_ms,
        rate=plasticity.learning_rate_per_ms * step_ms,
        eligibility_tau_ms=plasticity.eligibility_tau_ms,
        high=network.weight_max,
    )
    kinds = (
        (SENSORY, _TYPES[network.sensory_type], network.sensory_noise, "sensory"),
        (MOTOR, _TYPES[network.motor_type], network.motor_noise, "motor"),
        (INHIBITORY, _TYPES[network.inhibitory_type], network.inhibitory_noise, "inhibitory"),
    )
    plastic = [
        Synapses(
            SENSORY[p.sensor].name,
            MOTOR[p.motor].name,
            Uniform(network.weight_low, network.weight_high),
            rule=rule,
            modulator=p.name,
            name=p.name,
        )
        for p in PROJECTIONS
    ]
    inhibiting = [
        Synapses(source.name, target.name, network.inhibitory_to_motor)
        for side, source in enumerate(INHIBITORY)
        for other, target in enumerate(MOTOR)
        if other != side
    ]
    exciting = [
        Synapses(source.name, target.name, network.motor_to_inhibitory)
        for source, target in zip(MOTOR, INHIBITORY, strict=True)
    ]
    return NetworkDescription(
        [Neurons(p.name, p.size, neuron, noise, role=role) for group, neuron, noise, role in kinds for p in group],
        [*plastic, *inhibiting, *exciting],
        [Modulator(p.name, plasticity.dopamine_tau_ms) for p in PROJECTIONS],
        step_ms=step_ms,
        precision=network.precision,
    )
