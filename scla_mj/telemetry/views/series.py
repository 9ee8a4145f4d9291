"""What changes from decision to decision in the brain, as curves: rates in Hz, mean weights, dopamine."""

from __future__ import annotations

from typing import Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from scla_mj.anatomy import (
    INHIBITORY,
    MOTOR,
    POPULATION_NAMES,
    POPULATIONS,
    PROJECTION_NAMES,
    PROJECTIONS,
    SENSORY,
    Population,
)
from scla_mj.palette import POPULATION_COLOURS, PROJECTION_COLOURS, rgb
from scla_mj.signals import DecisionRecord
from scla_mj.telemetry import names
from scla_mj.telemetry.views.base import (
    SIZES,
    WHOLE_RUN,
    Panel,
    Place,
    Rows,
    RunFacts,
    View,
    at,
    count_spikes,
    curves,
    log_line,
    scrolling_curves,
    send_scalars,
)

_COUNTS: Final = (np.int64, (len(POPULATIONS),))
_MEANS: Final = (np.float64, (len(PROJECTIONS),))
_THOUGHT: Final = np.dtype(
    [
        ("thinking", *_COUNTS),
        ("whole", *_COUNTS),
        ("steps", np.int64),
        ("mean_weights", *_MEANS),
        ("dopamine", *_MEANS),
    ]
)
"""Spikes by population while thinking and in the whole decision of so many neural steps, and what learnt."""


class Series(View):
    """Rates while thinking and over whole decisions, mean weights, and dopamine concentrations."""

    def __init__(self, stream: rr.RecordingStream, run: RunFacts) -> None:
        super().__init__(stream, run)
        self._thoughts = self.gather(_THOUGHT)

    def panels(self) -> list[Panel]:
        """Return weights over the whole run, and the last minute of the rest."""
        weights = curves(
            [f"/{names.WEIGHTS}/**"],
            "Mean weights: agreeing warm, opposite cool",
            axis_x=WHOLE_RUN,
            axis_y=rrb.ScalarAxis(range=(0.0, 1.05 * self.run.weight_max)),
            corner=rrb.Corner2D.RightTop,
        )
        dopamine = scrolling_curves([f"/{names.DOPAMINE}/**"], "Dopamine at each decision's end", legend=False)
        more = [
            _rates(names.RATES, SENSORY, "Sensory rates while thinking, Hz"),
            _rates(names.RATES, INHIBITORY, "Inhibitory rates while thinking, Hz"),
            _rates(names.RATES_WHOLE, MOTOR, "Motor rates, whole decision, Hz"),
        ]
        return [
            Panel(Place.TOP, weights, rank=2),
            Panel(Place.MIDDLE, _rates(names.RATES, MOTOR, "Motor rates while thinking, Hz"), rank=1),
            Panel(Place.MIDDLE, dopamine, rank=2),
            Panel(Place.TABS, rrb.Horizontal(*more, name="More rates"), rank=2),
        ]

    def log_static(self) -> None:
        """Log each curve's name and colour."""
        for name in POPULATION_NAMES:
            for parent in (names.RATES, names.RATES_WHOLE):
                log_line(self.stream, f"{parent}/{name}", POPULATION_COLOURS[name], name, 1.2)
        for name in PROJECTION_NAMES:
            for parent, width in ((names.WEIGHTS, 2.0), (names.DOPAMINE, 1.2)):
                log_line(self.stream, f"{parent}/{name}", rgb(PROJECTION_COLOURS[name]), name, width)

    def add(self, record: DecisionRecord, decision: int) -> None:
        """Keep the counts and the means."""
        activity = record.activity
        if activity is not None:
            thinking, whole = count_spikes(activity)
            self._thoughts.append((thinking, whole, activity.steps, activity.mean_weights, activity.dopamine))

    def send(self, rows: Rows) -> None:
        """Send a value per decision and curve, at the decision's end."""
        thoughts, clock = self._thoughts.rows, self.run.clock
        if not len(thoughts):
            return
        index = at(rows[rows["thinks"]], "end_s")
        steps = np.maximum(thoughts["steps"], 1)[:, np.newaxis]
        for parent, labels, values in (
            (names.RATES, POPULATION_NAMES, thoughts["thinking"] / (SIZES * clock.thinking_window_s)),
            (names.RATES_WHOLE, POPULATION_NAMES, thoughts["whole"] / (SIZES * steps * (clock.neural_step_ms / 1000))),
            (names.WEIGHTS, PROJECTION_NAMES, thoughts["mean_weights"]),
            (names.DOPAMINE, PROJECTION_NAMES, thoughts["dopamine"]),
        ):
            for label, column in zip(labels, values.T, strict=True):
                send_scalars(self.stream, f"{parent}/{label}", index, column)


def _rates(parent: str, populations: tuple[Population, ...], name: str) -> rrb.TimeSeriesView:
    return scrolling_curves([f"/{parent}/{population.name}" for population in populations], name)
