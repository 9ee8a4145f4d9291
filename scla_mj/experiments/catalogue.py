"""Every experiment of the report, as data: the paper's own part, other brains, harder worlds, one setting changed."""

from __future__ import annotations

from typing import Any, Final

from scla_mj.config import RunConfig
from scla_mj.experiments.exact import next_to_the_target, random_walk
from scla_mj.experiments.experiment import Experiment, Target, with_settings
from scla_mj.experiments.ladder import BODIES, LADDER, LEARNERS
from scla_mj.experiments.paper import AUTOMATON_SPAN
from scla_mj.experiments.scale import (
    FULL,
    FULL_SENSED,
    GRID_EPOCHS,
    JUMP_EPOCH,
    MEDIUM,
    MEDIUM_SENSED,
    SHORT,
    SHORT_SENSED,
    TEN_SEEDS,
    WORLD_EPOCHS,
    equals,
)

__all__ = ["ABLATION", "CATALOGUE", "COMPARISON", "LADDER", "PAPER", "WORLD", "Experiment", "Target", "with_settings"]

_BESIDE: Final = next_to_the_target()

PAPER: Final = (
    Experiment(
        "scla-any-start", "paper", "SCLA, any-start", "Does SCLA find the shortest paths from everywhere?",
        FULL, TEN_SEEDS, "automaton-any-start",
        (
            Target("at least 98.5 % of the ceiling on average", 11, 30, "mean percent of ceiling", 98.5),
            Target("no seed under 97 % of the ceiling", 11, 30, "worst seed percent of ceiling", 97.0),
            Target(
                "the first 1000 decisions at least the best learner's", 1, 1, "mean hits per 1000", 0.0,
                rivals=LEARNERS,
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
        (equals(_BESIDE, *AUTOMATON_SPAN, margin=6.0),),
    ),
    Experiment(
        "automaton-sensed-start", "paper", "automaton alone, sensed-start",
        "And where it always starts next to the target?",
        with_settings(FULL_SENSED, brain="automaton"), TEN_SEEDS, "random-sensed-start",
    ),
)  # fmt: skip

COMPARISON: Final = (
    Experiment(
        "network-any-start", "comparison", "network alone, any-start",
        "What is the network worth without automata? Exactly the four cells next to the target.",
        with_settings(FULL, brain="network"), TEN_SEEDS, "random-any-start", (equals(_BESIDE, 11, 30, margin=6.0),),
    ),
    Experiment(
        "random-any-start", "comparison", "random walk, any-start", "What does chance earn?",
        with_settings(MEDIUM, brain="random"), TEN_SEEDS, None,
        (equals(random_walk("any-start"), 1, WORLD_EPOCHS, margin=2.0),),
    ),
    Experiment(
        "random-sensed-start", "comparison", "random walk, sensed-start", "And from next to the target?",
        with_settings(MEDIUM_SENSED, brain="random"), TEN_SEEDS, None,
        (equals(random_walk("sensed-start"), 1, WORLD_EPOCHS, margin=2.0),),
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
        with_settings(MEDIUM, brain="shortest-path"), TEN_SEEDS,
    ),
    Experiment(
        "shortest-path-sensed-start", "comparison", "shortest path, sensed-start", "And the other ceiling?",
        with_settings(MEDIUM_SENSED, brain="shortest-path"), TEN_SEEDS,
    ),
)  # fmt: skip


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
        TEN_SEEDS,
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
    *BODIES,
    Experiment(
        "target-jump", "world", "SCLA, target jumps to (1, 5) at epoch 11",
        "Does it find a target that has moved, without being informed?",
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
        with_settings(SHORT, grid={"closed_cells": ((2, 3), (3, 2), (4, 4))}), TEN_SEEDS,
    ),
)  # fmt: skip


def _ablation(name: str, title: str, question: str, base: RunConfig = SHORT, **settings: Any) -> Experiment:
    baseline = "scla-any-start" if base.protocol == "any-start" else "scla-sensed-start"
    return Experiment(name, "ablation", title, question, with_settings(base, **settings), TEN_SEEDS, baseline)


ABLATION: Final = (
    _ablation("no-local-rule", "distal reward only", "Is dopamine on arrival enough?", automaton={"local_rule": False}),
    _ablation("no-distal-reward", "local rule only", "Is the local rule enough?", automaton={"distal_reward": False}),
    _ablation(
        "no-bump-penalty", "bumps not penalised", "What is the wall's penalty worth?", automaton={"bump_penalty": False}
    ),
    _ablation(
        "reward-inaction", "scheme L_R-I", "Without penalties?", automaton={"scheme": "reward-inaction"}
    ),
    _ablation(
        "reward-epsilon-penalty", "scheme L_R-epsilon-P", "With small penalties?",
        automaton={"scheme": "reward-epsilon-penalty"},
    ),
    _ablation(
        "opposite-pair", "scheme opposite-pair", "The paper's own text?", automaton={"scheme": "opposite-pair"}
    ),
    _ablation("reward-rate-0.1", "reward rate 0.1", "Slower rewards?", automaton={"reward_rate": 0.1}),
    _ablation("reward-rate-0.9", "reward rate 0.9", "Faster rewards?", automaton={"reward_rate": 0.9}),
    _ablation("penalty-rate-0.05", "penalty rate 0.05", "Milder penalties?", automaton={"penalty_rate": 0.05}),
    _ablation("penalty-rate-0.5", "penalty rate 0.5", "Harder penalties?", automaton={"penalty_rate": 0.5}),
    _ablation(
        "no-inhibition", "no inhibition", "Do the motors need to compete?", SHORT_SENSED,
        network={"inhibitory_to_motor": 0.0},
    ),
    _ablation(
        "network-frozen", "network frozen while driving", "What does one clock cost or bring?", SHORT_SENSED,
        network={"runs_while_driving": False},
    ),
    *(
        _ablation(
            f"dopamine-delay-{delay_s:g}", f"dopamine {delay_s:g} s late",
            "How far does the eligibility trace bridge?", SHORT_SENSED, plasticity={"dopamine_delay_s": delay_s},
        )
        for delay_s in (0.5, 1.0, 2.0, 5.0)
    ),
    _ablation(
        "scalar-dopamine", "one scalar dopamine", "Is one signal for all connections enough?", SHORT_SENSED,
        plasticity={"modulation": "scalar"},
    ),
    _ablation(
        "scalar-dopamine-competing", "one scalar dopamine, stronger inhibition",
        "And where the motors compete harder?", SHORT_SENSED,
        plasticity={"modulation": "scalar"}, network={"motor_to_inhibitory": 1.0, "inhibitory_to_motor": -1.5},
    ),
)  # fmt: skip

CATALOGUE: Final = PAPER + COMPARISON + LADDER + WORLD + ABLATION
