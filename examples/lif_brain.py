"""200 leaky integrate-and-fire neurons in numpy: the robot's cell drives four motor populations, which race.

In examples/: scla-mj rollout ../runs/lif --brain lif_brain:LifBrain --brain.noise 0.3
"""

from dataclasses import dataclass

import numpy as np

from scla_mj import Action, Activity, Anatomy, Brain, Consumer, Decision, Projection, Snapshot, generator, stacked

MOTORS = ("go_up", "go_down", "go_left", "go_right")
TO_MOTORS = tuple(Projection(f"to_{name}", "place", name, (100, 25), weight_range=(0.0, 0.4)) for name in MOTORS)


class LifBrain(Brain):
    """The motor population that spikes most decides; what comes better or worse than expected teaches its synapses."""

    reads = ()
    anatomy = Anatomy(stacked(("place", 100, "sensory"), *((name, 25, "motor") for name in MOTORS)), TO_MOTORS)

    @dataclass(frozen=True)
    class Settings:
        noise: float = 0.3
        rate: float = 0.02

    def __init__(self, checked, settings):
        self.settings, self.steps, self.tau = settings, checked.clock.thinking_steps, 20 / checked.clock.neural_step_ms
        self.rng, (width, height) = generator(checked.config.seed, Consumer.BRAIN), checked.config.grid.cells
        self.cells = np.arange(width * height).reshape(width, height)
        self.cell_of = np.arange(100) % self.cells.size  # by place neuron
        self.v, self.value, self.weights = np.zeros(200), np.zeros(self.cells.size), np.full((4, 100, 25), 0.2)

    def cell(self, percept):
        return self.cells[percept.cell.x - 1, percept.cell.y - 1]

    def decide(self, percept):
        fired, raster, drive = np.zeros(200, bool), [], 2.0 * (self.cell_of == self.cell(percept))
        for _ in range(self.steps):
            current = np.append(drive, self.tau * np.tensordot(fired[:100], self.weights, (0, 1)))
            noise = self.settings.noise * np.sqrt(self.tau) * self.rng.normal(size=200)
            self.v += (current + noise - self.v) / self.tau
            fired = self.v >= 1.0
            self.v[fired] = 0.0
            raster.append(fired)
        self.spikes, counts = np.nonzero(raster), np.sum(raster, axis=0)[100:].reshape(4, 25).sum(axis=1)
        return Decision(Action(self.rng.choice(np.flatnonzero(counts == counts.max()))), None, tuple(counts))

    def learn(self, feedback):
        here, there = self.cell(feedback.before), self.cell(feedback.after)
        self.error = (1.0 if feedback.hit else 0.9 * self.value[there]) - self.value[here]
        self.value[here] += 0.2 * self.error
        change = self.settings.rate * self.error - 0.002 * (feedback.outcome == "blocked")
        taught = feedback.action, self.cell_of == here
        self.weights[taught] = np.clip(self.weights[taught] + change, 0.0, 0.4)

    def activity(self):
        means = self.weights.mean(axis=(1, 2))
        return Activity(*self.spikes, len(self.spikes[0]), self.steps, self.steps, means, np.full(4, self.error))

    def snapshot(self):
        return Snapshot(self.weights.copy())

    def state(self):
        arrays = {name: getattr(self, name).copy() for name in ("v", "value", "weights")}
        return {**arrays, "rng": self.rng.bit_generator.state}

    def restore(self, state):
        self.v, self.value, self.weights = (state[name].copy() for name in ("v", "value", "weights"))
        self.rng.bit_generator.state = state["rng"]
