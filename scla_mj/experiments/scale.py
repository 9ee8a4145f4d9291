"""The scales of the catalogue's experiments, and the targets of equality that several of them share."""

from __future__ import annotations

from typing import Final

from scla_mj.config import RunConfig
from scla_mj.experiments.experiment import Target, with_settings

PAPER_EPOCHS: Final = 30
TEN_SEEDS: Final = tuple(range(200, 210))
CHOSEN_ON: Final = tuple(range(50, 66))
"""The seeds on which the constants of the one dopamine were chosen; all other settings were on seeds below 200 too."""
FIRST_MARGIN: Final = 5.0
SETTLED_MARGIN: Final = 1.5
"""Within how many points of the ceiling two brains count as equal, in their first epoch and once settled."""
AUTOMATON_EPOCHS: Final = 20
"""As many as the paper ran its automaton for."""
RANDOM_EPOCHS: Final = 20
"""Enough to tell equality within 2 hits: an epoch of a random walk has a standard deviation of some 6 hits."""
BRIEF_EPOCHS: Final = 6
"""Whoever learns at all has done so by epoch 3."""
ABLATION_EPOCHS: Final = 4
SENSED_ABLATION_EPOCHS: Final = 2
"""The network learns its four choices in the first 200 decisions."""
JUMP_EPOCHS: Final = 14
CROSSED_EPOCHS: Final = 18
"""Seven epochs to learn the new body in."""
LARGE_GRID_EPOCHS: Final = 10
JUMP_EPOCH: Final = 11

FULL: Final = RunConfig(epochs=PAPER_EPOCHS, telemetry="off")
FULL_SENSED: Final = with_settings(FULL, protocol="sensed-start")
BRIEF: Final = with_settings(FULL, epochs=BRIEF_EPOCHS)
BRIEF_SENSED: Final = with_settings(BRIEF, protocol="sensed-start")
SHORT: Final = with_settings(FULL, epochs=ABLATION_EPOCHS)
SHORT_SENSED: Final = with_settings(FULL_SENSED, epochs=SENSED_ABLATION_EPOCHS)


def equals(value: float, first: int, last: int, *, margin: float) -> Target:
    """Return the target of an exact figure: hits per 1000 decisions that differ from it by less than `margin`."""
    text = f"equals {value:.2f} within {margin:g}"
    return Target(text, first, last, "equivalent hits per 1000", value - margin, value + margin)


def as_good_as(name: str, first: int, last: int, *, margin: float) -> Target:
    """Return the target of an equal: percent of ceiling that differ by less than `margin` points."""
    text = f"equals {name} within {margin:g} points"
    return Target(text, first, last, "equivalent percent of ceiling", -margin, margin, rivals=(name,))
