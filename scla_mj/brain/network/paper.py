"""The paper's network as a description (docs/model.md, wiring)."""

from __future__ import annotations

from typing import Final

from scla_mj.anatomy import INHIBITORY, MOTOR, NEURON_COUNT, PROJECTIONS, SENSORY
from scla_mj.brain.network.description import (
    Blocks,
    Connect,
    Modulator,
    NetworkDescription,
    Neurons,
    Synapses,
    Uniform,
)
from scla_mj.brain.network.models import IZHIKEVICH_TYPES
from scla_mj.brain.network.rules import modulated_stdp
from scla_mj.checked import added_projections
from scla_mj.config import RunConfig

_TYPES: Final = {name.replace(" ", "-"): name for name in IZHIKEVICH_TYPES}
"""The neurons' types, by their names among the settings."""


def paper_description(config: RunConfig) -> NetworkDescription:
    """Return the network of a run: 12 populations, 8 plastic and 16 fixed projections, more if asked.

    With the same seed it starts with the weights and draws the noise of `Network(config.network, config.plasticity)`.
    A larger one has blocks of synapses as anatomy.py has them, and its fixed weights are divided by its size.
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
    size = network.neurons // NEURON_COUNT
    initial = Uniform(network.weight_low, network.weight_high)
    connect: Connect = Blocks(size) if size > 1 else "all to all"
    added = added_projections(network)
    ends = [(p.name, p.source, p.target) for p in PROJECTIONS]
    ends += [(p.name, p.source, p.target) for p in added if p.weight is None]
    plastic = [
        Synapses(source, target, initial, connect, rule=rule, modulator=name, name=name)
        for name, source, target in ends
    ]
    inhibiting = [
        Synapses(source.name, target.name, network.inhibitory_to_motor / size)
        for side, source in enumerate(INHIBITORY)
        for other, target in enumerate(MOTOR)
        if other != side
    ]
    exciting = [
        Synapses(source.name, target.name, network.motor_to_inhibitory / size)
        for source, target in zip(MOTOR, INHIBITORY, strict=True)
    ]
    fixed = [Synapses(p.source, p.target, p.weight / size) for p in added if p.weight is not None]
    return NetworkDescription(
        [Neurons(p.name, p.size * size, neuron, noise, role=r) for group, neuron, noise, r in kinds for p in group],
        [*plastic, *inhibiting, *exciting, *fixed],
        [Modulator(name, plasticity.dopamine_tau_ms) for name, *_ in ends],
        step_ms=step_ms,
        precision=network.precision,
    )
