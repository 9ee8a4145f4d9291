"""What each part is worth: SCLA with one setting changed."""

from __future__ import annotations

from typing import Any, Final

from scla_mj.config import RunConfig
from scla_mj.experiments.catalogue.experiment import (
    FIVE_SEEDS,
    SHORT,
    SHORT_SENSED,
    Experiment,
    with_settings,
)


def _ablation(name: str, title: str, question: str, base: RunConfig = SHORT, **settings: Any) -> Experiment:
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
