"""The ladder, SCLA's parts alone and other learners with its senses, and the worlds that some of them are driven in."""

from __future__ import annotations

import dataclasses
from typing import Any, Final

from scla_mj.config import RunConfig
from scla_mj.disturbances import DisturbanceConfig, with_sets
from scla_mj.experiments.exact import coin
from scla_mj.experiments.experiment import Experiment, Target, with_settings
from scla_mj.experiments.scale import (
    BRIEF,
    BRIEF_EPOCHS,
    BRIEF_SENSED,
    CROSSED_EPOCHS,
    FIRST_MARGIN,
    FULL,
    FULL_SENSED,
    JUMP_EPOCH,
    JUMP_EPOCHS,
    SETTLED_MARGIN,
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


_OF_DOPAMINE: Final = {
    "crossed-from-1-scla-dopamine-any-start": (as_good_as("scla-dopamine-any-start", 2, BRIEF_EPOCHS, margin=3.0),),
    "crossed-from-1-scla-dopamine-sensed-start": (
        as_good_as("scla-dopamine-sensed-start", 2, BRIEF_EPOCHS, margin=3.0),
    ),
    "crossed-from-11-scla-dopamine-any-start": (
        Target("at least 90 % of the ceiling in epoch 14", 14, 14, "mean percent of ceiling", 90.0),
        Target("at least 97 % from epoch 18", 18, 18, "mean percent of ceiling", 97.0),
    ),
    "crossed-from-11-scla-dopamine-sensed-start": (
        Target("at least 95 % of the ceiling in epoch 13", 13, 13, "mean percent of ceiling", 95.0),
    ),
}
"""What one dopamine must reach in another body, by experiment."""


def _rung(
    name: str, brain: str, title: str, question: str, *targets: Target, base: RunConfig = BRIEF, **settings: Any
) -> Experiment:
    """Return one step of the ladder, compared with SCLA; `settings` are the brain's own."""
    protocol = base.protocol
    config = with_settings(base, brain=brain, brain_settings=settings)
    title = f"{title}, {protocol}"
    baseline = f"scla-dopamine-{protocol}"
    return Experiment(f"{name}-{protocol}", "ladder", title, question, config, TEN_SEEDS, baseline, targets)


_SENSES: Final = "And where it moves to a target that it senses?"

LADDER: Final = (
    _rung("automata-everywhere", "automata-everywhere", "SCLA without its network", "What is the network worth?",
          as_good_as("scla-printed-any-start", 1, 1, margin=FIRST_MARGIN),
          as_good_as("scla-printed-any-start", 3, 6, margin=SETTLED_MARGIN)),
    _rung("automata-reflex", "automata-reflex", "automata with a perfect reflex", "What could it be worth at most?",
          as_good_as("scla-printed-any-start", 3, 6, margin=SETTLED_MARGIN)),
    _rung("automata-coin", "automata-coin", "automata with a coin", "And at least?",
          equals(coin("any-start"), 3, 6, margin=6.0)),
    _rung("cell-states", "cell-states", "cell states, followed greedily",
          "What do the cells' values earn without automata?"),
    _rung("q-learning", "q-learning", "Q-learning, optimistic and greedy",
          "How does tabular Q-learning at its best compare?"),
    _rung("q-learning-epsilon", "q-learning", "Q-learning, 0.1-greedy from zero", "And as it is usually written down?",
          initial_value=0.0, epsilon=0.1),
    _rung("q-learning-reflex", "q-learning", "Q-learning with a reflex", _SENSES, sensing="reflex"),
    _rung("q-lambda", "q-lambda", "Q(lambda)", "Are traces quicker?"),
    _rung("q-lambda-reflex", "q-lambda", "Q(lambda) with a reflex", _SENSES, sensing="reflex", trace_decay=0.7),
    _rung("dyna-q", "dyna-q", "Dyna-Q", "Is a learned model quicker?"),
    _rung("dyna-q-reflex", "dyna-q", "Dyna-Q with a reflex", _SENSES, sensing="reflex"),
    _rung("actor-critic", "actor-critic", "actor-critic", "What does the discrete form of spiking actor-critics earn?"),
    _rung("actor-critic-reflex", "actor-critic", "actor-critic with a reflex", _SENSES, sensing="reflex"),
    _rung("actor-critic-optimistic", "actor-critic", "actor-critic, optimistic as potjans is",
          "What does it earn with the discount and the first values of its spiking form?",
          discount=0.8, initial_value=0.6),
    _rung("potjans", "potjans", "spiking actor-critic (Potjans et al.)", "And its spiking form, with one dopamine?",
          Target("at least 97 % of the ceiling in epochs 3 to 6", 3, BRIEF_EPOCHS, "mean percent of ceiling", 97.0),
          as_good_as("actor-critic-optimistic-any-start", 1, 1, margin=10.0),
          as_good_as("actor-critic-optimistic-any-start", 3, BRIEF_EPOCHS, margin=3.0)),
    _rung("potjans-clipped", "potjans", "spiking actor-critic, dips clipped", "What are the dips worth?",
          clip_dips=True),
    _rung("potjans-clipped-pessimistic", "potjans", "spiking actor-critic, dips clipped, values from 0",
          "And where no value has to fall?",
          clip_dips=True, initial_value=0.0),
    _rung("automata-everywhere", "automata-everywhere", "SCLA without its network", "What is the network worth?",
          base=BRIEF_SENSED),
    _rung("automata-coin", "automata-coin", "automata with a coin", "What is chance?",
          equals(coin("sensed-start"), 2, 6, margin=6.0), base=BRIEF_SENSED),
    _rung("q-learning", "q-learning", "Q-learning", "What does it need for one bit in four cells?", base=BRIEF_SENSED),
    _rung("dyna-q", "dyna-q", "Dyna-Q", "And with a model?", base=BRIEF_SENSED),
    _rung("actor-critic", "actor-critic", "actor-critic", "And with a policy?", base=BRIEF_SENSED),
)  # fmt: skip


_SCLA: Final = ("scla-printed", "scla-dopamine")
_RIVALS: Final = ("automata-everywhere", "dyna-q-reflex")
_TITLES: Final = {
    "scla-printed": "SCLA as printed",
    "scla-dopamine": "SCLA with one dopamine",
    "automata-everywhere": "SCLA without its network",
    "dyna-q": "Dyna-Q",
    "dyna-q-reflex": "Dyna-Q with a reflex",
    "potjans": "spiking actor-critic (Potjans et al.)",
}
"""Who is driven in worlds that tell reward from label and simulation from body."""


def in_world(
    name: str,
    title: str,
    question: str,
    base: RunConfig,
    *,
    who: tuple[str, ...] = _SCLA,
    targets: dict[str, tuple[Target, ...]] | None = None,
    **settings: Any,
) -> tuple[Experiment, ...]:
    """Return the experiments of several brains in one world, compared with the first; `targets` are by experiment."""
    found = []
    for brain in who:
        own = {"sensing": "reflex"} if brain.endswith("-reflex") else {}
        config = with_settings(base, brain=brain.removesuffix("-reflex"), brain_settings=own, **settings)
        full = f"{name}-{brain}-{base.protocol}"
        wanted = (targets or _OF_DOPAMINE).get(full, ())
        full_title = f"{_TITLES[brain]}, {title}, {base.protocol}"
        baseline = f"{name}-{who[0]}-{base.protocol}" if brain != who[0] else None
        found.append(Experiment(full, "world", full_title, question, config, TEN_SEEDS, baseline, wanted))
    return tuple(found)


_CROSSED: Final = "Does it learn from reward, where the labels are wrong?"


def _crossed(epoch: int, epochs: int, words: str) -> tuple[Experiment, ...]:
    name, question = f"crossed-from-{epoch}", _CROSSED
    title, task = f"wheels crossed {words}", {"crossed_epoch": epoch}
    any_start, sensed_start = (with_settings(base, epochs=epochs) for base in (FULL, FULL_SENSED))
    return (
        *in_world(name, title, question, any_start, who=(*_SCLA, "dyna-q", "dyna-q-reflex"), task=task),
        *in_world(name, title, question, sensed_start, who=(*_SCLA, "dyna-q"), task=task),
    )


BODIES: Final = (
    *_crossed(1, BRIEF_EPOCHS, "from the start"),
    *_crossed(JUMP_EPOCH, CROSSED_EPOCHS, f"at epoch {JUMP_EPOCH}"),
    *in_world("crossed-from-1", "wheels crossed from the start", _CROSSED, BRIEF, who=("potjans",),
              task={"crossed_epoch": 1}),
    *in_world(
        "disturbed", "disturbed body, own sensors", "Does it learn on a body whose place it has to find out?", SHORT,
        who=(*_SCLA, *_RIVALS),
        targets={"disturbed-scla-dopamine-any-start":
                 (as_good_as("disturbed-scla-printed-any-start", 3, SHORT.epochs, margin=3.0),)},
        disturbance=dataclasses.asdict(with_sets(DisturbanceConfig(), ["all"])), localisation="sensors",
    ),
)  # fmt: skip

JUMPS: Final = in_world(
    "target-jump",
    f"target jumps to (1, 5) at epoch {JUMP_EPOCH}",
    "Does it find a target that has moved, without being informed?",
    with_settings(FULL, epochs=JUMP_EPOCHS),
    who=(*_SCLA, "dyna-q-reflex"),
    targets={
        "target-jump-scla-dopamine-any-start": (
            Target("at least 85 % of the new ceiling in epoch 12", 12, 12, "mean percent of ceiling", 85.0),
            Target("at least 97 % in epoch 14", 14, 14, "mean percent of ceiling", 97.0),
        ),
        "target-jump-scla-printed-any-start": (
            Target("at least 90 % of the new ceiling in epoch 12", 12, 12, "mean percent of ceiling", 90.0),
            Target("at least 95 % in epoch 13", 13, 13, "mean percent of ceiling", 95.0),
        ),
    },
    task={"jump_epoch": JUMP_EPOCH, "jump_target": (1, 5)},
)
