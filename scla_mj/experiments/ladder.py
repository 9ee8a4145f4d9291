"""The ladder, SCLA's parts alone and other learners with its senses, and the worlds that some of them are driven in."""

from __future__ import annotations

import dataclasses
from typing import Any, Final

from scla_mj.config import RunConfig
from scla_mj.disturbances import DisturbanceConfig, with_sets
from scla_mj.experiments.exact import coin
from scla_mj.experiments.experiment import Experiment, Target, with_settings
from scla_mj.experiments.scale import (
    JUMP_EPOCH,
    MEDIUM,
    MEDIUM_SENSED,
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


def _rung(
    name: str, brain: str, title: str, question: str, *targets: Target, base: RunConfig = MEDIUM, **settings: Any
) -> Experiment:
    """Return one step of the ladder, compared with SCLA; `settings` are the brain's own."""
    protocol = base.protocol
    config = with_settings(base, brain=brain, brain_settings=settings)
    return Experiment(
        f"{name}-{protocol}", "ladder", f"{title}, {protocol}", question, config, TEN_SEEDS, f"scla-{protocol}", targets
    )


_SENSES: Final = "And where it moves to a target that it senses?"

LADDER: Final = (
    _rung("automata-everywhere", "automata-everywhere", "SCLA without its network", "What is the network worth?",
          as_good_as("scla-any-start", 1, 1, margin=5.0), as_good_as("scla-any-start", 6, 14, margin=1.5)),
    _rung("automata-reflex", "automata-reflex", "automata with a perfect reflex", "What could it be worth at most?",
          as_good_as("scla-any-start", 6, 14, margin=1.5)),
    _rung("automata-coin", "automata-coin", "automata with a coin", "And at least?",
          equals(coin("any-start"), 6, 14, margin=6.0)),
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
          base=MEDIUM_SENSED),
    _rung("automata-coin", "automata-coin", "automata with a coin", "What is chance?",
          equals(coin("sensed-start"), 2, 14, margin=6.0), base=MEDIUM_SENSED),
    _rung("q-learning", "q-learning", "Q-learning", "What does it need for one bit in four cells?", base=MEDIUM_SENSED),
    _rung("dyna-q", "dyna-q", "Dyna-Q", "And with a model?", base=MEDIUM_SENSED),
    _rung("actor-critic", "actor-critic", "actor-critic", "And with a policy?", base=MEDIUM_SENSED),
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
        )
        for who, words, own in _WHO
    )


def _crossed(epoch: int, words: str) -> tuple[Experiment, ...]:
    name, question = f"crossed-from-{epoch}", "Does it learn from reward, where the labels are wrong?"
    title, task = f"wheels crossed {words}", {"crossed_epoch": epoch}
    return tuple(
        experiment for base in (MEDIUM, MEDIUM_SENSED) for experiment in _bodies(name, title, question, base, task=task)
    )


BODIES: Final = (
    *_crossed(1, "from the start"),
    *_crossed(JUMP_EPOCH, f"at epoch {JUMP_EPOCH}"),
    *_bodies(
        "disturbed", "disturbed body, own sensors", "Does it learn on a body whose place it has to find out?", SHORT,
        disturbance=dataclasses.asdict(with_sets(DisturbanceConfig(), ["all"])), localisation="sensors",
    ),
)  # fmt: skip
