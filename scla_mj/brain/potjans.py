"""The spiking actor-critic of Potjans, Morrison and Diesmann, on the general network: one dopamine teaches all of it.

Potjans, Morrison and Diesmann 2009, Neural Computation 21, 301-339; Potjans, Diesmann and Morrison 2011, PLoS
Computational Biology 7, e1001133. Theirs: a cluster of neurons for each state, driven while the agent is there; four
actors, of which the first to fire decides, whereupon all four are inhibited; a critic whose rate is the state's value;
the error of that value, reward included, as the third factor of the synapses from the clusters to critic and actors.

Only the papers' abstracts and their environment's published source could be read. So ours are: every number; the
plasticity rule; that nothing is driven between a hit and the next start, so that a hit ends the episode as it does for
`ActorCriticBrain`; and that the dopamine cells are not simulated: the program compares the critic's rates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, Final

import numpy as np
from annotated_types import Interval
from numpy.typing import NDArray

from scla_mj.anatomy import MOTOR_ROLE, SENSORY_ROLE, Anatomy, Projection, stacked
from scla_mj.brain.base import Brain
from scla_mj.brain.network.description import Modulator, NetworkDescription, Neurons, Synapses
from scla_mj.brain.network.general import GeneralNetwork
from scla_mj.brain.network.models import LIF
from scla_mj.brain.network.rules import Rule
from scla_mj.checked import CheckedConfig
from scla_mj.config import Fraction
from scla_mj.grid import ACTIONS, Cell
from scla_mj.randomness import Consumer, generator
from scla_mj.signals import Activity, Decision, Feedback, Outcome, Percept, Snapshot
from scla_mj.validation import Section

STATE: Final = "state"
CRITIC: Final = "critic"
ACTORS: Final = tuple(f"actor_{action.label}" for action in ACTIONS)
CELL: Final = LIF()
"""A neuron of a cluster or of the critic."""
ACTOR: Final = LIF(tau_ms=10.0)
# Currents. A cluster whose neurons all fire at their rate depolarises its targets by a mean of "input" mV.
_STATE_DRIVE: Final = 60.0
_SUPPRESSION: Final = -70.0
_NOISE: Final = 20.0
_ACTOR_INPUT: Final = 30.0
_ACTOR_RANGE: Final = (10.0, 70.0)
# Time constants, ms. The slow trace and the critic's eligibility are long against `_ONSET_MS` and the window, so that a
# cell that was just entered has little of the eligibility of the one that was left.
_FAST_MS: Final = 20.0
_SLOW_MS: Final = 300.0
_ELIGIBILITY_MS: Final = 300.0
_DOPAMINE_MS: Final = 10.0
_ONSET_MS: Final = 15.0
"""From the crossing until the critic follows the new cluster."""
_BEFORE_MS: Final = 50.0
"""Silence before the first decision, in which the actors are suppressed as before every other."""
_ACTOR_WAIT: Final = 0.2
"""What is left of an actor's eligibility, some 0.5 s after its spike, when dopamine comes."""


class PotjansBrain(Brain):
    """A spiking actor-critic: error = reward + discount x value of the cell entered - value of the cell left.

    While the robot thinks, its cell's cluster fires and the four actors race; the first to fire decides (a tie of one
    step is broken by chance, and so is a race that nobody wins), and a current then keeps all four silent. Its cluster
    fires on until the axle crosses into the next cell, or for half the drive of a move without a crossing. The critic's
    rate up to there is the value left, its rate in a window soon after it the value entered, 0 after a hit. The error
    is released as dopamine at once. Neuron i of cell (x, y) is neuron ((x - 1) H + y - 1) n + i of the population
    `state`, H cells in a column, n neurons in a cluster.

    Synapses onto the critic become eligible by their cluster's spikes alone, onto an actor by its spike.

    Attributes:
        network: populations `state`, `actor_up` ... `actor_right`, `critic`.
        values: value left and value entered, as the critic's rate had them in the last move.
        error: of the last move; 0 for one that failed.
    """

    reads = ()

    @dataclass(frozen=True)
    class Settings(Section):
        """Chosen on seeds 100 to 105, without a body, which the report does not use."""

        discount: Fraction = 0.8
        """gamma. Nearer to 1 a detour costs too little of the value to be noticed in the noise of rates."""
        critic_rate: Annotated[float, Interval(ge=0.0, le=10.0)] = 0.4
        """alpha, of values, nominal: for a cell that was occupied for long and a linear rate."""
        actor_rate: Annotated[float, Interval(ge=0.0, le=1000.0)] = 25.0
        """beta, mV of an actor's mean input per unit of error, nominal."""
        initial_value: Fraction = 0.6
        """Value of every cell at the start: optimistic, so that what was tried in vain is tried less."""
        release: Annotated[float, Interval(ge=0.0, le=10.0)] = 1.0
        """Dopamine per unit of error; at 0 nothing ever changes."""
        clip_dips: bool = False
        """Whether a negative error releases nothing, as if dopamine cells could not fire less than at rest."""
        value_rate_hz: Annotated[float, Interval(ge=10.0, le=400.0)] = 100.0
        """The critic's rate that is a value of 1."""
        window_ms: Annotated[float, Interval(ge=1.0, le=200.0)] = 50.0
        """How long the critic is listened to in the cell entered."""
        actor_noise: Annotated[float, Interval(ge=0.0, le=1000.0)] = 15.0
        """Standard deviation of the current into the actors, anew in every step: it makes them explore."""
        state_neurons: Annotated[int, Interval(ge=1, le=50)] = 20
        """Neurons in the cluster of a cell."""
        critic_neurons: Annotated[int, Interval(ge=1, le=50)] = 5
        """Neurons of the critic."""

    def __init__(self, checked: CheckedConfig, settings: Settings) -> None:
        self._settings, self._clock = settings, checked.clock
        self._cells = checked.config.grid.cells
        clusters = self._cells[0] * self._cells[1]
        description = describe(settings, clusters, self._clock.neural_step_ms)
        self.network = GeneralNetwork(description, seed=checked.config.seed)
        self.anatomy = _anatomy(settings, clusters)
        self._ties = generator(checked.config.seed, Consumer.TIES)
        self._nowhere = np.zeros(description.size, np.float32)
        self._actors = slice(self.network.populations[1].start, self.network.populations[-2].stop)
        self._counts = self._thinking_counts = self.network.advance(self._steps(_BEFORE_MS), self._quiet(self._nowhere))
        self._thinking_spikes = self._driven_steps = 0
        self.values = (0.0, 0.0)
        self.error = 0.0

    def decide(self, percept: Percept) -> Decision:
        """Let the actors race; the first to fire decides, and all are silent from then on."""
        drive, steps, passed = self._drive(percept.cell), self._clock.thinking_steps, 0
        first = np.zeros(0, np.int64)
        while passed < steps and not first.size:
            counts = self.network.advance(1, drive, extend=passed > 0)
            first, passed = np.flatnonzero(counts[1:-1]), passed + 1
        self._counts = self.network.advance(steps - passed, self._quiet(drive), extend=True)
        self._thinking_counts = self._counts
        self._thinking_spikes, self._driven_steps = self.network.spike_count, 0
        up, down, left, right = self._counts[1:-1].tolist()
        chosen = first[0] if first.size == 1 else self._ties.choice(first if first.size else len(ACTIONS))
        return Decision(ACTIONS[int(chosen)], None, (up, down, left, right))

    def elapse(self, duration_s: float) -> None:
        """Note how long the drive took; its neural time passes in `learn`."""
        self._driven_steps = self._steps(1000.0 * duration_s)

    def learn(self, feedback: Feedback) -> None:
        """Let the drive's time pass, and release the error after the crossing; none after a move that failed."""
        driven, self.error = self._driven_steps, 0.0
        if feedback.outcome is Outcome.FAILED:
            self._advance(driven, self._nowhere)
            return
        crossed = driven // 2 if feedback.crossed_s is None else self._steps(1000.0 * feedback.crossed_s)
        crossing = min(driven, crossed)
        onset = min(self._steps(_ONSET_MS), driven - crossing)
        window = min(self._steps(self._settings.window_ms), driven - crossing - onset)
        entered = self._nowhere if feedback.hit else self._drive(feedback.after.cell)
        left = self._value(crossing, self._drive(feedback.before.cell))
        self._advance(onset, entered)
        self.values = left, self._value(window, entered)
        if crossing and window:
            self._release(float(feedback.hit))
        self._advance(driven - crossing - onset - window, entered)

    def activity(self) -> Activity:
        """Return the spikes of the thinking window and of the drive, mean weights and dopamine."""
        return self.network.activity(self._clock.thinking_steps, self._thinking_spikes, self._thinking_counts)

    def snapshot(self) -> Snapshot:
        """Return copies of the weights, by projection, and the value of each cell: the critic's rate without noise."""
        weights = {p.name: self.network.weights(p.name) for p in self.network.description.plastic}
        per_ms = rate_hz(_STATE_DRIVE) / 1000.0
        currents = weights[f"{STATE}to{CRITIC}"].mean(axis=1).reshape(*self._cells, -1).sum(axis=2) * per_ms
        values = np.vectorize(rate_hz, otypes=[float])(currents) / self._settings.value_rate_hz
        return Snapshot(weights, values=values)

    def state(self) -> dict[str, Any]:
        """Return the network's state and that of the generator for ties."""
        return {"network": self.network.state(), "ties": self._ties.bit_generator.state}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`."""
        self.network.restore(state["network"])
        self._ties.bit_generator.state = state["ties"]

    def _release(self, reward: float) -> None:
        left, entered = self.values
        self.error = reward + self._settings.discount * entered - left
        heard = max(0.0, self.error) if self._settings.clip_dips else self.error
        self.network.release(self._settings.release * heard)

    def _value(self, steps: int, drive: NDArray[np.float32]) -> float:
        """Return the value that the critic's rate over the next steps expresses."""
        before = self._counts[-1]
        self._advance(steps, drive)
        spikes = float(self._counts[-1] - before) / self._settings.critic_neurons
        seconds = max(steps, 1) * self._clock.neural_step_ms / 1000.0
        return spikes / seconds / self._settings.value_rate_hz

    def _advance(self, steps: int, drive: NDArray[np.float32]) -> None:
        self._counts = self.network.advance(steps, self._quiet(drive), extend=True)

    def _steps(self, duration_ms: float) -> int:
        return round(duration_ms / self._clock.neural_step_ms)

    def _drive(self, cell: Cell) -> NDArray[np.float32]:
        """Return the current into every neuron while the robot is in a cell."""
        drive = self._nowhere.copy()
        first = ((cell.x - 1) * self._cells[1] + cell.y - 1) * self._settings.state_neurons
        drive[first : first + self._settings.state_neurons] = _STATE_DRIVE
        return drive

    def _quiet(self, drive: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the drive with the actors suppressed."""
        quiet = drive.copy()
        quiet[self._actors] = _SUPPRESSION
        return quiet


def describe(settings: PotjansBrain.Settings, clusters: int, step_ms: float) -> NetworkDescription:
    """Return the network for so many cells.

    The rules' rates follow from the nominal ones in closed form. A synapse's eligibility is 1 after long firing of its
    cluster (critic) or at an actor's spike; a release D at an eligibility c then moves a weight by rate c D tau, where
    1 / tau = 1 / tau_dopamine + 1 / tau_eligibility.
    """
    per_ms = rate_hz(_STATE_DRIVE) / 1000.0
    weight = 1.0 / (settings.state_neurons * per_ms)
    dose = step_ms / (_DOPAMINE_MS / (1.0 + _DOPAMINE_MS / _ELIGIBILITY_MS))
    waited = math.exp(-(_ONSET_MS + settings.window_ms) / _ELIGIBILITY_MS)
    most = 2.0 * current_at(settings.value_rate_hz)
    per_value = current_at(settings.value_rate_hz) - current_at(0.0)
    initial = current_at(settings.initial_value * settings.value_rate_hz)
    low, high = (weight * value for value in _ACTOR_RANGE)
    critic = _rule(
        before=1.0 / (per_ms**2 * _SLOW_MS * _ELIGIBILITY_MS),
        rate=settings.critic_rate * per_value * weight * dose / waited,
        high=most * weight,
    )
    rate = settings.actor_rate * weight * dose / _ACTOR_WAIT
    actor = _rule(after=1.0 / (per_ms * _FAST_MS), rate=rate, low=low, high=high)
    return NetworkDescription(
        [
            Neurons(STATE, clusters * settings.state_neurons, CELL, _NOISE),
            *(Neurons(name, 1, ACTOR, settings.actor_noise) for name in ACTORS),
            Neurons(CRITIC, settings.critic_neurons, CELL, _NOISE),
        ],
        [
            *(Synapses(STATE, name, _ACTOR_INPUT * weight, rule=actor) for name in ACTORS),
            Synapses(STATE, CRITIC, initial * weight, rule=critic),
        ],
        [Modulator("dopamine", _DOPAMINE_MS)],
        step_ms=step_ms,
    )


def rate_hz(current: float, model: LIF = CELL) -> float:
    """Return the rate at which a neuron without noise fires under a constant current."""
    ratio = model.resistance * current / (model.threshold_mv - model.rest_mv)
    if ratio <= 1.0:
        return 0.0
    return 1000.0 / (model.refractory_ms + model.tau_ms * math.log(ratio / (ratio - 1.0)))


def current_at(rate_hz: float, model: LIF = CELL) -> float:
    """Return the constant current under which a neuron without noise fires at a rate; at 0 Hz the greatest such."""
    charging_ms = 1000.0 / rate_hz - model.refractory_ms if rate_hz else math.inf
    reached = 1.0 - math.exp(-charging_ms / model.tau_ms)
    return (model.threshold_mv - model.rest_mv) / (model.resistance * reached)


def _anatomy(settings: PotjansBrain.Settings, clusters: int) -> Anatomy:
    neurons, critics = clusters * settings.state_neurons, settings.critic_neurons
    populations = stacked(
        (STATE, neurons, SENSORY_ROLE), *((name, 1, MOTOR_ROLE) for name in ACTORS), (CRITIC, critics, CRITIC)
    )
    sizes = {**dict.fromkeys(ACTORS, 1), CRITIC: critics}
    projections = (Projection(f"{STATE}to{name}", STATE, name, (neurons, size)) for name, size in sizes.items())
    return Anatomy(populations, tuple(projections))


def _rule(*, rate: float, high: float, low: float = 0.0, before: float = 0.0, after: float = 0.0) -> Rule:
    parameters = {"before": before, "after": after, "rate": rate}
    taus = (_FAST_MS, _SLOW_MS), (_FAST_MS,), _ELIGIBILITY_MS
    return Rule(_mark_before, _mark_after, _follow, parameters, *taus, low, high)


def _mark_before(w: Any, c: Any, x: Any, y: Any, p: Any) -> Any:
    return w, c + p.before * x[1]


def _mark_after(w: Any, c: Any, x: Any, y: Any, p: Any) -> Any:
    return w, c + p.after * x[0]


def _follow(w: Any, dose: Any, p: Any) -> Any:
    return w + p.rate * dose
