"""Every decision in words: what the robot senses, is advised and decides, and what came of it."""

from __future__ import annotations

from typing import Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from scla_mj.anatomy import motors_of
from scla_mj.grid import Action
from scla_mj.signals import DecisionRecord, Outcome
from scla_mj.telemetry import names
from scla_mj.telemetry.views import base

_TEXT: Final = "story/explanation"
_SIGNS: Final = ("↑", "↓", "←", "→")
_GUIDE: Final = """## A robot learns to reach the green target
**Press space to play**, again to pause. Drag the white cursor below to any moment; the arrow keys go step by step.

- **Now**: the robot, and why it decides as it does. **Learning**: what has changed since the start. **Brain**: what the
  neurons do. **Log and about**: what happened when, and what each view shows.
- The menu at the lower left, `sim_time`, can count decisions instead of seconds.
"""


class Explanation(base.View):
    """A text per decision, once it is decided, and again with its outcome."""

    def __init__(self, stream: rr.RecordingStream, run: base.RecordedRun) -> None:
        super().__init__(stream, run)
        self._motors = motors_of(run.anatomy)
        self._texts: list[str] = []

    def panels(self) -> list[base.Panel]:
        """Return the text."""
        panel = rrb.TextDocumentView(origin=f"/{_TEXT}", name="This decision")
        return [base.Panel(base.Place.NOW_RIGHT, panel, rank=1, share=2.6)]

    def log_static(self) -> None:
        """Log that it is Markdown."""
        self.stream.log(_TEXT, rr.TextDocument.from_fields(media_type=rr.MediaType.MARKDOWN), static=True)

    def add(self, record: DecisionRecord, decision: int) -> None:
        """Write both texts; before the first decision of a run, what one can do with a recording."""
        if decision == 1:
            start = [rr.TimeColumn(names.SIM_TIME, duration=np.array([record.time_s]))]
            self.stream.send_columns(_TEXT, start, rr.TextDocument.columns(text=[_GUIDE]))
        reason = _reason(record, decision, self._motors)
        self._texts += [f"{reason}- **Then**: on its way", reason + _outcome(record)]

    def send(self, rows: base.Rows) -> None:
        """Send both texts of every decision."""
        texts = self._texts
        self._texts = []
        self.stream.send_columns(_TEXT, base.at(rows, "decided_s", "end_s"), rr.TextDocument.columns(text=texts))


def _direction(action: Action) -> str:
    return f"{_SIGNS[action]} {action.label}"


def _reason(record: DecisionRecord, decision: int, motors: tuple[str, ...]) -> str:
    """Return what the decision was made of."""
    percept, chosen = record.percept, record.chosen
    action, advised, votes = chosen
    x, y = percept.cell
    lines = [f"## {_direction(action)}: decision {decision}, epoch {record.epoch}", ""]
    if percept.sensed is None:
        lines.append(f"- **Senses** no target next to cell ({x}, {y})")
    else:
        lines.append(f"- **Senses** the target: {_direction(percept.sensed)} of cell ({x}, {y})")
    if advised is not None:
        lines.append(f"- **Advice** of the cell's automaton: {_direction(advised)}")
    if votes is not None and motors:
        counts = ", ".join(f"{name} {count}" for name, count in zip(motors, votes, strict=True))
        lines.append(f"- **Votes**, spikes of the motor populations: {counts}")
    astray = "" if record.executed == action else f", but the body goes {_direction(record.executed)}"
    lines.append(f"- **Decides** {_direction(action)}{astray}")
    return "\n".join(lines) + "\n"


def _outcome(record: DecisionRecord) -> str:
    """Return what came of it."""
    move = record.move
    x, y = move.after
    if record.hit:
        end = f"**hit**: the target in cell ({x}, {y})"
    elif move.outcome is Outcome.MOVED:
        end = f"moved to cell ({x}, {y})"
    elif move.outcome is Outcome.BLOCKED:
        end = f"bumped into a wall, still in cell ({x}, {y})"
    else:
        end = "the move failed"
    return f"- **Then**: {end}, after {move.duration_s:.2f} s"
