"""SCLA as printed: a learning automaton in every cell advises the spiking network, which decides each move."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scla_mj.anatomy import MOTOR, PROJECTIONS, SENSORY, Anatomy, Population, paper_anatomy
from scla_mj.brain.automata import LearningAutomata
from scla_mj.brain.base import Brain
from scla_mj.brain.network.general import GeneralNetwork
from scla_mj.brain.network.network import Network
from scla_mj.brain.network.paper import paper_description
from scla_mj.brain.reinforcement import Reinforcement
from scla_mj.checked import CheckedConfig, is_papers
from scla_mj.config import Precision
from scla_mj.grid import ACTIONS, Action
from scla_mj.randomness import Consumer, generator
from scla_mj.signals import Activity, Decision, Feedback, Outcome, Percept, Snapshot


class SclaBrain(Brain):
    """The paper's algorithm, scla-printed (docs/model.md).

    One clock: the network runs while the robot thinks and while it drives.

    Attributes:
        network: the spiking network; its weights can be read and set.
        automata: the learning automata; their action probabilities can be read and set.
        projections: the plastic ones, the paper's eight first.
        states: what the local rule knows about every cell.
    """

    def __init__(self, checked: CheckedConfig) -> None:
        config, clock = checked.config, checked.clock
        self._config = config
        self._clock = clock
        self.network = self.build_network(checked)
        papers = paper_anatomy(config.network.neurons, config.network.weight_max)
        own = self.network.anatomy.projections if isinstance(self.network, GeneralNetwork) else ()
        self.projections = (*papers.projections, *own[len(PROJECTIONS) :])
        self.anatomy = Anatomy(papers.populations, self.projections, self.network.watched)
        populations = self.network.populations
        self.sensory, self.motor, self.neurons = populations[0:4], populations[4:8], populations[-1].stop
        cells = config.grid.cells
        self.automata = LearningAutomata(cells, config.automaton, rng=generator(config.seed, Consumer.BRAIN))
        self._reinforcement = Reinforcement(self.automata, config.automaton)
        self.states = self._reinforcement.states
        self._ties = generator(config.seed, Consumer.TIES)
        self._sensory_drive = _drives(
            self.sensory, self.neurons, config.network.sensory_drive, config.network.precision
        )
        self._advice_drive = _drives(self.motor, self.neurons, config.network.advice_drive, config.network.precision)
        release = config.plasticity.dopamine_release
        self._taught = {side: release * _taught_by(side) for side in Action}
        plastic = len(self.projections)
        self._scalar = {hit: np.full(plastic, release if hit else -release) for hit in (True, False)}
        self._delay_steps = round(config.plasticity.dopamine_delay_s * 1000.0 / clock.neural_step_ms)
        self._thinking_counts, self._thinking_spikes = self.network.advance(0), 0

    def build_network(self, checked: CheckedConfig) -> Network | GeneralNetwork:
        """Return the network of this brain. Override it for a network, or a learning rule (dense.py), of your own.

        The paper's own has a kernel of its own; with other types of neurons or time constants it is a described one.
        """
        config, step_ms = checked.config, checked.clock.neural_step_ms
        if not is_papers(config.network, config.plasticity):
            return GeneralNetwork(paper_description(config), seed=config.seed)
        return Network(config.network, config.plasticity, neural_step_ms=step_ms, seed=config.seed)

    def decide(self, percept: Percept) -> Decision:
        """Drive the sensed direction's population, or the motors that the automaton advises; most spikes win."""
        advised = None if percept.sensed is not None else self.automata.draw(percept.cell)
        drive = self._sensory_drive[percept.sensed] if advised is None else self._advice_drive[advised]
        thought = self.network.advance(self._clock.thinking_steps, drive)
        self._thinking_counts, self._thinking_spikes = thought, self.network.spike_count
        return self._decided(advised, thought)

    def _decided(self, advised: Action | None, thought: NDArray[np.int64]) -> Decision:
        up, down, left, right = thought[len(SENSORY) : len(SENSORY) + len(MOTOR)].tolist()
        counts = (up, down, left, right)
        return Decision(self._busiest(counts), advised, counts)

    def elapse(self, duration_s: float) -> None:
        """Run the network, driven by its noise only, while the wheels turn."""
        if not self._config.network.runs_while_driving:
            return
        self.network.advance(round(duration_s * 1000.0 / self._clock.neural_step_ms), extend=True)

    def learn(self, feedback: Feedback) -> None:
        """Release dopamine for a sensed target, and pass the reinforcement signal on to the automata."""
        feedback, chosen = self._reinforcement.credited(feedback)
        if feedback.outcome is not Outcome.FAILED:
            self._release_dopamine(feedback)
        self._signal_automata(feedback, punish=chosen)

    def activity(self) -> Activity:
        """Return the spikes of the thinking window and of the drive, mean weights and dopamine."""
        return self.network.activity(self._clock.thinking_steps, self._thinking_spikes, self._thinking_counts)

    def snapshot(self) -> Snapshot:
        """Return copies of the weights, the action probabilities and the cells' states."""
        network = self.network
        if isinstance(network, GeneralNetwork):
            names = [projection.name for projection in self.projections]
            named = {name: network.weights(name) for name in names}
            alike = len({weights.shape for weights in named.values()}) == 1
            weights = np.stack(list(named.values())) if alike else named
        else:
            weights = network.weights
        return Snapshot(weights, self.automata.probabilities, self.states.values(self._config.grid.cells))

    def state(self) -> dict[str, Any]:
        """Return the state of the network, the automata, what teaches them, and the generator for ties."""
        parts = {name: part.state() for name, part in self._parts().items()}
        return {**parts, "ties": self._ties.bit_generator.state}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`."""
        for name, part in self._parts().items():
            part.restore(state[name])
        self._ties.bit_generator.state = state["ties"]

    def _parts(self) -> dict[str, Any]:
        return {"network": self.network, "automata": self.automata, "reinforcement": self._reinforcement}

    def _busiest(self, counts: tuple[int, int, int, int]) -> Action:
        most = max(counts)
        if counts.count(most) == 1:
            return ACTIONS[counts.index(most)]
        winners = [action for action in ACTIONS if counts[action] == most]
        return winners[int(self._ties.choice(len(winners)))]

    def _release_dopamine(self, feedback: Feedback) -> None:
        """Reward or punish the move if a target was sensed; otherwise the network is not taught."""
        if feedback.before.sensed is None:
            return
        amount = (
            self._scalar[feedback.hit] if self._config.plasticity.modulation == "scalar" else self._signed(feedback)
        )
        if amount is not None:
            self.network.release_dopamine(amount, delay_steps=self._delay_steps)

    def _signed(self, feedback: Feedback) -> NDArray[np.float64] | None:
        """Return the amount per projection, or None: the sensed direction's agreeing one up, the opposite down.

        Projections beyond the paper's eight have no direction of their own: they hear of hits and misses.

        The paper asks for the same change after the right move (strengthen what agreed) and after the opposite one
        (reduce what was taken, strengthen its opposite). A move to either side used neither connection.
        """
        sensed = feedback.before.sensed
        taught = self._taught[sensed] if sensed is not None and feedback.action in (sensed, sensed.opposite) else None
        added = self._scalar[feedback.hit][len(PROJECTIONS) :]
        return taught if not len(added) else np.append(np.zeros(len(PROJECTIONS)) if taught is None else taught, added)

    def _signal_automata(self, feedback: Feedback, *, punish: bool) -> None:
        """Reward or penalise automata; the cell's own is not penalised for a direction that it did not choose."""
        self._reinforcement.signal(feedback, punish=punish)


def _drives(populations: tuple[Population, ...], neurons: int, current: float, precision: Precision) -> NDArray[Any]:
    """Return one row per population, (4, neurons): `current` into each of its own, none into the others."""
    drives = np.zeros((len(populations), neurons), precision)
    for drive, population in zip(drives, populations, strict=True):
        drive[population.start : population.stop] = current
    return drives


def _taught_by(sensed: Action) -> NDArray[np.float64]:
    """Return the sign of a sensed direction's dopamine per projection, (8,): agreeing up, opposite down."""
    return np.array([(1.0 if p.agrees else -1.0) if p.sensor == sensed else 0.0 for p in PROJECTIONS])
