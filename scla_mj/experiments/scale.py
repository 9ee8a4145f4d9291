"""The scales of the catalogue's experiments, and the targets of equality that several of them share."""

from __future__ import annotations

from typing import Final

from scla_mj.config import RunConfig
from scla_mj.experiments.experiment import Target, with_settings

PAPER_EPOCHS: Final = 30
TEN_SEEDS: Final = tuple(range(10))
ABLATION_EPOCHS: Final = 5
WORLD_EPOCHS: Final = 14
GRID_EPOCHS: Final = 10
LADDER_EPOCHS: Final = 6
"""Whoever learns at all has done so by epoch 3."""
CROSSED_EPOCHS: Final = 18
"""Seven epochs to learn the new body in."""
JUMP_EPOCH: Final = 11

FULL: Final = RunConfig(epochs=PAPER_EPOCHS, telemetry="off")
FULL_SENSED: Final = with_settings(FULL, protocol="sensed-start")
MEDIUM: Final = with_settings(FULL, epochs=WORLD_EPOCHS)
MEDIUM_SENSED: Final = with_settings(MEDIUM, protocol="sensed-start")
SHORT: Final = with_settings(FULL, epochs=ABLATION_EPOCHS)
SHORT_SENSED: Final = with_settings(SHORT, protocol="sensed-start")


def equals(value: float, first: int, last: int, *, margin: float) -> Target:
    """Return the target of an exact figure: hits per 1000 decisions that differ from it by less than `margin`."""
    text = f"equals {value:.2f} within {margin:g}"
    return Target(text, first, last, "equivalent hits per 1000", value - margin, value + margin)


def as_good_as(name: str, first: int, last: int, *, margin: float) -> Target:
    """Return the target of an equal: percent of ceiling that differ by less than `margin` points."""
    text = f"equals {name} within {margin:g} points"
    return Target(text, first, last, "equivalent percent of ceiling", -margin, margin, rivals=(name,))
