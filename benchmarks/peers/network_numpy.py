"""The network in plain numpy: whole arrays, in place; eligibility and weights of every synapse each ms."""

from __future__ import annotations

from typing import Any

import numpy as np


class Network:
    """State and one step. Weights and eligibilities are (8, 100, 100): projection, sensory and motor neuron."""

    def __init__(self, job: Any) -> None:
        self.job, self.constants = job, job.constants
        self.real: Any = np.dtype(np.float64 if job.record else np.float32)
        neurons = int(job.populations[-1])
        self.v, self.u = np.full(neurons, -65.0, self.real), np.full(neurons, -13.0, self.real)
        self.arriving, self.current = np.zeros(neurons, self.real), np.empty(neurons, self.real)
        self.slope, self.noise = np.empty(neurons, self.real), np.empty(neurons, self.real)
        self.weights = job.weights.astype(self.real)
        self.eligibility, self.change = np.zeros_like(self.weights), np.empty_like(self.weights)
        self.dopamine = np.zeros((len(self.weights), 1, 1), self.real)
        self.split = int(job.populations[8])
        self.trace = np.zeros(self.split, self.real)
        self._index(job)
        self.amplitude = job.noise_half_width.astype(self.real)
        excitatory = np.arange(neurons) < self.split
        self.a = np.where(excitatory, 0.02, 0.1).astype(self.real)
        self.reset_u = np.where(excitatory, 8.0, 2.0).astype(self.real)
        self.noisy = bool(job.noise_half_width.any())
        self.rng = np.random.Generator(np.random.SFC64(0))

    def step(self, drive: Any) -> Any:
        """One millisecond; return the neurons that fired, in ascending order."""
        np.add(drive, self.arriving, out=self.current)
        if self.noisy:
            self.rng.random(out=self.noise, dtype=self.real)
            self.noise *= 2
            self.noise -= 1
            self.noise *= self.amplitude
            self.current += self.noise
        for _ in range(2):
            self._half_step()
        self.u += self.a * (self.real.type(0.2) * self.v - self.u)
        fired = np.flatnonzero(self.v >= 30.0)
        self.v[fired] = -65.0
        self.u[fired] += self.reset_u[fired]
        self._decay()
        self._deliver(fired)
        return fired

    def _half_step(self) -> None:
        np.multiply(self.v, self.real.type(0.04), out=self.slope)
        self.slope *= self.v
        self.slope += 5 * self.v
        self.slope += 140
        self.slope -= self.u
        self.slope += self.current
        self.slope *= self.real.type(0.5)
        self.v += self.slope

    def _decay(self) -> None:
        constants = self.constants
        self.trace *= self.real.type(constants["trace_decay"])
        self.trace[self.trace < constants["trace_lower_bound"]] = 0
        if not self.job.plastic:
            return
        self.dopamine *= self.real.type(constants["dopamine_decay"])
        self.eligibility *= self.real.type(constants["eligibility_decay"])
        np.multiply(self.eligibility, self.dopamine * self.real.type(constants["learning_rate"]), out=self.change)
        self.weights += self.change
        np.clip(self.weights, 0, self.real.type(constants["weight_max"]), out=self.weights)

    def _index(self, job: Any) -> None:
        """Tables of who is connected with whom, so that all spikes of a step are delivered in a few operations.

        `rows`, (400, 2): a sensory neuron's two rows of weights; `row_motor`: the motor population of each. `columns`,
        (400, 2): a motor neuron's two projections, `column_sensor`: the sensory population of each.
        """
        sensors, motors = job.projections[:, 0], job.projections[:, 1] - 4
        size = self.weights.shape[1]
        outgoing = np.array([np.flatnonzero(sensors == side) for side in range(4)])
        self.incoming = np.array([np.flatnonzero(motors == side) for side in range(4)])
        self.rows = (outgoing[:, None, :] * size + np.arange(size)[None, :, None]).reshape(4 * size, -1)
        self.row_motor = np.eye(4, dtype=self.real)[motors[outgoing]].repeat(size, axis=0)
        self.row_trace, self.column_trace = motors[outgoing].repeat(size, axis=0), sensors[self.incoming]
        self.size = size
        self.weight_rows, self.eligibility_rows = (a.reshape(-1, size) for a in (self.weights, self.eligibility))

    def _deliver(self, fired: Any) -> None:
        """Pass this step's spikes on: sensory ones, then motor ones, then the fixed wiring."""
        constants, starts, size = self.constants, self.job.populations, self.size
        edges = np.searchsorted(fired, starts)
        sensory, motor = fired[: edges[4]], fired[edges[4] : edges[8]] - starts[4]
        arriving = self.arriving[: self.split].reshape(-1, size)
        self.arriving[:] = 0
        traces = self.trace.reshape(-1, size)
        if len(sensory):
            rows, into = self.rows[sensory].ravel(), self.row_motor[sensory].reshape(-1, 4)
            np.matmul(into.T, self.weight_rows[rows], out=arriving[4:])
            depression = self.real.type(constants["depression"]) * traces[4:]
            self.eligibility_rows[rows] -= depression[self.row_trace[sensory].ravel()]
            self.trace[sensory] += 1
        if len(motor):
            side, column = motor // size, (motor % size).repeat(2)
            potentiation = self.real.type(constants["potentiation"]) * traces[:4]
            self.eligibility[self.incoming[side].ravel(), :, column] += potentiation[self.column_trace[side].ravel()]
            self.trace[motor + starts[4]] += 1
        counts = np.diff(edges)
        arriving[4:] += (constants["inhibitory_to_motor"] * (counts[8:].sum() - counts[8:]))[:, None]
        inhibitory = self.arriving[self.split :].reshape(4, -1)
        inhibitory += (constants["motor_to_inhibitory"] * counts[4:8])[:, None]


def simulate(job: Any, exchange: Any) -> Any:
    """Run the job; see worker.py."""
    network = Network(job)
    steps: list[Any] = []
    neurons: list[Any] = []
    counts = np.zeros(len(job.populations) - 1, np.int64)
    now = 0
    while (stretch := exchange(counts)) is not None:
        drive = stretch[0].astype(network.real)
        network.dopamine += stretch[1].astype(network.real)[:, None, None]
        fired = [network.step(drive) for _ in range(job.chunk_ms)]
        together = np.concatenate(fired)
        counts = np.histogram(together, job.populations)[0]
        if job.record:
            steps.append(np.repeat(np.arange(now, now + job.chunk_ms), [len(spikes) for spikes in fired]))
            neurons.append(together)
        now += job.chunk_ms
    if not job.record:
        return None
    return {"step": np.concatenate(steps), "neuron": np.concatenate(neurons), "weights": network.weights}
