"""Every experiment of the report as data: a configuration, its seeds, and what must come out of it."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, Final, Literal, NamedTuple

from scla_mj.config import RunConfig

Group = Literal["paper", "comparison", "world", "ablation"]
Statistic = Literal["mean hits per 1000", "mean percent of ceiling", "worst seed percent of ceiling", "interval holds"]

PAPER_EPOCHS: Final = 30
TEN_SEEDS: Final = tuple(range(10))
FIVE_SEEDS: Final = tuple(range(5))
_ABLATION_EPOCHS: Final = 5
_WORLD_EPOCHS: Final = 14
_JUMP_EPOCH: Final = 11


class Target(NamedTuple):
    """What a result must reach over epochs `first_epoch` to `last_epoch`.

    The statistic is the mean over seeds of hits per 1000 decisions or of the percent of ceiling, or the worst seed's;
    it must lie in [low, high]. For "interval holds" the 95 % interval of the mean hits per 1000 must hold low (=
    high).
    """

    text: str
    first_epoch: int
    last_epoch: int
    statistic: Statistic
    low: float
    high: float = float("inf")


@dataclass(frozen=True)
class Experiment:
    """One row of the report; `config.seed` is replaced by each of `seeds`."""

    name: str
    group: Group
    title: str
    question: str
    config: RunConfig
    seeds: tuple[int, ...]
    baseline: str | None = None
    targets: tuple[Target, ...] = ()


def with_settings(config: RunConfig, **settings: Any) -> RunConfig:
    """Return the configuration with some settings replaced; a section's fields are given as a dict under its name."""
    replaced = {
        name: dataclasses.replace(getattr(config, name), **value) if isinstance(value, dict) else value
        for name, value in settings.items()
    }
    return dataclasses.replace(config, **replaced)


_FULL: Final = RunConfig(epochs=PAPER_EPOCHS, telemetry="off")
_SENSED: Final = with_settings(_FULL, protocol="sensed-start")
_WORLD: Final = with_settings(_FULL, epochs=_WORLD_EPOCHS)
_SHORT: Final = with_settings(_FULL, epochs=_ABLATION_EPOCHS)
_SHORT_SENSED: Final = with_settings(_SENSED, epochs=_ABLATION_EPOCHS)

# The exact figures come from scla_mj.markov (tests/test_markov.py): the paper's grid, any start, and sensed start.
_RANDOM_ANY: Final = 31.58
_RANDOM_SENSED: Final = 41.67
_BESIDE_TARGET: Final = 115.38


def _holds(value: float, first: int, last: int) -> Target:
    return Target(f"{value} inside the 95 % interval", first, last, "interval holds", value, value)


PAPER: Final = (
    Experiment(
        "scla-any-start", "paper", "SCLA, any-start", "Does SCLA find the shortest paths from everywhere?",
        _FULL, TEN_SEEDS, "automaton-any-start",
        (
            Target("at least 98.5 % of the ceiling on average", 11, 30, "mean percent of ceiling", 98.5),
            Target("no seed under 97 % of the ceiling", 11, 30, "worst seed percent of ceiling", 97.0),
            Target("the first 1000 decisions at least 319", 1, 1, "mean hits per 1000", 319.0),
        ),
    ),
    Experiment(
        "scla-sensed-start", "paper", "SCLA, sensed-start",
        "Does the network learn to move where the target is sensed?", _SENSED, TEN_SEEDS, "automaton-sensed-start", (
            Target("at least 970 in epoch 1 (paper: 784.2 on average)", 1, 1, "mean hits per 1000", 970.0),
            Target("at least 998 from epoch 2", 2, 30, "mean hits per 1000", 998.0),
        ),
    ),
    Experiment(
        "automaton-any-start", "paper", "automaton alone, any-start",
        "What do automata learn when only the move into the target is rewarded (paper: 115)?",
        with_settings(_FULL, brain="automaton"), TEN_SEEDS, "random-any-start",
        (
            _holds(_BESIDE_TARGET, 11, 20),
            Target("within 6 of 115.38", 11, 20, "mean hits per 1000", _BESIDE_TARGET - 6, _BESIDE_TARGET + 6),
        ),
    ),
    Experiment(
        "automaton-sensed-start", "paper", "automaton alone, sensed-start",
        "And where it always starts beside the target?",
        with_settings(_SENSED, brain="automaton"), TEN_SEEDS, "random-sensed-start",
    ),
)  # fmt: skip

COMPARISON: Final = (
    Experiment(
        "network-any-start", "comparison", "network alone, any-start",
        "What is the network worth without automata? Exactly the four cells beside the target.",
        with_settings(_FULL, brain="network"), TEN_SEEDS, "random-any-start", (_holds(_BESIDE_TARGET, 11, 30),),
    ),
    Experiment(
        "random-any-start", "comparison", "random walk, any-start", "The floor of the scale.",
        with_settings(_FULL, brain="random"), TEN_SEEDS, None, (_holds(_RANDOM_ANY, 1, 30),),
    ),
    Experiment(
        "random-sensed-start", "comparison", "random walk, sensed-start", "The floor of the other scale.",
        with_settings(_SENSED, brain="random"), TEN_SEEDS, None, (_holds(_RANDOM_SENSED, 1, 30),),
    ),
    Experiment(
        "q-learning-any-start", "comparison", "Q-learning, optimistic and greedy, any-start",
        "How does tabular Q-learning at its best compare?",
        with_settings(_WORLD, brain="q-learning"), TEN_SEEDS, "scla-any-start",
    ),
    Experiment(
        "q-learning-epsilon-any-start", "comparison", "Q-learning, 0.1-greedy from zero, any-start",
        "And as it is usually written down?",
        with_settings(_WORLD, brain="q-learning", q_learning={"initial_value": 0.0, "epsilon": 0.1}), TEN_SEEDS,
        "scla-any-start",
    ),
    Experiment(
        "shortest-path-any-start", "comparison", "shortest path, any-start", "The ceiling, driven.",
        with_settings(_WORLD, brain="shortest-path"), FIVE_SEEDS,
    ),
    Experiment(
        "shortest-path-sensed-start", "comparison", "shortest path, sensed-start", "The other ceiling, driven.",
        with_settings(_WORLD, brain="shortest-path", protocol="sensed-start"), FIVE_SEEDS,
    ),
)  # fmt: skip


def _noisy(probability: float) -> Experiment:
    return Experiment(
        f"noisy-floor-{round(100 * probability)}",
        "world",
        f"SCLA, non-deterministic floor, p = {probability}",
        f"Does it learn where one move in {round(1 / probability)} goes another way?",
        with_settings(_WORLD, world={"direction_noise": probability}),
        TEN_SEEDS,
        targets=(Target("at least 93 % of that MDP's ceiling", 11, _WORLD_EPOCHS, "mean percent of ceiling", 93.0),),
    )


def _large(x: int, y: int) -> Experiment:
    return Experiment(
        f"grid-10x10-{x}-{y}",
        "world",
        f"SCLA, 10x10, target ({x}, {y})",
        "Does it scale to a hundred cells without a changed setting?",
        with_settings(_FULL, epochs=10, grid={"cells": (10, 10), "target": (x, y)}),
        FIVE_SEEDS,
        targets=(Target("at least 93 % of its ceiling by epoch 10", 10, 10, "mean percent of ceiling", 93.0),),
    )


WORLD: Final = (
    Experiment(
        "target-jump", "world", "SCLA, target jumps to (1, 5) at epoch 11",
        "Does it find a target that has moved, without a hint?",
        with_settings(_WORLD, world={"jump_epoch": _JUMP_EPOCH, "jump_target": (1, 5)}), TEN_SEEDS,
        targets=(
            Target("at least 90 % of the new ceiling in epoch 12", 12, 12, "mean percent of ceiling", 90.0),
            Target("at least 95 % in epoch 13", 13, 13, "mean percent of ceiling", 95.0),
        ),
    ),
    _noisy(0.1),
    _noisy(0.3),
    _large(5, 5),
    _large(1, 1),
    _large(10, 4),
    Experiment(
        "closed-cells", "world", "SCLA, closed cells (2, 3) (3, 2) (4, 4)", "Does it find its way around walls?",
        with_settings(_SHORT, grid={"closed_cells": ((2, 3), (3, 2), (4, 4))}), FIVE_SEEDS,
    ),
)  # fmt: skip


def _ablation(name: str, title: str, question: str, base: RunConfig = _SHORT, **settings: Any) -> Experiment:
    baseline = "scla-any-start" if base.protocol == "any-start" else "scla-sensed-start"
    return Experiment(name, "ablation", title, question, with_settings(base, **settings), FIVE_SEEDS, baseline)


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
        "no-inhibition", "no inhibition", "Do the motors need to compete?", _SHORT_SENSED,
        network={"inhibitory_to_motor": 0.0},
    ),
    _ablation(
        "network-frozen", "network frozen while driving", "What does one clock cost or bring?", _SHORT_SENSED,
        network={"runs_while_driving": False},
    ),
    *(
        _ablation(
            f"dopamine-delay-{delay_s:g}", f"dopamine {delay_s:g} s late",
            "How far does the eligibility trace bridge?", _SHORT_SENSED, plasticity={"dopamine_delay_s": delay_s},
        )
        for delay_s in (0.5, 1.0, 2.0, 5.0)
    ),
    _ablation(
        "scalar-dopamine", "one scalar dopamine", "Is one signal for all connections enough?", _SHORT_SENSED,
        plasticity={"modulation": "scalar"},
    ),
)  # fmt: skip

CATALOGUE: Final = PAPER + COMPARISON + WORLD + ABLATION
