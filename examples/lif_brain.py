"""200 leaky integrate-and-fire neurons in numpy: cells drive motors, and a prediction error teaches their synapses.

From this folder: scla-mj rollout runs/lif --brain lif_brain:LifBrain --brain.noise 0.3
"""

from dataclasses import dataclass

import numpy as np

from scla_mj import Action, Activity, Anatomy, Brain, Consumer, Decision, Projection, Snapshot, generator, stacked

MOTORS = ("go_up", "go_down", "go_left", "go_right")


class LifBrain(Brain):
    """The four motor populations race; the one that spikes most decides."""

    reads = ()
    anatomy = Anatomy(
        stacked(("place", 100, "sensory"), *((name, 25, "motor") for name in MOTORS)),
        tuple(Projection(f"to_{name}", "place", name, (100, 25), weight_range=(0.0, 0.4)) for name in MOTORS),
    )

    @dataclass(frozen=True)
    class Settings:
        tau_ms: float = 20.0
        drive: float = 2.0
        noise: float = 0.3
        rate: float = 0.02

    def __init__(self, checked, settings):
        self.set, self.steps, (self.width, height) = settings, checked.clock.thinking_steps, checked.config.grid.cells
        self.rng, self.tau = (
            generator(checked.config.seed, Consumer.BRAIN),
            settings.tau_ms / checked.clock.neural_step_ms,
        )
        self.v, self.value, self.error = np.zeros(200), np.zeros(self.width * height), 0.0
        self.weights = np.full((4, 100, 25), 0.2)

    def place(self, cell):
        return (cell.x - 1 + self.width * (cell.y - 1)) % len(self.value)

    def decide(self, percept):
        here = np.arange(100) % len(self.value) == self.place(percept.cell)
        fired, raster = np.zeros(200, bool), []
        for _ in range(self.steps):
            current = self.set.noise * self.rng.normal(size=200) * np.sqrt(self.tau)
            current[:100] += self.set.drive * here
            current[100:] += self.tau * np.tensordot(fired[:100], self.weights, (0, 1)).ravel()
            self.v += (current - self.v) / self.tau
            fired = self.v >= 1.0
            self.v[fired] = 0.0
            raster.append(np.flatnonzero(fired))
        self.spike_step = np.repeat(np.arange(self.steps), [len(spikes) for spikes in raster])
        self.spike_neuron = np.concatenate(raster)
        counts = np.bincount(self.spike_neuron // 25, minlength=8)[4:]
        return Decision(Action(self.rng.choice(np.flatnonzero(counts == counts.max()))), None, tuple(counts))

    def learn(self, feedback):
        here, after = self.place(feedback.before.cell), self.place(feedback.after.cell)
        self.error = (1.0 if feedback.hit else 0.9 * self.value[after]) - self.value[here]
        self.value[here] += 0.2 * self.error
        change = self.set.rate * self.error - 0.002 * (feedback.outcome == "blocked")
        row = self.weights[feedback.action, here :: len(self.value)]
        np.clip(row + change, 0.0, 0.4, out=row)

    def activity(self):
        means, errors = self.weights.mean(axis=(1, 2)), np.full(4, self.error)
        return Activity(self.spike_step, self.spike_neuron, len(self.spike_step), self.steps, self.steps, means, errors)

    def snapshot(self):
        return Snapshot(self.weights.copy())

    def state(self):
        arrays = {name: getattr(self, name).copy() for name in ("v", "value", "weights")}
        return {**arrays, "rng": self.rng.bit_generator.state}

    def restore(self, state):
        self.v, self.value, self.weights = (state[name].copy() for name in ("v", "value", "weights"))
        self.rng.bit_generator.state = state["rng"]
