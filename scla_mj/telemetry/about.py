"""The page inside a recording that says what it shows."""

from __future__ import annotations

import rerun as rr

from scla_mj.config import Telemetry
from scla_mj.grid import Grid, StartProtocol

_KEPT = {"light": "the spikes of every thinking window", "full": "every spike"}


def describe(mode: Telemetry, grid: Grid, protocol: StartProtocol, ceiling_hits_per_1000: float) -> rr.TextDocument:
    """Return the page as Markdown."""
    columns, rows = grid.cells
    text = f"""# A robot that learns to reach its target
{columns} x {rows} cells of {grid.cell_size_m:g} m, target in cell ({grid.target.x}, {grid.target.y}).
Protocol `{protocol}`, where a shortest path earns {ceiling_hits_per_1000:.1f} hits in 1000 decisions.
Kept: {_KEPT[mode]} (telemetry `{mode}`).

- **Arena.** The trail of the last moves: blue a move, gold one that reached the target, red a bump into a wall. Arrows:
  how probable each action is in each cell, yellow up, blue down, green left, pink right.
- **Spikes.** A dot a spike, a row a neuron: sensory S, motor M, inhibitory I, each for U(p), D(own), L(eft), R(ight).
  A frame is a thinking window, in the colour of how its move ended.
- **Weights.** Each sensory population drives its own motor population (agreeing) and the opposite one.
- Drag the time cursor, or press space to play; the timeline can count decisions instead of seconds.
"""
    return rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN)
