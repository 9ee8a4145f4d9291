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
from scla_mj.telemetry.views import base

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


class Series(base.View):
    """Rates while thinking and over whole decisions, mean weights, and dopamine concentrations."""

    def __init__(self, stream: rr.RecordingStream, run: base.RecordedRun) -> None:
        super().__init__(stream, run)
        self._thoughts = self.gather(_THOUGHT)

    def panels(self) -> list[base.Panel]:
        """Return weights over the whole run, and the last minute of the rest."""
        weights = base.curves(
            [f"/{names.WEIGHTS}/**"],
            "Mean weights: agreeing warm, opposite cool",
            axis_x=base.WHOLE_RUN,
            axis_y=rrb.ScalarAxis(range=(0.0, 1.05 * self.run.config.network.weight_max)),
            corner=rrb.Corner2D.RightTop,
        )
        dopamine = base.scrolling_curves([f"/{names.DOPAMINE}/**"], "Dopamine at each decision's end", legend=False)
        more = [
            _rates(names.RATES, SENSORY, "Sensory rates while thinking, Hz"),
            _rates(names.RATES, INHIBITORY, "Inhibitory rates while thinking, Hz"),
            _rates(names.RATES_WHOLE, MOTOR, "Motor rates, whole decision, Hz"),
        ]
        return [
            base.Panel(base.Place.TOP, weights, rank=2),
            base.Panel(base.Place.MIDDLE, _rates(names.RATES, MOTOR, "Motor rates while thinking, Hz"), rank=1),
            base.Panel(base.Place.MIDDLE, dopamine, rank=2),
            base.Panel(base.Place.TABS, rrb.Horizontal(*more, name="More rates"), rank=2),
        ]

    def log_static(self) -> None:
        """Log each curve's name and colour."""
        for name in POPULATION_NAMES:
            for parent in (names.RATES, names.RATES_WHOLE):
                base.log_line(self.stream, f"{parent}/{name}", POPULATION_COLOURS[name], name, 1.2)
        for name in PROJECTION_NAMES:
            for parent, width in ((names.WEIGHTS, 2.0), (names.DOPAMINE, 1.2)):
                base.log_line(self.stream, f"{parent}/{name}", rgb(PROJECTION_COLOURS[name]), name, width)

    def add(self, record: DecisionRecord, decision: int) -> None:
        """Keep the counts and the means."""
        activity = record.activity
        if activity is not None:
            thinking, whole = base.count_spikes(activity)
            self._thoughts.append((thinking, whole, activity.steps, activity.mean_weights, activity.dopamine))

    def send(self, rows: base.Rows) -> None:
        """Send a value per decision and curve, at the decision's end."""
        thoughts, clock = self._thoughts.rows, self.run.clock
        if not len(thoughts):
            return
        index = base.at(rows[rows["thinks"]], "end_s")
        steps = np.maximum(thoughts["steps"], 1)[:, np.newaxis]
        for parent, labels, values in (
            (names.RATES, POPULATION_NAMES, thoughts["thinking"] / (base.SIZES * clock.thinking_window_s)),
            (
                names.RATES_WHOLE,
                POPULATION_NAMES,
                thoughts["whole"] / (base.SIZES * steps * (clock.neural_step_ms / 1000)),
            ),
            (names.WEIGHTS, PROJECTION_NAMES, thoughts["mean_weights"]),
            (names.DOPAMINE, PROJECTION_NAMES, thoughts["dopamine"]),
        ):
            for label, column in zip(labels, values.T, strict=True):
                base.send_scalars(self.stream, f"{parent}/{label}", index, column)


def _rates(parent: str, populations: tuple[Population, ...], name: str) -> rrb.TimeSeriesView:
    return base.scrolling_curves([f"/{parent}/{population.name}" for population in populations], name)
