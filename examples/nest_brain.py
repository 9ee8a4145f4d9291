"""A NEST network that learns with dopamine to reach the target, in an environment of its own (docs/bridge.md).

    python3 -m venv .nest && .nest/bin/pip install nest-simulator==3.10.0 "numpy<2.4"
    scla-mj rollout runs/nest --brain .nest/bin/python:examples/nest_brain.py --protocol sensed-start

What the robot perceives, its cell or the direction of the target, makes five neurons fire. They excite four motor
populations through `stdp_dopamine_synapse`; the most active one decides, and then fires alone for a moment, so that its
synapses remember it. Dopamine neurons fire at their baseline, more after a hit and less after any other move. NEST
keeps traces, queues and generators of its own that cannot be read back: such a run is seeded, but cannot be resumed.
"""

from dataclasses import dataclass

import nest
import numpy as np

PER_PLACE, PER_MOTOR, DOPAMINE_NEURONS = 5, 10, 5
NAMES = ("up", "down", "left", "right")
BASELINE_HZ = 20.0


class Brain:
    """Places and directions to four motors."""

    @dataclass(frozen=True)
    class Settings:
        learning_rate: float = 0.001
        noise_hz: float = 400.0
        """Of the Poisson spikes that each motor neuron gets beside the places'."""

    def __init__(self, run, settings):
        self.run, self.made = run, 0
        self.places = run.cells[0] * run.cells[1] + len(NAMES)
        nest.verbosity = nest.VerbosityLevel.ERROR
        nest.ResetKernel()
        nest.set(resolution=run.step_ms, rng_seed=run.seed % (2**32 - 1) + 1)
        self.generators = nest.Create("poisson_generator", self.places)
        self.inputs = nest.Create("parrot_neuron", PER_PLACE * self.places)
        self.motors = nest.Create("iaf_psc_delta", PER_MOTOR * len(NAMES), {"tau_m": 20.0, "t_ref": 2.0})
        noise = nest.Create("poisson_generator", params={"rate": settings.noise_hz})
        self.reward = nest.Create("poisson_generator", params={"rate": BASELINE_HZ})
        dopamine = nest.Create("parrot_neuron", DOPAMINE_NEURONS)
        transmitter = nest.Create("volume_transmitter", params={"deliver_interval": 10})
        self.efference = nest.Create("dc_generator", len(NAMES))
        self.recorder = nest.Create("spike_recorder")
        for place in range(self.places):
            nest.Connect(self.generators[place], self.inputs[PER_PLACE * place : PER_PLACE * (place + 1)])
        for number, current in enumerate(self.efference):
            nest.Connect(current, self.motors[PER_MOTOR * number : PER_MOTOR * (number + 1)])
        nest.Connect(noise, self.motors, syn_spec={"weight": 1.0})
        nest.Connect(self.reward, dopamine)
        nest.Connect(dopamine, transmitter)
        # The baseline's mean concentration changes nothing: below it weights turn round.
        tau_n, rate = 50.0, BASELINE_HZ * DOPAMINE_NEURONS / 1000.0
        learning = {"A_plus": settings.learning_rate, "A_minus": 0.0, "tau_c": 50.0, "tau_n": tau_n, "b": rate}
        bounds = {"Wmin": 0.0, "Wmax": 2.0, "volume_transmitter": transmitter}
        nest.CopyModel("stdp_dopamine_synapse", "learning", learning | bounds)
        nest.Connect(self.inputs, self.motors, syn_spec={"synapse_model": "learning", "weight": 0.6, "delay": 1.0})
        nest.Connect(self.inputs, self.recorder)
        nest.Connect(self.motors, self.recorder)
        self.synapses = nest.GetConnections(self.inputs, self.motors)
        ends = np.array(self.synapses.get("source")), np.array(self.synapses.get("target"))
        self.order = np.lexsort((ends[0], (ends[1] - self.motors[0].global_id) // PER_MOTOR))
        self.anatomy = {
            "populations": [("places", len(self.inputs), "sensory"), *((name, PER_MOTOR, "motor") for name in NAMES)],
            "projections": [(f"to_{name}", "places", name, (len(self.inputs), PER_MOTOR)) for name in NAMES],
        }

    def decide(self, percept):
        (x, y), sensed = percept.cell, percept.sensed
        place = sensed if sensed is not None else len(NAMES) + (y - 1) * self.run.cells[0] + x - 1
        self.generators[place].rate = 120.0
        self.recorder.n_events = 0
        self.began_ms = nest.biological_time
        nest.Simulate(self.run.thinking_ms)
        self.place, self.made = place, self.made + 1
        self.events = self.recorder.events
        motor = (self.events["senders"] - self.motors[0].global_id) // PER_MOTOR
        counts = np.bincount(motor[motor >= 0], minlength=len(NAMES))
        chosen = np.random.default_rng([self.run.seed, self.made]).permutation(np.flatnonzero(counts == counts.max()))
        return {"action": chosen[0], "motor_spikes": counts.tolist()}

    def learn(self, feedback):
        self.efference.amplitude = [400.0 if number == feedback.executed else -400.0 for number in range(len(NAMES))]
        nest.Simulate(20.0)
        self.efference.amplitude = 0.0
        self.generators[self.place].rate = 0.0
        self.reward.rate = 10 * BASELINE_HZ if feedback.hit else 0.5 * BASELINE_HZ
        nest.Simulate(50.0)
        self.reward.rate = BASELINE_HZ
        nest.Simulate(150.0)  # what is eligible is forgotten before the next decision

    def weights(self):
        """Return the weights by projection, (4, places, motor neurons)."""
        found = np.array(self.synapses.get("weight"))[self.order]
        return found.reshape(len(NAMES), len(self.inputs), PER_MOTOR)

    def activity(self):
        """Return the spikes of the thinking window."""
        first = self.inputs[0].global_id
        motor = self.events["senders"] - self.motors[0].global_id
        neuron = np.where(motor >= 0, len(self.inputs) + motor, self.events["senders"] - first)
        step = np.rint((self.events["times"] - self.began_ms) / self.run.step_ms).astype(np.int32) - 1
        order, steps = np.lexsort((neuron, step)), round(self.run.thinking_ms / self.run.step_ms)
        return {
            "spike_step": step[order],
            "spike_neuron": neuron[order].astype(np.int32),
            "thinking_spikes": len(neuron),
            "thinking_steps": steps,
            "steps": steps,
            "mean_weights": self.weights().mean(axis=(1, 2)),
        }

    def snapshot(self):
        return {"weights": self.weights()}
