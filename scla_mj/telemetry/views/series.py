"""What changes from decision to decision in the brain: mean weights as curves, rates in Hz and dopamine as points."""

from __future__ import annotations

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from scla_mj.anatomy import MOTOR_ROLE
from scla_mj.palette import HIT_COLOUR, population_colours, projection_styles, rgb
from scla_mj.signals import DecisionRecord
from scla_mj.telemetry import names
from scla_mj.telemetry.views import base


class Series(base.View):
    """Rates while thinking and over whole decisions, mean weights, and dopamine concentrations."""

    def __init__(self, stream: rr.RecordingStream, run: base.RecordedRun) -> None:
        super().__init__(stream, run)
        counts, means = (np.int64, (len(run.populations),)), (np.float64, (len(run.projections),))
        thought = [("thinking", *counts), ("whole", *counts), ("steps", np.int64), ("mean_weights", *means)]
        # Spikes by population while thinking and in the whole decision of so many neural steps, and what learnt.
        self._thoughts = self.gather(np.dtype([*thought, ("dopamine", *means)]))

    def panels(self) -> list[base.Panel]:
        """Return weights over the whole run, and the last minute of the rest, of a brain that has such."""
        roles = list({population.role: None for population in self.run.populations})
        if not roles:
            return []
        first = MOTOR_ROLE if MOTOR_ROLE in roles else roles[0]
        more = [self._rates(names.RATES, role, "") for role in roles if role != first]
        more.append(self._rates(names.RATES_WHOLE, first, ", whole decision"))
        rates = [
            base.Panel(base.Place.NOW_RIGHT, self._rates(names.RATES, first, " while thinking"), rank=3, share=2),
            base.Panel(base.Place.BRAIN_RIGHT, self._rates(names.RATES, first, " while thinking"), rank=1),
            base.Panel(base.Place.BRAIN_RIGHT, rrb.Tabs(*more, name="More rates"), rank=4),
        ]
        if not self.run.projections:
            return rates
        ranges = [projection.weight_range for projection in self.run.projections]
        known = [bounds for bounds in ranges if bounds is not None]
        low, high = min((low for low, _ in known), default=0.0), max((high for _, high in known), default=0.0)
        axis = {"axis_y": rrb.ScalarAxis(range=(low, low + 1.05 * (high - low)))} if len(known) == len(ranges) else {}
        means, corner = [f"/{names.WEIGHTS}/**"], rrb.Corner2D.RightTop
        thin = ", opposite ones thin" if any(projection.dashed for projection in self.run.projections) else ""
        weights = base.curves(means, f"Mean weights, mV{thin}", axis_x=base.WHOLE_RUN, corner=corner, **axis)
        lately = base.scrolling_curves(means, "Mean weights in the last minute, mV", legend=False)
        dopamine = base.scrolling_curves([f"/{names.DOPAMINE}/**"], "Dopamine released in each decision")
        return [
            *rates,
            base.Panel(base.Place.LEARNING_TOP, weights, rank=2),
            base.Panel(base.Place.BRAIN_RIGHT, lately, rank=2),
            base.Panel(base.Place.BRAIN_RIGHT, dopamine, rank=3),
        ]

    def log_static(self) -> None:
        """Log each curve's name and colour."""
        for name, colour in population_colours(self.run.populations).items():
            for parent in (names.RATES, names.RATES_WHOLE):
                base.log_points(self.stream, f"{parent}/{name}", colour, name)
        styles = projection_styles(self.run.projections)
        for projection in self.run.projections:
            name, colour, dashed = projection.name, rgb(styles[projection.name][0]), projection.dashed
            label = f"{projection.source} → {projection.target}"
            base.log_line(self.stream, f"{names.WEIGHTS}/{name}", colour, label, 1.0 if dashed else 2.5)
            marker = "diamond" if dashed else "circle"
            base.log_points(self.stream, f"{names.DOPAMINE}/{name}", colour, label, marker=marker)
        base.log_points(self.stream, names.DOPAMINE_OF_ALL, HIT_COLOUR, "all projections alike")

    def add(self, record: DecisionRecord, decision: int) -> None:
        """Keep the counts and the means."""
        activity = self.run.activity(record)
        if activity is not None:
            thinking, whole = self.run.count_spikes(activity)
            self._thoughts.append((thinking, whole, activity.steps, activity.mean_weights, activity.dopamine))

    def send(self, rows: base.Rows) -> None:
        """Send a value per decision and curve, at the decision's end."""
        thoughts, clock = self._thoughts.rows, self.run.clock
        if not len(thoughts):
            return
        index = base.at(rows[rows["thinks"]], "end_s")
        steps, sizes = np.maximum(thoughts["steps"], 1)[:, np.newaxis], self.run.sizes
        populations, projections = (
            [part.name for part in parts] for parts in (self.run.populations, self.run.projections)
        )
        for parent, labels, values in (
            (names.RATES, populations, thoughts["thinking"] / (sizes * clock.thinking_window_s)),
            (
                names.RATES_WHOLE,
                populations,
                thoughts["whole"] / (sizes * steps * (clock.neural_step_ms / 1000)),
            ),
            (names.WEIGHTS, projections, thoughts["mean_weights"]),
        ):
            for label, column in zip(labels, values.T, strict=True):
                base.send_scalars(self.stream, f"{parent}/{label}", index, column)
        self._send_dopamine(rows[rows["thinks"]], thoughts["dopamine"], projections)

    def _send_dopamine(self, rows: base.Rows, dopamine: NDArray[np.float64], projections: list[str]) -> None:
        """Send one point for all projections where they have the same, else one for each."""
        alike = (dopamine == dopamine[:, :1]).all(axis=1) & bool(projections)
        if alike.any():
            base.send_scalars(self.stream, names.DOPAMINE_OF_ALL, base.at(rows[alike], "end_s"), dopamine[alike, 0])
        if not alike.all():
            index = base.at(rows[~alike], "end_s")
            for name, column in zip(projections, dopamine[~alike].T, strict=True):
                base.send_scalars(self.stream, f"{names.DOPAMINE}/{name}", index, column)

    def _rates(self, parent: str, role: str, when: str) -> rrb.TimeSeriesView:
        group = [population for population in self.run.populations if population.role == role]
        contents = [f"/{parent}/{population.name}" for population in group]
        return base.scrolling_curves(contents, f"{role.capitalize() or 'Other'} rates{when}, Hz")
