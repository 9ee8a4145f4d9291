"""200 leaky integrate-and-fire neurons in numpy: the robot's cell drives four motor populations, which race.

In examples/: scla-mj rollout ../runs/lif --brain lif_brain:LifBrain --brain.noise 0.3
"""

from dataclasses import dataclass

import numpy as np

from scla_mj import Action, Activity, Anatomy, Brain, Consumer, Decision, Projection, Snapshot, generator, stacked

TAU_MS, DRIVE, WEIGHT_MAX = 20.0, 2.0, 0.4
MOTORS = ("go_up", "go_down", "go_left", "go_right")


class LifBrain(Brain):
    """The motor population that spikes most decides; what comes better or worse than expected teaches its synapses."""

    reads = ()
    anatomy = Anatomy(
        stacked(("place", 100, "sensory"), *((name, 25, "motor") for name in MOTORS)),
        tuple(Projection(f"to_{name}", "place", name, (100, 25), weight_range=(0.0, WEIGHT_MAX)) for name in MOTORS),
    )

    @dataclass(frozen=True)
    class Settings:
        noise: float = 0.3
        rate: float = 0.02

    def __init__(self, checked, settings):
        self.noise, self.rate, self.steps = settings.noise, settings.rate, checked.clock.thinking_steps
        self.tau, self.rng = TAU_MS / checked.clock.neural_step_ms, generator(checked.config.seed, Consumer.BRAIN)
        self.width, height = checked.config.grid.cells
        self.v, self.value, self.error = np.zeros(200), np.zeros(self.width * height), 0.0
        self.weights = np.full((4, 100, 25), 0.2)

    def neurons_of(self, cell):
        return np.arange(100) % len(self.value) == (cell.x - 1 + self.width * (cell.y - 1))

    def decide(self, percept):
        fired, raster, drive = np.zeros(200, bool), [], DRIVE * self.neurons_of(percept.cell)
        for _ in range(self.steps):
            synaptic = self.tau * np.tensordot(fired[:100], self.weights, (0, 1)).ravel()
            noise = self.noise * np.sqrt(self.tau) * self.rng.normal(size=200)
            self.v += (np.concatenate([drive, synaptic]) + noise - self.v) / self.tau
            fired = self.v >= 1.0
            self.v[fired] = 0.0
            raster.append(np.flatnonzero(fired))
        self.spikes = np.repeat(np.arange(self.steps), [len(row) for row in raster]), np.concatenate(raster)
        counts = np.bincount(self.spikes[1] // 25, minlength=8)[4:]
        return Decision(Action(self.rng.choice(np.flatnonzero(counts == counts.max()))), None, tuple(counts))

    def learn(self, feedback):
        here, after = (self.neurons_of(percept.cell) for percept in (feedback.before, feedback.after))
        (cell,), (next_cell,) = (np.flatnonzero(own[: len(self.value)]) for own in (here, after))
        self.error = (1.0 if feedback.hit else 0.9 * self.value[next_cell]) - self.value[cell]
        self.value[cell] += 0.2 * self.error
        change = self.rate * self.error - 0.002 * (feedback.outcome == "blocked")
        learnt = self.weights[feedback.action, here] + change
        self.weights[feedback.action, here] = np.clip(learnt, 0.0, WEIGHT_MAX)

    def activity(self):
        means, dopamine = self.weights.mean(axis=(1, 2)), np.full(4, self.error)
        return Activity(*self.spikes, len(self.spikes[0]), self.steps, self.steps, means, dopamine)

    def snapshot(self):
        return Snapshot(self.weights.copy())

    def state(self):
        parts = {name: getattr(self, name).copy() for name in ("v", "value", "weights")}
        return {**parts, "rng": self.rng.bit_generator.state}

    def restore(self, state):
        self.v, self.value, self.weights = (state[name].copy() for name in ("v", "value", "weights"))
        self.rng.bit_generator.state = state["rng"]
