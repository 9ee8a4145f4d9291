"""The network in plain numpy, one array operation per line: readable, slow, the place to try a learning rule.

`DenseNetwork` computes what `Network` computes, from the same seeds: in float64 the same spikes, and weights within
1e-12 (tested). It updates all 80,000 synapses in every step and so takes some 50 times as long. Its learning rule is an
object, `PairSTDP` unless another is given.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import INHIBITORY, MOTOR, NEURON_COUNT, PROJECTIONS, SENSORY
from scla_mj.brain.network.network import Network, read_only
from scla_mj.brain.network.neurons import NOT_FINITE
from scla_mj.brain.network.parameters import FAST_SPIKING, REGULAR_SPIKING, V_LIMIT_MV
from scla_mj.config import NetworkConfig, PlasticityConfig
from scla_mj.errors import SclaError

_SHAPE = (len(PROJECTIONS), SENSORY[0].size, MOTOR[0].size)


class PairSTDP:
    """The paper's learning rule: pair-based STDP marks synapses, dopamine changes them (equations 3 and 4).

    For a rule of your own derive a class and override what differs. `weights`, (8, 100, 100), mV, is indexed by
    projection, presynaptic (sensory) and postsynaptic (motor) neuron; a rule changes it in place, and the network clips
    it to 0..weight_max. Every numpy array that is an attribute of the rule is saved and restored with the network.

    Attributes:
        eligibility: the trace c of every synapse, (8, 100, 100).
        pre, post: the traces of past spikes, x and y, of each projection's neurons, (8, 100).
    """

    def __init__(self, plasticity: PlasticityConfig = PlasticityConfig(), *, neural_step_ms: float = 1.0) -> None:
        self.eligibility = np.zeros(_SHAPE)
        self.pre, self.post = np.zeros(_SHAPE[:2]), np.zeros((_SHAPE[0], _SHAPE[2]))
        self.potentiation, self.depression = plasticity.stdp_potentiation, plasticity.stdp_depression
        self.rate = plasticity.learning_rate_per_ms * neural_step_ms
        self.trace_decay = math.exp(-neural_step_ms / plasticity.stdp_tau_ms)
        self.eligibility_decay = math.exp(-neural_step_ms / plasticity.eligibility_tau_ms)

    def update(self, weights: NDArray[Any], dopamine: NDArray[np.float64]) -> None:
        """Advance by one step, before its spikes: traces decay, weights change by eligibility times dopamine, (8,)."""
        self.pre *= self.trace_decay
        self.post *= self.trace_decay
        self.eligibility *= self.eligibility_decay
        if dopamine.any():
            weights += (self.rate * dopamine)[:, np.newaxis, np.newaxis] * self.eligibility

    def on_presynaptic(self, weights: NDArray[Any], k: int, i: NDArray[np.intp]) -> None:
        """Sensory neurons `i` of projection `k` fired (their spikes are delivered): depress their eligibility."""
        self.eligibility[k, i] -= self.depression * self.post[k]
        self.pre[k, i] += 1.0

    def on_postsynaptic(self, weights: NDArray[Any], k: int, j: NDArray[np.intp]) -> None:
        """Motor neurons `j` of projection `k` fired, after all presynaptic spikes: potentiate their eligibility."""
        self.eligibility[k][:, j] += self.potentiation * self.pre[k][:, np.newaxis]
        self.post[k, j] += 1.0


class DenseNetwork(Network):
    """A `Network` of 1000 neurons whose learning rule can be exchanged; everything else is as there.

    Args:
        rule: a class such as `PairSTDP`, which is called with `plasticity` and `neural_step_ms`; the attribute `rule`
            is what it returned.
    """

    def __init__(
        self,
        network: NetworkConfig = NetworkConfig(),
        plasticity: PlasticityConfig = PlasticityConfig(),
        *,
        neural_step_ms: float = 1.0,
        seed: int = 0,
        rule: Callable[..., PairSTDP] = PairSTDP,
    ) -> None:
        if network.neurons != NEURON_COUNT:
            raise SclaError(f"a DenseNetwork has {NEURON_COUNT} neurons: leave --network.neurons out")
        super().__init__(network, plasticity, neural_step_ms=neural_step_ms, seed=seed)
        self.watched = ()
        self.rule = rule(plasticity, neural_step_ms=float(neural_step_ms))
        self._config, self._step_ms = network, neural_step_ms
        self._dopamine_decay = math.exp(-neural_step_ms / plasticity.dopamine_tau_ms)
        cells = [dataclasses.astuple(cell) for cell in (REGULAR_SPIKING, FAST_SPIKING)]
        self._a, self._b, self._c, self._d = np.repeat(np.array(cells, self._real), (800, 200), axis=0).T

    @property
    def eligibility(self) -> NDArray[Any]:
        """The rule's `eligibility`, (8, 100, 100); a read-only copy."""
        return read_only(self.rule.eligibility.copy())

    def state(self) -> dict[str, Any]:
        """Return copies of all that changes, the rule's arrays too."""
        rule = {name: value.copy() for name, value in vars(self.rule).items() if isinstance(value, np.ndarray)}
        return super().state() | {"rule": rule}

    def _put_back(self, state: dict[str, Any]) -> None:
        super()._put_back(state)
        for name, value in state["rule"].items():
            getattr(self.rule, name)[:] = value

    def _run(self, steps: int, drive: NDArray[Any], released: NDArray[np.float64]) -> int:
        self.arrays.dopamine[:] += released
        self.arrays.dosed[:] += steps  # its mean weights are no longer those of the last look
        filled = self.spike_count
        for step in range(self._window_steps, self._window_steps + steps):
            fired = self._step(drive)
            self._spike_step[filled : filled + len(fired)] = step
            self._spike_neuron[filled : filled + len(fired)] = fired
            filled += len(fired)
        return filled if np.isfinite((self.arrays.v, self.arrays.u)).all() else NOT_FINITE

    def _step(self, drive: NDArray[Any]) -> NDArray[np.intp]:
        """The order of the work in one step (docs/model.md): return the neurons that fired."""
        dopamine, weights = self.arrays.dopamine, self.arrays.weight
        with np.errstate(over="ignore", invalid="ignore"):  # `_run` reports it
            fired = self._integrate(drive)
        dopamine *= self._dopamine_decay
        dopamine[np.abs(dopamine) < self.parameters.plasticity.lower_bound] = 0.0
        self.rule.update(weights, dopamine)
        np.clip(weights, 0.0, self._config.weight_max, out=weights)
        self._deliver(fired)
        return np.flatnonzero(fired)

    def _integrate(self, drive: NDArray[Any]) -> NDArray[np.bool_]:
        """Equations 1 and 2: v in two half steps with the old u, then u from the new v; return who fired, (1000,)."""
        v, u, h = self.arrays.v, self.arrays.u, self._step_ms
        noise = self.parameters.noise_amplitude * self._uniform()
        current = drive + (1.0 / h) * self.arrays.synaptic + noise
        v += 0.5 * h * (0.04 * v * v + 5.0 * v + 140.0 - u + current)
        np.clip(v, -V_LIMIT_MV, V_LIMIT_MV, out=v)
        v += 0.5 * h * (0.04 * v * v + 5.0 * v + 140.0 - u + current)
        u += self._a * h * (self._b * v - u)
        fired: NDArray[np.bool_] = v >= 30.0
        v[fired] = self._c[fired]
        u[fired] += self._d[fired]
        return fired

    def _uniform(self) -> NDArray[Any]:
        """Draw a number on [-1, 1) for every neuron from its own generator, xoroshiro64*."""
        s0 = self.arrays.noise_low.copy()
        s1 = self.arrays.noise_high ^ s0
        self.arrays.noise_low[:] = (s0 << 26 | s0 >> 6) ^ s1 ^ (s1 << 9)
        self.arrays.noise_high[:] = s1 << 13 | s1 >> 19
        return 2.0**-31 * (s0 * np.uint32(0x9E3779BB)).view(np.int32).astype(self._real)

    def _deliver(self, fired: NDArray[np.bool_]) -> None:
        """Pass the spikes on: their currents arrive in the next step."""
        weights, arriving = self.arrays.weight, self.arrays.synaptic
        arriving[:] = 0.0
        for k, projection in enumerate(PROJECTIONS):
            sensor, motor = SENSORY[projection.sensor], MOTOR[projection.motor]
            i = np.flatnonzero(fired[sensor.start : sensor.stop])
            arriving[motor.start : motor.stop] += weights[k, i].sum(axis=0)
            self.rule.on_presynaptic(weights, k, i)
        for k, projection in enumerate(PROJECTIONS):
            motor = MOTOR[projection.motor]
            self.rule.on_postsynaptic(weights, k, np.flatnonzero(fired[motor.start : motor.stop]))
        counts = np.array([fired[p.start : p.stop].sum() for p in self.populations])
        motors, inhibitory = counts[4:8], counts[8:12]
        arriving[MOTOR[0].start : MOTOR[-1].stop] += np.repeat(
            self._config.inhibitory_to_motor * (inhibitory.sum() - inhibitory), MOTOR[0].size
        )
        arriving[INHIBITORY[0].start :] += np.repeat(self._config.motor_to_inhibitory * motors, INHIBITORY[0].size)
        self._counts += counts
