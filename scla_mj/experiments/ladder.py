"""The ladder, SCLA's parts alone and other learners with its senses, and the worlds that some of them are driven in."""

from __future__ import annotations

import dataclasses
from typing import Any, Final

from scla_mj.config import RunConfig
from scla_mj.disturbances import DisturbanceConfig, with_sets
from scla_mj.experiments.exact import coin
from scla_mj.experiments.experiment import Experiment, Target, with_settings
from scla_mj.experiments.scale import (
    CROSSED_EPOCHS,
    FULL,
    FULL_SENSED,
    JUMP_EPOCH,
    LADDER_EPOCHS,
    SHORT,
    TEN_SEEDS,
    as_good_as,
    equals,
)

LEARNERS: Final = (
    "q-learning-any-start", "q-learning-epsilon-any-start", "q-learning-reflex-any-start", "q-lambda-any-start",
    "q-lambda-reflex-any-start", "dyna-q-any-start", "dyna-q-reflex-any-start", "actor-critic-any-start",
    "actor-critic-reflex-any-start",
)  # fmt: skip


_BRIEF: Final = with_settings(FULL, epochs=LADDER_EPOCHS)
_BRIEF_SENSED: Final = with_settings(_BRIEF, protocol="sensed-start")

_OF_DOPAMINE: Final = {
    "scla-dopamine-any-start": (
        Target("at least 340 in epoch 1", 1, 1, "mean hits per 1000", 340.0),
        Target("at least 98.5 % of the ceiling on average", 5, 30, "mean percent of ceiling", 98.5),
        Target("no seed under 97 % of the ceiling", 5, 30, "worst seed percent of ceiling", 97.0),
    ),
    "scla-dopamine-sensed-start": (
        Target("no seed under 97 % of the ceiling in epoch 1", 1, 1, "worst seed percent of ceiling", 97.0),
        Target("no seed under 99.8 % from epoch 2", 2, 30, "worst seed percent of ceiling", 99.8),
    ),
    "crossed-from-1-scla-dopamine-any-start": (as_good_as("scla-dopamine-any-start", 2, LADDER_EPOCHS, margin=3.0),),
    "crossed-from-1-scla-dopamine-sensed-start": (
        as_good_as("scla-dopamine-sensed-start", 2, LADDER_EPOCHS, margin=3.0),
    ),
    "crossed-from-11-scla-dopamine-any-start": (
        Target("at least 90 % of the ceiling in epoch 14", 14, 14, "mean percent of ceiling", 90.0),
        Target("at least 97 % from epoch 18", 18, 18, "mean percent of ceiling", 97.0),
    ),
    "crossed-from-11-scla-dopamine-sensed-start": (
        Target("at least 95 % of the ceiling in epoch 13", 13, 13, "mean percent of ceiling", 95.0),
    ),
}
"""What one dopamine must reach, by experiment."""


def _rung(
    name: str, brain: str, title: str, question: str, *targets: Target, base: RunConfig = _BRIEF, **settings: Any
) -> Experiment:
    """Return one step of the ladder, compared with SCLA; `settings` are the brain's own."""
    protocol = base.protocol
    config = with_settings(base, brain=brain, brain_settings=settings)
    return Experiment(
        f"{name}-{protocol}",
        "ladder",
        f"{title}, {protocol}",
        question,
        config,
        TEN_SEEDS,
        f"scla-{protocol}",
        targets or _OF_DOPAMINE.get(f"{name}-{protocol}", ()),
    )


_SENSES: Final = "And where it moves to a target that it senses?"

LADDER: Final = (
    *(_rung("scla-dopamine", "scla-dopamine", "SCLA with one dopamine", "Can one scalar teach network and automata?",
            base=base) for base in (FULL, FULL_SENSED)),
    _rung("automata-everywhere", "automata-everywhere", "SCLA without its network", "What is the network worth?",
          as_good_as("scla-any-start", 1, 1, margin=5.0), as_good_as("scla-any-start", 3, 6, margin=1.5)),
    _rung("automata-reflex", "automata-reflex", "automata with a perfect reflex", "What could it be worth at most?",
          as_good_as("scla-any-start", 3, 6, margin=1.5)),
    _rung("automata-coin", "automata-coin", "automata with a coin", "And at least?",
          equals(coin("any-start"), 3, 6, margin=6.0)),
    _rung("cell-states", "cell-states", "cell states, followed greedily",
          "What do the cells' values earn without automata?"),
    _rung("q-learning-reflex", "q-learning", "Q-learning with a reflex", _SENSES, sensing="reflex"),
    _rung("q-lambda", "q-lambda", "Q(lambda)", "Are traces quicker?"),
    _rung("q-lambda-reflex", "q-lambda", "Q(lambda) with a reflex", _SENSES, sensing="reflex", trace_decay=0.7),
    _rung("dyna-q", "dyna-q", "Dyna-Q", "Is a learned model quicker?"),
    _rung("dyna-q-reflex", "dyna-q", "Dyna-Q with a reflex", _SENSES, sensing="reflex"),
    _rung("actor-critic", "actor-critic", "actor-critic", "What does the discrete form of spiking actor-critics earn?"),
    _rung("actor-critic-reflex", "actor-critic", "actor-critic with a reflex", _SENSES, sensing="reflex"),
    _rung("automata-everywhere", "automata-everywhere", "SCLA without its network", "What is the network worth?",
          base=_BRIEF_SENSED),
    _rung("automata-coin", "automata-coin", "automata with a coin", "What is chance?",
          equals(coin("sensed-start"), 2, 6, margin=6.0), base=_BRIEF_SENSED),
    _rung("q-learning", "q-learning", "Q-learning", "What does it need for one bit in four cells?", base=_BRIEF_SENSED),
    _rung("dyna-q", "dyna-q", "Dyna-Q", "And with a model?", base=_BRIEF_SENSED),
    _rung("actor-critic", "actor-critic", "actor-critic", "And with a policy?", base=_BRIEF_SENSED),
)  # fmt: skip


_WHO: Final[tuple[tuple[str, str, dict[str, Any]], ...]] = (
    ("scla", "SCLA", {}),
    ("scla-dopamine", "SCLA with one dopamine", {}),
    ("automata-everywhere", "SCLA without its network", {}),
    ("q-learning", "Q-learning", {}),
    ("dyna-q-reflex", "Dyna-Q with a reflex", {"sensing": "reflex"}),
)
"""Who is driven in worlds that tell reward from label and simulation from body: name, title, settings of its own."""


def _bodies(name: str, title: str, question: str, base: RunConfig, **settings: Any) -> tuple[Experiment, ...]:
    """Return the experiments of all of `_WHO` in one world."""
    protocol = base.protocol
    return tuple(
        Experiment(
            f"{name}-{who}-{protocol}",
            "world",
            f"{words}, {title}, {protocol}",
            question,
            with_settings(base, brain=who.removesuffix("-reflex"), brain_settings=own, **settings),
            TEN_SEEDS,
            targets=_OF_DOPAMINE.get(f"{name}-{who}-{protocol}", ()),
        )
        for who, words, own in _WHO
    )


def _crossed(epoch: int, epochs: int, words: str) -> tuple[Experiment, ...]:
    name, question = f"crossed-from-{epoch}", "Does it learn from reward, where the labels are wrong?"
    title, task = f"wheels crossed {words}", {"crossed_epoch": epoch}
    bases = (with_settings(base, epochs=epochs) for base in (FULL, FULL_SENSED))
    return tuple(experiment for base in bases for experiment in _bodies(name, title, question, base, task=task))


BODIES: Final = (
    *_crossed(1, LADDER_EPOCHS, "from the start"),
    *_crossed(JUMP_EPOCH, CROSSED_EPOCHS, f"at epoch {JUMP_EPOCH}"),
    *_bodies(
        "disturbed", "disturbed body, own sensors", "Does it learn on a body whose place it has to find out?", SHORT,
        disturbance=dataclasses.asdict(with_sets(DisturbanceConfig(), ["all"])), localisation="sensors",
    ),
)  # fmt: skip
