"""A Brian2 network that learns with dopamine to reach the target, in an environment of its own (docs/bridge.md).

    python3 -m venv .brian2 && .brian2/bin/pip install brian2==2.9.0 "numpy<2.4"
    scla-mj rollout runs/brian2 --brain .brian2/bin/python:examples/brian2_brain.py --protocol sensed-start

What the robot perceives, its cell or the direction of the target, makes five neurons fire. They excite four motor
populations, of which the most active one decides. Synapses onto it remember who fired before whom; dopamine, the
difference between what came and what was expected, turns that into weights. The equations of every decision start from
rest, so what has been learnt is the whole state: a run can be resumed.
"""

from dataclasses import dataclass

import brian2 as b2
import numpy as np
from brian2 import Hz, ms

b2.prefs.codegen.target = "numpy"  # for a network this small a compiler costs more than it gains
PER_PLACE, PER_MOTOR = 5, 10
NAMES = ("up", "down", "left", "right")


class Brain:
    """Places and directions to four motors."""

    @dataclass(frozen=True)
    class Settings:
        learning_rate: float = 0.02
        discount: float = 0.9
        noise: float = 0.35
        """Standard deviation of a resting motor neuron's potential; it fires at 1."""

    def __init__(self, run, settings):
        self.run, self.settings = run, settings
        self.places = run.cells[0] * run.cells[1] + len(NAMES)
        sizes = PER_PLACE * self.places, PER_MOTOR * len(NAMES)
        b2.defaultclock.dt = run.step_ms * ms
        self.inputs = b2.PoissonGroup(sizes[0], rates=0 * Hz)
        motors = "dv/dt = -v / (20*ms) + noise * sqrt(2 / (20*ms)) * xi : 1"
        self.motors = b2.NeuronGroup(
            sizes[1], motors, threshold="v > 1", reset="v = 0", method="euler", namespace={"noise": settings.noise}
        )
        self.synapses = b2.Synapses(
            self.inputs,
            self.motors,
            "w : 1\neligibility : 1\ndrecent/dt = -recent / (20*ms) : 1 (event-driven)",
            on_pre="v_post += w\nrecent += 1",
            on_post="eligibility += recent",
        )
        self.synapses.connect()
        self.spikes = b2.SpikeMonitor(self.inputs), b2.SpikeMonitor(self.motors)
        self.network = b2.Network(self.inputs, self.motors, self.synapses, *self.spikes)
        self.network.store()
        self.made, self.values = 0, np.zeros(self.places)
        self.weights = np.full(sizes, 0.12)
        self.anatomy = {
            "populations": [("places", sizes[0], "sensory"), *((name, PER_MOTOR, "motor") for name in NAMES)],
            "projections": [(f"to_{name}", "places", name, (sizes[0], PER_MOTOR)) for name in NAMES],
        }

    def place(self, percept):
        """Return what stands for a percept: the direction of the target if it is sensed, otherwise the cell."""
        x, y = percept.cell
        return percept.sensed if percept.sensed is not None else len(NAMES) + (y - 1) * self.run.cells[0] + x - 1

    def decide(self, percept):
        firing = np.zeros(PER_PLACE * self.places)
        firing[PER_PLACE * self.place(percept) :][:PER_PLACE] = 120
        self.network.restore()
        b2.seed((self.run.seed * 1_000_003 + self.made) % 2**32)  # every decision has noise of its own
        self.inputs.rates = firing * Hz
        self.synapses.w = self.weights.ravel()
        self.network.run(self.run.thinking_ms * ms)
        self.made += 1
        counts = np.asarray(self.spikes[1].count).reshape(len(NAMES), PER_MOTOR).sum(axis=1)
        chosen = np.random.default_rng([self.run.seed, self.made]).permutation(np.flatnonzero(counts == counts.max()))
        return {"action": chosen[0], "motor_spikes": counts.tolist()}

    def learn(self, feedback):
        before, after = self.place(feedback.before), self.place(feedback.after)
        expected = 0.0 if feedback.hit else self.settings.discount * self.values[after]
        self.dopamine = feedback.hit + expected - self.values[before]
        self.values[before] += 0.2 * self.dopamine
        eligibility = np.asarray(self.synapses.eligibility).reshape(self.weights.shape).copy()
        others = np.arange(PER_MOTOR * len(NAMES)) // PER_MOTOR != feedback.executed
        eligibility[:, others] = 0  # what the body did tells whom to credit
        self.weights = (self.weights + self.settings.learning_rate * self.dopamine * eligibility).clip(0, 0.5)

    def activity(self):
        """Return the spikes of the thinking window; while the robot drives, the network does not run."""
        at_ms = np.concatenate([np.asarray(monitor.t / ms) for monitor in self.spikes])
        neuron = np.concatenate([np.asarray(self.spikes[0].i), len(self.inputs) + np.asarray(self.spikes[1].i)])
        order, steps = np.lexsort((neuron, at_ms)), round(self.run.thinking_ms / self.run.step_ms)
        return {
            "spike_step": np.rint(at_ms[order] / self.run.step_ms).astype(np.int32),
            "spike_neuron": neuron[order].astype(np.int32),
            "thinking_spikes": len(neuron),
            "thinking_steps": steps,
            "steps": steps,
            "mean_weights": self.weights.mean(axis=0).reshape(len(NAMES), PER_MOTOR).mean(axis=1),
            "dopamine": np.full(len(NAMES), self.dopamine),
        }

    def snapshot(self):
        by_motor = self.weights.reshape(-1, len(NAMES), PER_MOTOR)
        return {"weights": np.ascontiguousarray(by_motor.transpose(1, 0, 2))}

    def state(self):
        return {"made": self.made, "values": self.values, "weights": self.weights}

    def restore(self, state):
        self.made, self.values, self.weights = state["made"], state["values"], state["weights"]
