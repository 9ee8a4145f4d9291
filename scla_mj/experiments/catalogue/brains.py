"""The paper's own part, and the brains that SCLA is compared with."""

from __future__ import annotations

from typing import Final

from scla_mj.experiments.catalogue.experiment import (
    FIVE_SEEDS,
    FULL,
    FULL_SENSED,
    MEDIUM,
    MEDIUM_SENSED,
    TEN_SEEDS,
    WORLD_EPOCHS,
    Experiment,
    Target,
    with_settings,
)
from scla_mj.experiments.exact import beside_the_target, random_walk
from scla_mj.experiments.paper import AUTOMATON_SPAN


def _holds(value: float, first: int, last: int) -> Target:
    return Target(f"{value:.2f} inside the 95 % interval", first, last, "interval holds", value, value)


_Q_LEARNING: Final = ("q-learning-any-start", "q-learning-epsilon-any-start")
_BESIDE: Final = beside_the_target()
_AROUND: Final = 6.0
"""Hits per 1000 by which the automaton may miss its exact figure."""


PAPER: Final = (
    Experiment(
        "scla-any-start", "paper", "SCLA, any-start", "Does SCLA find the shortest paths from everywhere?",
        FULL, TEN_SEEDS, "automaton-any-start",
        (
            Target("at least 98.5 % of the ceiling on average", 11, 30, "mean percent of ceiling", 98.5),
            Target("no seed under 97 % of the ceiling", 11, 30, "worst seed percent of ceiling", 97.0),
            Target(
                "the first 1000 decisions at least the best Q-learning's", 1, 1, "mean hits per 1000", 0.0,
                rivals=_Q_LEARNING,
            ),
        ),
    ),
    Experiment(
        "scla-sensed-start", "paper", "SCLA, sensed-start",
        "Does the network learn to move where the target is sensed?",
        FULL_SENSED, TEN_SEEDS, "automaton-sensed-start",
        (
            Target("at least 970 in epoch 1 (paper: 784.2 on average)", 1, 1, "mean hits per 1000", 970.0),
            Target("at least 998 from epoch 2", 2, 30, "mean hits per 1000", 998.0),
        ),
    ),
    Experiment(
        "automaton-any-start", "paper", "automaton alone, any-start",
        "What do automata learn when only the move into the target is rewarded (paper: 115)?",
        with_settings(FULL, brain="automaton"), TEN_SEEDS, "random-any-start",
        (
            _holds(_BESIDE, *AUTOMATON_SPAN),
            Target(
                f"within {_AROUND:g} of {_BESIDE:.2f}", *AUTOMATON_SPAN, "mean hits per 1000",
                _BESIDE - _AROUND, _BESIDE + _AROUND,
            ),
        ),
    ),
    Experiment(
        "automaton-sensed-start", "paper", "automaton alone, sensed-start",
        "And where it always starts beside the target?",
        with_settings(FULL_SENSED, brain="automaton"), TEN_SEEDS, "random-sensed-start",
    ),
)  # fmt: skip

COMPARISON: Final = (
    Experiment(
        "network-any-start", "comparison", "network alone, any-start",
        "What is the network worth without automata? Exactly the four cells beside the target.",
        with_settings(FULL, brain="network"), TEN_SEEDS, "random-any-start", (_holds(_BESIDE, 11, 30),),
    ),
    Experiment(
        "random-any-start", "comparison", "random walk, any-start", "What does chance earn?",
        with_settings(MEDIUM, brain="random"), TEN_SEEDS, None, (_holds(random_walk("any-start"), 1, WORLD_EPOCHS),),
    ),
    Experiment(
        "random-sensed-start", "comparison", "random walk, sensed-start", "And from beside the target?",
        with_settings(MEDIUM_SENSED, brain="random"), TEN_SEEDS, None,
        (_holds(random_walk("sensed-start"), 1, WORLD_EPOCHS),),
    ),
    Experiment(
        "q-learning-any-start", "comparison", "Q-learning, optimistic and greedy, any-start",
        "How does tabular Q-learning at its best compare?",
        with_settings(MEDIUM, brain="q-learning"), TEN_SEEDS, "scla-any-start",
    ),
    Experiment(
        "q-learning-epsilon-any-start", "comparison", "Q-learning, 0.1-greedy from zero, any-start",
        "And as it is usually written down?",
        with_settings(MEDIUM, brain="q-learning", brain_settings={"initial_value": 0.0, "epsilon": 0.1}), TEN_SEEDS,
        "scla-any-start",
    ),
    Experiment(
        "shortest-path-any-start", "comparison", "shortest path, any-start", "Does the robot reach the ceiling?",
        with_settings(MEDIUM, brain="shortest-path"), FIVE_SEEDS,
    ),
    Experiment(
        "shortest-path-sensed-start", "comparison", "shortest path, sensed-start", "And the other ceiling?",
        with_settings(MEDIUM_SENSED, brain="shortest-path"), FIVE_SEEDS,
    ),
)  # fmt: skip
