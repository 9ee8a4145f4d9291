"""Worlds that are harder than the paper's."""

from __future__ import annotations

from typing import Final

from scla_mj.experiments.catalogue.experiment import (
    FIVE_SEEDS,
    FULL,
    GRID_EPOCHS,
    JUMP_EPOCH,
    MEDIUM,
    SHORT,
    TEN_SEEDS,
    WORLD_EPOCHS,
    Experiment,
    Target,
    with_settings,
)


def _noisy(probability: float) -> Experiment:
    return Experiment(
        f"action-noise-{100 * probability:.0f}",
        "world",
        f"SCLA, action noise {probability}",
        f"Does it learn where {100 * probability:.0f} % of the moves go another way?",
        with_settings(MEDIUM, task={"action_noise": probability}),
        TEN_SEEDS,
        targets=(Target("at least 93 % of its ceiling", 11, WORLD_EPOCHS, "mean percent of ceiling", 93.0),),
    )


def _held_out(cells: tuple[int, int], target: tuple[int, int], percent: float) -> Experiment:
    (width, height), (x, y) = cells, target
    return Experiment(
        f"grid-{width}x{height}-{x}-{y}",
        "world",
        f"SCLA, {width}x{height}, target ({x}, {y})",
        "Does it learn in another arena with unchanged settings?",
        with_settings(FULL, epochs=GRID_EPOCHS, grid={"cells": cells, "target": target}),
        FIVE_SEEDS,
        targets=(
            Target(
                f"at least {percent:g} % of its ceiling by epoch {GRID_EPOCHS}",
                GRID_EPOCHS,
                GRID_EPOCHS,
                "mean percent of ceiling",
                percent,
            ),
        ),
    )


WORLD: Final = (
    Experiment(
        "target-jump", "world", "SCLA, target jumps to (1, 5) at epoch 11",
        "Does it find a target that has moved, without being told?",
        with_settings(MEDIUM, task={"jump_epoch": JUMP_EPOCH, "jump_target": (1, 5)}), TEN_SEEDS,
        targets=(
            Target("at least 90 % of the new ceiling in epoch 12", 12, 12, "mean percent of ceiling", 90.0),
            Target("at least 95 % in epoch 13", 13, 13, "mean percent of ceiling", 95.0),
        ),
    ),
    _noisy(0.1),
    _noisy(0.3),
    _held_out((5, 5), (1, 1), 95.0),
    _held_out((5, 5), (5, 2), 95.0),
    _held_out((7, 7), (4, 4), 95.0),
    _held_out((10, 10), (5, 5), 93.0),
    _held_out((10, 10), (1, 1), 93.0),
    _held_out((10, 10), (10, 4), 93.0),
    Experiment(
        "closed-cells", "world", "SCLA, closed cells (2, 3) (3, 2) (4, 4)", "Does it find its way around walls?",
        with_settings(SHORT, grid={"closed_cells": ((2, 3), (3, 2), (4, 4))}), FIVE_SEEDS,
    ),
)  # fmt: skip
