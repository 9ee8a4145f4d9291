"""What is said in words: the page inside a recording that says what it shows, and a log of what happened."""

from __future__ import annotations

from typing import Final

import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import TextLogColumnKind

from scla_mj import __version__
from scla_mj.anatomy import motors_of
from scla_mj.config import Telemetry
from scla_mj.grid import said
from scla_mj.signals import DecisionRecord, Outcome
from scla_mj.telemetry.views import base

_ABOUT: Final = "about"
_LOG: Final = "decisions/log"
_KEPT: Final[dict[Telemetry, str]] = {"light": "the spikes of every thinking window", "full": "every spike"}

_TRAIL: Final = """- **Arena.** The trail of the last moves: blue a move, gold one that reached the target, red a bump
  into a wall."""
_ARROWS: Final = """Arrows on the floor: how probable each action is in each cell, orange up, blue down, green left,
  pink right."""
_LAST_DECISIONS: Final = """- **Last decisions.** A column per decision: what it senses, what advises it, what it does;
  a disc for how that ended."""
_HOW_TO: Final = """- Drag the time cursor, or press space to play; the timeline can count decisions instead of seconds.
- More: docs/recording.md.
"""


class Text(base.View):
    """The page about the recording, and the log."""

    def panels(self) -> list[base.Panel]:
        """Return both."""
        columns = rrb.TextLogColumns(text_log_columns=[TextLogColumnKind.LogLevel, TextLogColumnKind.Body])
        log = rrb.TextLogView(origin=f"/{_LOG}", name="Log", columns=columns)
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


def _about(run: base.RecordedRun) -> str:
    """Return the page as Markdown: what it says of the views is what this brain has."""
    columns, rows = run.grid.cells
    plan = f"{run.config.epochs} x {run.config.decisions} decisions"
    return f"""# A robot that learns to reach its target
Brain `{run.config.brain.rpartition(":")[2]}`, seed {run.config.seed}, {plan}; scla_mj {__version__}.
{columns} x {rows} cells of {run.grid.cell_size_m:g} m, {said(run.grid.targets)}; cell (1, 1) is at the lower left.
Protocol `{run.config.protocol}`, where a shortest path earns {run.ceiling_hits_per_1000:.1f} hits in 1000 decisions.

""" + "\n".join((_arena(run), _LAST_DECISIONS, *_neurons(run), _cells(run), _HOW_TO))


def _arena(run: base.RecordedRun) -> str:
    parts = [_TRAIL]
    if run.memory.probabilities is not None:
        parts.append(_ARROWS)
    if motors_of(run.anatomy):
        parts.append("Arrows above the cell where it decided: the votes of its motor populations.")
    parts.append("A white beam: it senses the target.")
    if run.memory.values is not None:
        parts.append("Greener tiles: cells that it finds better.")
    return " ".join(parts)


def _neurons(run: base.RecordedRun) -> list[str]:
    """Return what the page says of the brain's neurons."""
    if run.anatomy is None:
        return []
    groups = [
        f"{role or 'others'}: {', '.join(own.name for own in run.anatomy.of_role(role))}"
        for role in {own.role: None for own in run.populations}
    ]
    lines = [
        f"- **Spikes.** A dot per spike, a row per neuron; from above, {'; '.join(groups)}. A frame closes round a "
        f"thinking window once its move has ended, in the colour of how. Kept: {_KEPT[run.config.telemetry]}."
    ]
    if run.anatomy.watched:
        lines.append("- **Membrane potential** of some neurons, in the same windows; a spike reaches the top.")
    if run.projections:
        weights = ", ".join(f"{own.source} to {own.target}" for own in run.projections)
        lines.append(
            f"- **Weights.** The mean of each projection: {weights}. Their picture has a block per projection."
        )
        lines.append("- **Dopamine.** What each decision released, in the units of the learning rule.")
    return lines


def _cells(run: base.RecordedRun) -> str:
    value = "how good the brain finds each, " if run.memory.values is not None else ""
    policy = ", and the policy" if run.memory.probabilities is not None else ""
    return f"- **Cells from above.** Under Learning: {value}where the robot decided{policy}."
