"""Every experiment of the report, as data: the paper's own part, other brains, harder worlds, one setting changed."""

from __future__ import annotations

import dataclasses
from typing import Any, Final

from scla_mj.config import RunConfig
from scla_mj.experiments.exact import next_to_the_target, random_walk
from scla_mj.experiments.experiment import Experiment, Target, with_settings
from scla_mj.experiments.ladder import BODIES, JUMPS, LADDER, LEARNERS, in_world
from scla_mj.experiments.paper import AUTOMATON_SPAN
from scla_mj.experiments.scale import (
    AUTOMATON_EPOCHS,
    BRIEF,
    BRIEF_EPOCHS,
    BRIEF_SENSED,
    FULL,
    FULL_SENSED,
    LARGE_GRID_EPOCHS,
    RANDOM_EPOCHS,
    SHORT,
    SHORT_SENSED,
    TEN_SEEDS,
    as_good_as,
    equals,
)

__all__ = ["ABLATION", "CATALOGUE", "COMPARISON", "LADDER", "PAPER", "WORLD", "Experiment", "Target", "with_settings"]

_BESIDE: Final = next_to_the_target()
_FIRST: Final = Target(
    "the first 1000 decisions at least the best learner's", 1, 1, "mean hits per 1000", 0.0, rivals=LEARNERS
)
_NEAR_BOUND: Final = 0.01 * FULL.network.weight_max
_WEIGHTS: Final = (
    Target("agreeing weights 1 mV above opposite ones in every seed", 10, 30, "least weight gap, mV", 1.0),
    Target(
        "no projection within 1 % of the upper bound",
        10,
        30,
        "most mean weight, mV",
        0.0,
        FULL.network.weight_max - _NEAR_BOUND,
    ),
    Target("no projection within 1 % of the lower bound", 10, 30, "least mean weight, mV", _NEAR_BOUND),
)
"""What the weights must show: the network has learned, and nothing drives its weights to a bound."""

PAPER: Final = (
    Experiment(
        "scla-dopamine-any-start", "paper", "SCLA with one dopamine, any-start",
        "Can one scalar teach network and automata?", with_settings(FULL, brain="scla-dopamine"), TEN_SEEDS,
        "scla-printed-any-start",
        (
            Target("at least 340 in epoch 1", 1, 1, "mean hits per 1000", 340.0),
            Target("at least 98.5 % of the ceiling on average", 5, 30, "mean percent of ceiling", 98.5),
            Target("no seed under 97 % of the ceiling", 5, 30, "worst seed percent of ceiling", 97.0),
            _FIRST,
            *_WEIGHTS,
        ),
    ),
    Experiment(
        "scla-dopamine-sensed-start", "paper", "SCLA with one dopamine, sensed-start",
        "And where the network decides every move?", with_settings(FULL_SENSED, brain="scla-dopamine"), TEN_SEEDS,
        "scla-printed-sensed-start",
        (
            Target("no seed under 97 % of the ceiling in epoch 1", 1, 1, "worst seed percent of ceiling", 97.0),
            Target("no seed under 99.8 % from epoch 2", 2, 30, "worst seed percent of ceiling", 99.8),
            *_WEIGHTS,
        ),
    ),
    Experiment(
        "scla-printed-any-start", "paper", "SCLA as printed, any-start",
        "Does SCLA find the shortest paths from everywhere?", with_settings(FULL, brain="scla-printed"), TEN_SEEDS,
        "automaton-any-start",
        (
            Target("at least 98.5 % of the ceiling on average", 11, 30, "mean percent of ceiling", 98.5),
            Target("no seed under 97 % of the ceiling", 11, 30, "worst seed percent of ceiling", 97.0),
            _FIRST,
        ),
    ),
    Experiment(
        "scla-printed-sensed-start", "paper", "SCLA as printed, sensed-start",
        "Does the network learn to move where the target is sensed?", with_settings(FULL_SENSED, brain="scla-printed"),
        TEN_SEEDS, "automaton-sensed-start",
        (
            Target("at least 970 in epoch 1 (paper: 784.2 on average)", 1, 1, "mean hits per 1000", 970.0),
            Target("at least 998 from epoch 2", 2, 30, "mean hits per 1000", 998.0),
        ),
    ),
    Experiment(
        "automaton-any-start", "paper", "automaton alone, any-start",
        "What do automata learn when only the move into the target is rewarded (paper: 115)?",
        with_settings(FULL, brain="automaton", epochs=AUTOMATON_EPOCHS), TEN_SEEDS, "random-any-start",
        (equals(_BESIDE, *AUTOMATON_SPAN, margin=6.0),),
    ),
    Experiment(
        "automaton-sensed-start", "paper", "automaton alone, sensed-start",
        "And where it always starts next to the target?",
        with_settings(FULL_SENSED, brain="automaton", epochs=AUTOMATON_EPOCHS), TEN_SEEDS, "random-sensed-start",
    ),
)  # fmt: skip

COMPARISON: Final = (
    Experiment(
        "network-any-start", "comparison", "network alone, any-start",
        "What is the network worth without automata? Exactly the four cells next to the target.",
        with_settings(BRIEF, brain="network"), TEN_SEEDS, "random-any-start",
        (equals(_BESIDE, 2, BRIEF_EPOCHS, margin=6.0),),
    ),
    Experiment(
        "random-any-start", "comparison", "random walk, any-start", "What does chance earn?",
        with_settings(FULL, brain="random", epochs=RANDOM_EPOCHS), TEN_SEEDS, None,
        (equals(random_walk("any-start"), 1, RANDOM_EPOCHS, margin=2.0),),
    ),
    Experiment(
        "random-sensed-start", "comparison", "random walk, sensed-start", "And from next to the target?",
        with_settings(FULL_SENSED, brain="random", epochs=RANDOM_EPOCHS), TEN_SEEDS, None,
        (equals(random_walk("sensed-start"), 1, RANDOM_EPOCHS, margin=2.0),),
    ),
    Experiment(
        "shortest-path-any-start", "comparison", "shortest path, any-start", "Does the robot reach the ceiling?",
        with_settings(BRIEF, brain="shortest-path"), TEN_SEEDS,
    ),
    Experiment(
        "shortest-path-sensed-start", "comparison", "shortest path, sensed-start", "And the other ceiling?",
        with_settings(BRIEF_SENSED, brain="shortest-path"), TEN_SEEDS,
    ),
)  # fmt: skip


def _noisy(probability: float) -> tuple[Experiment, ...]:
    name, last = f"action-noise-{100 * probability:.0f}", BRIEF_EPOCHS
    printed, ours = (f"{name}-{brain}-any-start" for brain in ("scla-printed", "scla-dopamine"))
    return in_world(
        name,
        f"action noise {probability}",
        f"Does it learn where {100 * probability:.0f} % of the moves go another way?",
        BRIEF,
        targets={
            printed: (Target("at least 93 % of its ceiling", 3, last, "mean percent of ceiling", 93.0),),
            ours: (as_good_as(printed, 3, last, margin=3.0),),
        },
        task={"action_noise": probability},
    )


def _held_out(
    cells: tuple[int, int], target: tuple[int, int], base: RunConfig, percent: float, *who: str
) -> tuple[Experiment, ...]:
    (width, height), (x, y), last = cells, target, base.epochs
    name = f"grid-{width}x{height}-{x}-{y}"
    wanted = Target(f"at least {percent:g} % of its ceiling by epoch {last}", last, last, "mean percent of ceiling",
                    percent)  # fmt: skip
    targets: dict[str, tuple[Target, ...]] = {f"{name}-{brain}-any-start": (wanted,) for brain in who}
    if len(who) > 1:
        targets[f"{name}-{who[1]}-any-start"] += (as_good_as(f"{name}-{who[0]}-any-start", last, last, margin=3.0),)
    return in_world(
        name,
        f"{width}x{height}, target ({x}, {y})",
        "Does it learn in another arena with unchanged settings?",
        base,
        who=who,
        targets=targets,
        grid={"cells": cells, "target": target},
    )


_LARGE: Final = with_settings(FULL, epochs=LARGE_GRID_EPOCHS)

WORLD: Final = (
    *BODIES,
    *JUMPS,
    *_noisy(0.1),
    *_noisy(0.3),
    *_held_out((10, 10), (1, 1), _LARGE, 93.0, "scla-printed", "scla-dopamine"),
    *_held_out((5, 5), (1, 1), SHORT, 95.0, "scla-dopamine"),
    *_held_out((5, 5), (5, 2), SHORT, 95.0, "scla-dopamine"),
    *_held_out((7, 7), (4, 4), BRIEF, 95.0, "scla-dopamine"),
    *in_world(
        "closed-cells", "closed cells (2, 3) (3, 2) (4, 4)", "Does it find its way around walls?", SHORT,
        who=("scla-dopamine",), grid={"closed_cells": ((2, 3), (3, 2), (4, 4))},
    ),
)  # fmt: skip


def _ablation(name: str, title: str, question: str, base: RunConfig = SHORT, **settings: Any) -> Experiment:
    """Return the printed form with one setting changed."""
    config = with_settings(base, brain="scla-printed", **settings)
    return Experiment(name, "ablation", title, question, config, TEN_SEEDS, f"scla-printed-{base.protocol}")


def _of_dopamine(name: str, title: str, question: str, base: RunConfig, **settings: Any) -> Experiment:
    """Return the form with one dopamine with one of its own settings changed."""
    config = with_settings(base, brain="scla-dopamine", brain_settings=settings)
    return Experiment(
        f"dopamine-{name}", "ablation", title, question, config, TEN_SEEDS, f"scla-dopamine-{base.protocol}"
    )


def _automata(name: str, title: str, question: str, **automaton: Any) -> Experiment:
    """Return the form with one dopamine with another setting of its automata."""
    return dataclasses.replace(
        _of_dopamine(name, title, question, SHORT),
        config=with_settings(SHORT, brain="scla-dopamine", automaton=automaton),
    )


ABLATION: Final = (
    _of_dopamine("no-burst", "no efference copy", "Is the executed direction's burst needed?", SHORT_SENSED,
                 burst_ms=0.0),
    _of_dopamine("late", "released as the move ends", "Does the leak onto the next decision matter?", SHORT_SENSED,
                 released_at="end"),
    _of_dopamine("rate-expectation", "expectation read from the neurons", "Can the winner's rate be the critic?",
                 SHORT_SENSED, expectation="rate"),
    _of_dopamine("release-0.1", "release 0.1", "Less dopamine?", SHORT_SENSED, release=0.1),
    _of_dopamine("release-1", "release 1", "More dopamine?", SHORT_SENSED, release=1.0),
    _of_dopamine("expectation-rate-0.05", "expectation rate 0.05", "A slower expectation?", SHORT_SENSED,
                 expectation_rate=0.05),
    _of_dopamine("expectation-rate-0.5", "expectation rate 0.5", "A faster expectation?", SHORT_SENSED,
                 expectation_rate=0.5),
    _of_dopamine("least-0", "least expectation 0", "May a hit be wholly unexpected?", SHORT_SENSED,
                 least_expectation=0.0),
    _of_dopamine("no-undo", "the way back not rewarded", "What is the return after a dip worth?", SHORT, undo=False),
    _of_dopamine("no-gate", "dopamine at the network everywhere", "Does progress drive the weights up?", SHORT,
                 gate=False),
    _automata("reward-rate-0.1", "reward rate 0.1", "Slower rewards?", reward_rate=0.1),
    _automata("reward-rate-0.9", "reward rate 0.9", "Faster rewards?", reward_rate=0.9),
    _automata("penalty-rate-0.05", "penalty rate 0.05", "Milder penalties?", penalty_rate=0.05),
    _automata("penalty-rate-0.5", "penalty rate 0.5", "Harder penalties?", penalty_rate=0.5),
    _ablation("no-local-rule", "distal reward only", "Is dopamine on arrival enough?", automaton={"local_rule": False}),
    _ablation("no-distal-reward", "local rule only", "Is the local rule enough?", automaton={"distal_reward": False}),
    _ablation("no-bump-penalty", "bumps not penalised", "What is the wall's penalty worth?",
              automaton={"bump_penalty": False}),
    _ablation("reward-inaction", "scheme L_R-I", "Without penalties?", automaton={"scheme": "reward-inaction"}),
    _ablation("reward-epsilon-penalty", "scheme L_R-epsilon-P", "With small penalties?",
              automaton={"scheme": "reward-epsilon-penalty"}),
    _ablation("opposite-pair", "scheme opposite-pair", "The paper's own text?", automaton={"scheme": "opposite-pair"}),
    _ablation("no-inhibition", "no inhibition", "Do the motors need to compete?", SHORT_SENSED,
              network={"inhibitory_to_motor": 0.0}),
    _ablation("network-frozen", "network frozen while driving", "What does one clock cost or bring?", SHORT_SENSED,
              network={"runs_while_driving": False}),
    *(
        _ablation(f"dopamine-delay-{delay_s:g}", f"dopamine {delay_s:g} s late",
                  "How far does the eligibility trace bridge?", SHORT_SENSED, plasticity={"dopamine_delay_s": delay_s})
        for delay_s in (0.5, 2.0, 5.0)
    ),
    _ablation("scalar-dopamine", "one scalar without expectation", "Is one signal for all connections enough?",
              SHORT_SENSED, plasticity={"modulation": "scalar"}),
)  # fmt: skip

CATALOGUE: Final = PAPER + COMPARISON + LADDER + WORLD + ABLATION
