"""SCLA with one dopamine: a scalar prediction error teaches the network and the automata, and nothing else does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal

import numpy as np
from annotated_types import Interval
from numpy.typing import NDArray

from scla_mj.anatomy import MOTOR, SENSORY
from scla_mj.brain.dopamine import Critic
from scla_mj.brain.scla import SclaBrain
from scla_mj.checked import CheckedConfig
from scla_mj.config import Current, Fraction
from scla_mj.grid import Action
from scla_mj.signals import Activity, Feedback, Outcome
from scla_mj.validation import Section

_HEARD: Final = 0.5
"""Spikes per neuron of a sensory population in the thinking window: a driven one fires twice as many, one at rest 0.05
at most."""


class DopamineBrain(SclaBrain):
    """SCLA taught by one scalar (docs/model.md): dopamine = release x prediction error, the same at all 8 projections.

    It differs from the printed form in four points. The dopamine is a prediction error (`Critic`) that knows neither
    labels nor the wiring. It is released when the axle crosses into the next cell, so that it has decayed before the
    next decision's spikes. The motor population of the executed direction bursts as the drive begins (an efference
    copy: Fee 2014), so that its synapses are the eligible ones. An automaton is rewarded by a rise of dopamine,
    penalised by a dip, and hears nothing else.

    Nothing reads the network between `elapse` and `learn`, so the whole drive's neural time passes in `learn`, once it
    is known when the axle crossed.

    Attributes:
        critic: what is expected of a move.
        prediction_error: that of the last move.
    """

    reads = (
        "network.precision", "network.neurons", "network.projections",
        "network.weight", "network.sensory", "network.advice", "network.motor",
        "network.inhibitory", "plasticity.stdp", "plasticity.eligibility", "plasticity.dopamine-tau",
        "plasticity.learning", "automaton.scheme", "automaton.reward", "automaton.penalty", "automaton.epsilon",
        "automaton.discount",
    )  # fmt: skip

    @dataclass(frozen=True)
    class Settings(Section):
        """How much is released for what, and the burst that makes the executed direction's synapses eligible."""

        release: Annotated[float, Interval(ge=-10.0, le=10.0)] = 0.35
        """Dopamine per unit of prediction error; from 0.05 to 0.5 it learns alike. At 0 nothing ever changes,
        below 0 it learns to miss."""
        released_at: Literal["crossing", "end"] = "crossing"
        """When: as the axle crosses into the next cell, or as the move ends, shortly before the next decision."""
        gate: bool = True
        """Whether dopamine reaches the network only where a sensory population was driven in the decision window."""
        expectation_rate: Fraction = 0.2
        """How fast the expectation of a hit follows what comes."""
        initial_expectation: Fraction = 0.5
        """Expectation of a hit before any experience: the chance of the right one of two motors."""
        expectation: Literal["learnt", "rate"] = "learnt"
        """Where the expectation of a hit comes from: learnt per sensed direction, or the winning motor population's own
        firing rate, which the same synapses keep."""
        certain_spikes: Annotated[float, Interval(ge=1.01, le=100.0)] = 2.0
        """With expectation rate: spikes per neuron of the winning population in the decision window at which a hit is
        certain; at 1, the volley that any drive causes, none is expected."""
        least_expectation: Fraction = 0.2
        """The expectation counts as no less: otherwise a robot that always misses would never be disappointed."""
        burst_ms: Annotated[float, Interval(ge=0.0, le=1000.0)] = 30.0
        """Length of the efference copy, from the start of the drive; longer than the window's STDP trace adds nothing.
        """
        burst_drive: Current = 50.0
        """Current into the executed direction's motor population during the burst."""
        burst_suppression: Current = -20.0
        """Current into the three other motor populations during the burst."""
        undo: bool = True
        """Whether a dip also rewards the way back, in the automaton of the cell that was entered."""

    def __init__(self, checked: CheckedConfig, settings: Settings) -> None:
        super().__init__(checked)
        self.critic = Critic(
            discount=checked.config.automaton.discount,
            rate=settings.expectation_rate,
            initial=settings.initial_expectation,
            least=settings.least_expectation,
        )
        self.states = self.critic.states
        self.prediction_error = 0.0
        self._driven_steps = 0
        self._settings = settings
        self._burst_drive = self._bursts(settings)
        self._steps_per_s = 1000.0 / checked.clock.neural_step_ms
        self._burst_steps = round(settings.burst_ms / checked.clock.neural_step_ms)

    def elapse(self, duration_s: float) -> None:
        """Note how long the drive took; its neural time passes in `learn`."""
        self._driven_steps = round(duration_s * self._steps_per_s)

    def learn(self, feedback: Feedback) -> None:
        """Let the drive's neural time pass, with the burst at its start and dopamine at the crossing."""
        is_known = feedback.outcome is not Outcome.FAILED
        expected = self._rate() if self._settings.expectation == "rate" else None
        self.prediction_error = self.critic.prediction_error(feedback, expected=expected) if is_known else 0.0
        dopamine = self._settings.release * self.prediction_error
        burst = min(self._burst_steps, self._driven_steps)
        crossing = self._driven_steps
        if feedback.crossed_s is not None and self._settings.released_at == "crossing":
            crossing = min(crossing, max(burst, round(feedback.crossed_s * self._steps_per_s)))
        self.network.advance(burst, self._burst_drive[feedback.executed], extend=True)
        self.network.advance(crossing - burst, extend=True)
        if self._hears():
            self.network.release_dopamine(np.full(len(self.projections), dopamine))
        self.network.advance(self._driven_steps - crossing, extend=True)
        self._teach_automata(feedback, dopamine)

    def activity(self) -> Activity:
        """Return the same as the printed form, with the dopamine of this move, gated or not."""
        dopamine = np.full(len(self.projections), self._settings.release * self.prediction_error)
        return super().activity()._replace(dopamine=dopamine)

    def _parts(self) -> dict[str, Any]:
        return {"network": self.network, "automata": self.automata, "critic": self.critic}

    def _rate(self) -> float:
        """Return the expectation of a hit that the winning motor population's rate expresses, at most 1."""
        winner = self._thinking_counts[len(SENSORY) : len(SENSORY) + len(MOTOR)].max() / self.motor[0].size
        return min(1.0, float(winner - 1.0) / (self._settings.certain_spikes - 1.0))

    def _hears(self) -> bool:
        """Return whether a sensory population was driven: without it the gate keeps dopamine from the network.

        Without one no sensory synapse had a part in the decision; chance pairings of the background would all be
        strengthened by progress alike.
        """
        return not self._settings.gate or bool(
            self._thinking_counts[: len(SENSORY)].max() >= _HEARD * self.sensory[0].size
        )

    def _teach_automata(self, feedback: Feedback, dopamine: float) -> None:
        """Reward or penalise the executed action, unless it went astray: nobody chose it, so none is penalised."""
        cell, action = feedback.before.cell, feedback.executed
        if dopamine > 0.0:
            self.automata.reward(cell, action)
        elif dopamine < 0.0 and action == feedback.action:
            self.automata.penalise(cell, action)
            if self._settings.undo and feedback.outcome is Outcome.MOVED:
                self.automata.reward(feedback.after.cell, action.opposite)

    def _bursts(self, settings: Settings) -> NDArray[Any]:
        """Return one row per executed direction, (4, neurons)."""
        drives = np.zeros((len(Action), self.neurons), self._config.network.precision)
        for action in Action:
            for motor, population in zip(Action, self.motor, strict=True):
                drive = settings.burst_drive if motor == action else settings.burst_suppression
                drives[action, population.start : population.stop] = drive
        return drives
