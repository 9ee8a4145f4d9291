"""What is said in words: the page inside a recording that says what it shows, and a log of what happened."""

from __future__ import annotations

from typing import Final

import rerun as rr
import rerun.blueprint as rrb

from scla_mj.config import Telemetry
from scla_mj.grid import said
from scla_mj.signals import DecisionRecord, Outcome
from scla_mj.telemetry.views import base

_ABOUT: Final = "about"
_LOG: Final = "decisions/log"
_KEPT: Final[dict[Telemetry, str]] = {"light": "the spikes of every thinking window", "full": "every spike"}


class Text(base.View):
    """The page about the recording, and the log."""

    def panels(self) -> list[base.Panel]:
        """Return both."""
        log = rrb.TextLogView(origin=f"/{_LOG}", name="Log")
        about = rrb.TextDocumentView(origin=f"/{_ABOUT}", name="About")
        return [base.Panel(base.Place.LOG, log, rank=1), base.Panel(base.Place.LOG, about, rank=2)]

    def log_static(self) -> None:
        """Log the page."""
        page = rr.TextDocument(_about(self.run), media_type=rr.MediaType.MARKDOWN)
        self.stream.log(_ABOUT, page, static=True)

    def add(self, record: DecisionRecord, decision: int) -> None:
        """Log a move that failed, and where the wheels are crossed."""
        if record.decision == 1 and record.epoch == self.run.config.task.crossed_epoch:
            base.set_time(self.stream, record.time_s, decision, record.epoch)
            self._say("the wheels are crossed: from here on every move goes the opposite way", rr.TextLogLevel.WARN)
        if record.move.outcome is Outcome.FAILED:
            base.set_time(self.stream, base.end_time_s(record), decision, record.epoch)
            x, y = record.move.before
            self._say(f"the move {record.chosen.action.label} from cell ({x}, {y}) failed", rr.TextLogLevel.WARN)

    def end_epoch(self, count: base.EpochCount) -> None:
        """Log the epoch's result."""
        share = 100 * count.hits_per_1000 / count.ceiling_hits_per_1000
        result = f"{count.hits} hits in {count.decisions} decisions, {share:.1f} % of the ceiling"
        self._say(f"epoch {count.epoch}: {result}", rr.TextLogLevel.INFO)

    def move_target(self) -> None:
        """Log where the target went."""
        self._say(f"the {said(self.run.grid.targets, (' jumps to cell', 's jump to cells'))}", rr.TextLogLevel.WARN)

    def stop(self, decisions: int) -> None:
        """Log that the run stops early."""
        self._say(f"stopped after {decisions} decisions", rr.TextLogLevel.WARN)

    def _say(self, text: str, level: str) -> None:
        self.stream.log(_LOG, rr.TextLog(text, level=level))


def _neurons(run: base.RecordedRun) -> str:
    """Return what the page says of the brain's neurons, line by line."""
    if run.anatomy is None:
        return ""
    groups = [
        f"{role or 'others'}: {', '.join(own.name for own in run.anatomy.of_role(role))}"
        for role in {own.role: None for own in run.populations}
    ]
    weights = ", ".join(f"{own.source} to {own.target}" for own in run.projections)
    return (
        f"- **Spikes.** A dot per spike, a row per neuron; from above, {'; '.join(groups)}.\n"
        "  A frame closes round a thinking window once its move has ended, in the colour of how.\n"
        + (f"- **Weights.** The mean of each projection: {weights}.\n" if weights else "")
    )


def _about(run: base.RecordedRun) -> str:
    """Return the page as Markdown."""
    columns, rows = run.grid.cells
    return f"""# A robot that learns to reach its target
{columns} x {rows} cells of {run.grid.cell_size_m:g} m, {said(run.grid.targets)}.
Protocol `{run.config.protocol}`, where a shortest path earns {run.ceiling_hits_per_1000:.1f} hits in 1000 decisions.
Kept: {_KEPT[run.config.telemetry]} (telemetry `{run.config.telemetry}`).

- **Arena.** The trail of the last moves: blue a move, gold one that reached the target, red a bump into a wall. Arrows
  on the floor: how probable each action is in each cell, orange up, blue down, green left, pink right; over the robot:
  the votes of its motor populations. A white beam: it senses the target. Greener tiles: cells that it finds better.
- **Last decisions.** A column per decision: what it senses, is advised and does; a disc for how that ended.
{_neurons(run)}- Drag the time cursor, or press space to play; the timeline can count decisions instead of seconds.
- More: docs/recording.md.
"""
