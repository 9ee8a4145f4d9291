"""The network in plain numpy: whole arrays, preallocated, in place; eligibility and weights of every synapse each ms."""

from __future__ import annotations

from typing import Any

import numpy as np


class Network:
    """State and one step. Weights and eligibilities are (8, 100, 100): projection, sensory and motor neuron."""

    def __init__(self, job: Any) -> None:
        self.job, self.constants = job, job.constants
        self.real = np.dtype(np.float64 if job.record else np.float32)
        neurons = int(job.populations[-1])
        self.v, self.u = np.full(neurons, -65.0, self.real), np.full(neurons, -13.0, self.real)
        self.arriving, self.current = np.zeros(neurons, self.real), np.empty(neurons, self.real)
        self.slope, self.noise = np.empty(neurons, self.real), np.empty(neurons, self.real)
        self.weights = job.weights.astype(self.real)
        self.eligibility, self.change = np.zeros_like(self.weights), np.empty_like(self.weights)
        self.dopamine = np.zeros((len(self.weights), 1, 1), self.real)
        self.split = int(job.populations[8])
        self.trace = np.zeros(self.split, self.real)
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
        self.trace[self.trace < constants["trace_floor"]] = 0
        if not self.job.plastic:
            return
        self.dopamine *= self.real.type(constants["dopamine_decay"])
        self.eligibility *= self.real.type(constants["eligibility_decay"])
        np.multiply(self.eligibility, self.dopamine * self.real.type(constants["learning_rate"]), out=self.change)
        self.weights += self.change
        np.clip(self.weights, 0, self.real.type(constants["weight_max"]), out=self.weights)

    def _deliver(self, fired: Any) -> None:
        """Pass this step's spikes on: sensory ones, then motor ones, then the fixed wiring."""
        constants, starts = self.constants, self.job.populations
        self.arriving[:] = 0
        edges = np.searchsorted(fired, starts)
        potentials: list[Any] = [fired[edges[p] : edges[p + 1]] - starts[p] for p in range(len(starts) - 1)]
        for k, (sensor, motor) in enumerate(self.job.projections):
            pre, into = potentials[sensor], slice(starts[motor], starts[motor + 1])
            if len(pre):
                self.arriving[into] += self.weights[k, pre].sum(axis=0)
                self.eligibility[k, pre] -= self.real.type(constants["depression"]) * self.trace[into]
        self.trace[fired[: edges[4]]] += 1
        for k, (sensor, motor) in enumerate(self.job.projections):
            post = potentials[motor]
            if len(post):
                trace = self.trace[starts[sensor] : starts[sensor + 1], None]
                self.eligibility[k, :, post] += (self.real.type(constants["potentiation"]) * trace).T
        self.trace[fired[edges[4] : edges[8]]] += 1
        counts = np.diff(edges)
        for side in range(4):
            others = counts[8:].sum() - counts[8 + side]
            self.arriving[starts[4 + side] : starts[5 + side]] += constants["inhibitory_to_motor"] * others
            self.arriving[starts[8 + side] : starts[9 + side]] += constants["motor_to_inhibitory"] * counts[4 + side]


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
    return _spikes(steps, neurons, network.weights) if job.record else None


def _spikes(steps: list[Any], neurons: list[Any], weights: Any) -> Any:
    from worker import Spikes

    return Spikes(np.concatenate(steps), np.concatenate(neurons), weights)
