"""The network's constants in the kernel's own number format, derived once from the configuration."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import NEURON_COUNT, Population, populations_of
from scla_mj.brain.network.models import IZHIKEVICH_TYPES, Izhikevich
from scla_mj.config import NetworkConfig, PlasticityConfig

REGULAR_SPIKING: Final = IZHIKEVICH_TYPES["regular spiking"]
"""The paper's Table 2."""
FAST_SPIKING: Final = IZHIKEVICH_TYPES["fast spiking"]

V_LIMIT_MV: Final = 1000.0
"""Three times what v reaches in a sound run. Beyond, v squared would let the explicit half steps diverge, as they do in
steps of 1 ms where a current of some -300 comes and goes."""

# Lower bounds: a smaller dopamine concentration, eligibility (LOWER_BOUND) or STDP trace (TRACE_LOWER_BOUND) becomes
# zero. Subnormal numbers would slow the kernel thirteen-fold, and zeros cost nothing. What is dropped moves no weight
# by as much as its own rounding: rate tau_d LOWER_BOUND times an eligibility of 0.4 is 4e-7 in float32, where a weight
# of 4 has steps of 4.8e-7.
LOWER_BOUND: Final = {"float32": 1e-7, "float64": 1e-12}
TRACE_LOWER_BOUND: Final = {"float32": 1e-6, "float64": 1e-13}

STRETCH_STEPS: Final = 50
"""Longest stretch (synapses.py): a thinking window, 2.5 STDP time constants."""
_STRETCH_TAUS: Final = 2.5
"""Over more time constants of the STDP traces, or one of eligibility, a stretch's sums would lose digits in float32."""
_LEAST_DECAYED: Final = 1e-20
_LEAST_DECAYED_DOSED: Final = 1e-3
"""Lower bounds of E: within float32's range, and with dopamine such that G keeps 13 digits of what is added to it."""

# A uniform variable on [-1, 1) has a standard deviation of 1 / sqrt(3).
_UNIFORM_HALF_WIDTH: Final = 3.0**0.5


class NeuronConstants(NamedTuple):
    """Equations 1 and 2 for one step: every field a scalar of the kernel's number format.

    `quadratic`, `linear`, `offset` are 0.04, 5 and 140; `half_step` is half the neural step in ms, `rate` is a times
    the step; `pulse` makes a synaptic current of one step carry the same charge at any step length. `limit` bounds v
    between its two half steps (V_LIMIT_MV).
    """

    quadratic: Any
    linear: Any
    offset: Any
    half_step: Any
    limit: Any
    pulse: Any
    peak: Any
    rate: Any
    sensitivity: Any
    reset_v: Any
    reset_u: Any


class PlasticityConstants(NamedTuple):
    """Equations 3 and 4 for one step: every field a scalar of the kernel's number format."""

    potentiation: Any
    depression: Any
    trace_decay: Any
    weight_max: Any
    lower_bound: Any
    trace_lower_bound: Any


class Wiring(NamedTuple):
    """The fixed weights, and `noise_unit`, 2**-31, which scales a signed 32-bit integer to [-1, 1)."""

    motor_to_inhibitory: Any
    inhibitory_to_motor: Any
    noise_unit: Any


class Rates(NamedTuple):
    """Per-step changes of dopamine and of the sums of synapses.py, always in float64, and the lower bounds of E."""

    eligibility_decay: float
    dopamine_decay: float
    learning_rate: float
    least_decayed: float
    least_decayed_dosed: float


class Parameters(NamedTuple):
    """All that a step reads and never writes, for N neurons.

    `population_start`, (13,), and `population_of`, (N,), give each population's neurons and each neuron's population.
    `noise_amplitude`, (N,), is the half width of each neuron's uniform noise. `fading`, (STRETCH_STEPS + 1,), is what
    is left of a trace, over E, at each step of a stretch; a stretch has at most `stretch_steps`. `sign_bits` is a mask
    of the sign bits in 64 bits of such numbers.
    """

    excitatory: NeuronConstants
    inhibitory: NeuronConstants
    plasticity: PlasticityConstants
    wiring: Wiring
    rates: Rates
    population_start: NDArray[np.int64]
    population_of: NDArray[np.uint8]
    noise_amplitude: NDArray[Any]
    fading: NDArray[Any]
    sign_bits: np.uint64
    stretch_steps: int


def build_parameters(
    network: NetworkConfig, plasticity: PlasticityConfig, *, neural_step_ms: float, neurons: int = NEURON_COUNT
) -> Parameters:
    """Derive the constants of one step of `neural_step_ms`; a larger network divides the fixed weights by its size."""
    real = np.dtype(network.precision).type
    populations = populations_of(neurons)
    share = NEURON_COUNT / neurons
    stdp_steps = plasticity.stdp_tau_ms / neural_step_ms
    eligibility_steps = plasticity.eligibility_tau_ms / neural_step_ms
    fading_rate = 1.0 / stdp_steps - 1.0 / eligibility_steps
    return Parameters(
        excitatory=neuron_constants(REGULAR_SPIKING, neural_step_ms, real),
        inhibitory=neuron_constants(FAST_SPIKING, neural_step_ms, real),
        plasticity=PlasticityConstants(
            potentiation=real(plasticity.stdp_potentiation),
            depression=real(plasticity.stdp_depression),
            trace_decay=real(math.exp(-neural_step_ms / plasticity.stdp_tau_ms)),
            weight_max=real(network.weight_max),
            lower_bound=real(LOWER_BOUND[network.precision]),
            trace_lower_bound=real(TRACE_LOWER_BOUND[network.precision]),
        ),
        wiring=Wiring(
            motor_to_inhibitory=real(network.motor_to_inhibitory * share),
            inhibitory_to_motor=real(network.inhibitory_to_motor * share),
            noise_unit=real(2.0**-31),
        ),
        rates=Rates(
            eligibility_decay=math.exp(-neural_step_ms / plasticity.eligibility_tau_ms),
            dopamine_decay=math.exp(-neural_step_ms / plasticity.dopamine_tau_ms),
            learning_rate=plasticity.learning_rate_per_ms * neural_step_ms,
            least_decayed=_LEAST_DECAYED,
            least_decayed_dosed=_LEAST_DECAYED_DOSED,
        ),
        population_start=np.array([population.start for population in populations] + [neurons]),
        population_of=np.repeat(
            np.arange(len(populations), dtype=np.uint8), [population.size for population in populations]
        ),
        noise_amplitude=_noise_amplitude(network, populations, neural_step_ms),
        # libm's exp: numpy's has other last bits on processors with AVX-512.
        fading=np.array([math.exp(-step * fading_rate) for step in range(STRETCH_STEPS + 1)], real),
        sign_bits=np.full(8 // real(0.0).itemsize, -0.0, real).view(np.uint64)[0],
        stretch_steps=max(1, int(min(STRETCH_STEPS, _STRETCH_TAUS * stdp_steps, eligibility_steps))),
    )


def neuron_constants(kind: Izhikevich, step_ms: float, real: Any) -> NeuronConstants:
    """Return the constants of one step of one kind of neuron."""
    return NeuronConstants(
        quadratic=real(0.04),
        linear=real(5.0),
        offset=real(140.0),
        half_step=real(0.5 * step_ms),
        limit=real(V_LIMIT_MV),
        pulse=real(1.0 / step_ms),
        peak=real(30.0),
        rate=real(kind.a * step_ms),
        sensitivity=real(kind.b),
        reset_v=real(kind.c),
        reset_u=real(kind.d),
    )


def _noise_amplitude(network: NetworkConfig, populations: tuple[Population, ...], step_ms: float) -> NDArray[Any]:
    """Half width of each neuron's uniform noise; 1/sqrt(step) keeps its power the same at any step length."""
    deviation = {"S": network.sensory_noise, "M": network.motor_noise, "I": network.inhibitory_noise}
    amplitude = np.concatenate([np.full(group.size, deviation[group.name[0]]) for group in populations])
    half_width: NDArray[Any] = (amplitude * _UNIFORM_HALF_WIDTH / np.sqrt(step_ms)).astype(network.precision)
    return half_width
