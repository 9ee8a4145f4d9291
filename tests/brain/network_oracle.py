"""A dense, readable float64 reference of the network's equations: no laziness, no compilation, one array operation a
line.

It follows docs/model.md and shares with the product only the table of names (anatomy). Eligibility and weights of all
80,000 synapses are updated in every step.
"""

import math
from typing import NamedTuple

import numpy as np

from scla_mj.anatomy import MOTOR, POPULATIONS, PROJECTIONS, SENSORY


class Settings(NamedTuple):
    potentiation: float = 0.1
    depression: float = 0.12
    trace_tau_ms: float = 20.0
    eligibility_tau_ms: float = 1000.0
    dopamine_tau_ms: float = 200.0
    learning_rate: float = 0.05
    weight_max: float = 4.0
    motor_to_inhibitory: float = 1.5
    inhibitory_to_motor: float = -0.625


class DenseNetwork:
    def __init__(self, weights, settings=None):
        self.settings = settings or Settings()
        self.w = weights.copy()
        self.c = np.zeros_like(weights)
        self.d = np.zeros(len(PROJECTIONS))
        self.v = np.full(1000, -65.0)
        self.u = np.full(1000, -13.0)
        self.a = np.where(np.arange(1000) < 800, 0.02, 0.1)
        self.reset = np.where(np.arange(1000) < 800, 8.0, 2.0)
        self.trace = np.zeros(800)
        self.arriving = np.zeros(1000)

    def step(self, drive):
        """One millisecond; returns the neurons that fired."""
        fired = self._integrate(drive + self.arriving)
        self._decay()
        self.arriving = np.zeros(1000)
        self._sensory_spikes(fired)
        self._motor_spikes(fired)
        self._inhibition(fired)
        return np.flatnonzero(fired)

    def _integrate(self, current):
        for _ in range(2):
            self.v = self.v + 0.5 * (0.04 * self.v * self.v + 5.0 * self.v + 140.0 - self.u + current)
        self.u = self.u + self.a * (0.2 * self.v - self.u)
        fired = self.v >= 30.0
        self.v = np.where(fired, -65.0, self.v)
        self.u = np.where(fired, self.u + self.reset, self.u)
        return fired

    def _decay(self):
        s = self.settings
        self.trace = self.trace * math.exp(-1 / s.trace_tau_ms)
        self.trace[self.trace < 1e-13] = 0.0
        self.d = self.d * math.exp(-1 / s.dopamine_tau_ms)
        self.c = self.c * math.exp(-1 / s.eligibility_tau_ms)
        self.w = np.clip(self.w + s.learning_rate * self.c * self.d[:, None, None], 0.0, s.weight_max)

    def _sensory_spikes(self, fired):
        for k, projection in enumerate(PROJECTIONS):
            sensor, motor = SENSORY[projection.sensor], MOTOR[projection.motor]
            pre = fired[sensor.start : sensor.stop]
            self.arriving[motor.start : motor.stop] += self.w[k][pre].sum(axis=0)
            self.c[k][pre] -= self.settings.depression * self.trace[motor.start : motor.stop]
        self.trace[:400] += fired[:400]

    def _motor_spikes(self, fired):
        for k, projection in enumerate(PROJECTIONS):
            sensor, motor = SENSORY[projection.sensor], MOTOR[projection.motor]
            post = fired[motor.start : motor.stop]
            self.c[k][:, post] += self.settings.potentiation * self.trace[sensor.start : sensor.stop, None]
        self.trace[400:] += fired[400:800]

    def _inhibition(self, fired):
        counts = [int(fired[p.start : p.stop].sum()) for p in POPULATIONS]
        for side in range(4):
            motor, inhibitory = POPULATIONS[4 + side], POPULATIONS[8 + side]
            self.arriving[inhibitory.start : inhibitory.stop] += self.settings.motor_to_inhibitory * counts[4 + side]
            others = sum(counts[8:]) - counts[8 + side]
            self.arriving[motor.start : motor.stop] += self.settings.inhibitory_to_motor * others
