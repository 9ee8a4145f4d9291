"""A network and its input as a file that other simulators read: plain arrays and numbers, nothing of ours."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.workload import CHUNK_MS, CHUNKS_A_SECOND, SIGNS, Workload
from scla_mj.anatomy import INHIBITORY, MOTOR, NEURON_COUNT, POPULATIONS, PROJECTIONS, SENSORY
from scla_mj.brain.network.network import Network
from scla_mj.brain.network.parameters import TRACE_LOWER_BOUND
from scla_mj.config import NetworkConfig, PlasticityConfig


def write_job(
    file: Path,
    network: NetworkConfig,
    plasticity: PlasticityConfig,
    weights: NDArray[Any],
    work: Workload,
    *,
    plastic: bool,
    record: bool,
) -> None:
    """Write what `peers/worker.py` calls a Job, with a second of network time as a round.

    `weights`, (8, 100, 100), are those at the start; `record` asks for float64 and for every spike.
    """
    job = {"constants": _constants(network, plasticity), "chunk_ms": CHUNK_MS, "plastic": plastic, "record": record}
    np.savez(
        file,
        weights=weights.astype(np.float64),
        drives=work.drives,
        releases=work.releases,
        noise_half_width=_noise_half_width(network),
        populations=np.array([population.start for population in POPULATIONS] + [NEURON_COUNT]),
        projections=np.array([(int(p.sensor), len(SENSORY) + int(p.motor)) for p in PROJECTIONS]),
        signs=SIGNS,
        settings=json.dumps({"chunks_a_round": CHUNKS_A_SECOND, "job": job}),
    )


def own_spikes(network: Network, work: Workload) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Run the job's input on our network; return every spike's step and neuron, and the weights at the end."""
    steps, neurons = [], []
    for chunk, (drive, release) in enumerate(zip(work.drives, work.releases, strict=True)):
        network.release_dopamine(release)
        spikes = network.run(CHUNK_MS, drive)
        steps.append(spikes.step + chunk * CHUNK_MS)
        neurons.append(spikes.neuron)
    return np.concatenate(steps), np.concatenate(neurons), network.weights


def _constants(network: NetworkConfig, plasticity: PlasticityConfig) -> dict[str, float]:
    """The equations' constants for steps of 1 ms, under the names that the peers use."""
    taus = {
        "trace": plasticity.stdp_tau_ms,
        "eligibility": plasticity.eligibility_tau_ms,
        "dopamine": plasticity.dopamine_tau_ms,
    }
    return {
        **{f"{name}_tau_ms": tau for name, tau in taus.items()},
        **{f"{name}_decay": float(np.exp(-1.0 / tau)) for name, tau in taus.items()},
        "trace_lower_bound": TRACE_LOWER_BOUND["float64"],
        "dopamine_release": plasticity.dopamine_release,
        "learning_rate": plasticity.learning_rate_per_ms,
        "weight_max": network.weight_max,
        "potentiation": plasticity.stdp_potentiation,
        "depression": plasticity.stdp_depression,
        "motor_to_inhibitory": network.motor_to_inhibitory,
        "inhibitory_to_motor": network.inhibitory_to_motor,
    }


def _noise_half_width(network: NetworkConfig) -> NDArray[np.float64]:
    half_width = np.zeros(NEURON_COUNT)
    for populations, deviation in (
        (SENSORY, network.sensory_noise),
        (MOTOR, network.motor_noise),
        (INHIBITORY, network.inhibitory_noise),
    ):
        half_width[populations[0].start : populations[-1].stop] = deviation * 3.0**0.5
    return half_width
