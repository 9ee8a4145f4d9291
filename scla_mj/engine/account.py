"""What a run has earned and what it took, up to its last whole decision, in memory that does not grow with it."""

from __future__ import annotations

import math
import time
from dataclasses import asdict, dataclass
from typing import Any

from scla_mj.checked import CheckedConfig
from scla_mj.runs.history import WeightHistory
from scla_mj.runs.summary import EpochSummary, LocalisationSummary, Summary, Transitions, epoch_summary
from scla_mj.signals import DecisionRecord, Localised, Outcome


@dataclass
class _Epoch:
    """What is counted of one epoch while it is running."""

    epoch: int
    decisions: int = 0
    hits: int = 0
    nearer: int = 0
    beyond: int = 0
    mean_weights: list[float] | None = None


@dataclass
class _Beliefs:
    """What is counted of a robot that finds its own place; errors in metres."""

    decisions: int = 0
    max_error_m: float = 0.0
    total_error_m: float = 0.0
    wrong_cells: int = 0

    def add(self, localised: Localised) -> None:
        self.decisions += 1
        self.max_error_m = max(self.max_error_m, localised.error_m)
        self.total_error_m += localised.error_m
        self.wrong_cells += not localised.right_cell

    def summary(self) -> LocalisationSummary | None:
        if not self.decisions:
            return None
        return LocalisationSummary(self.max_error_m, self.total_error_m / self.decisions, self.wrong_cells)


class Account:
    """Counts decisions, and time on both clocks; a resumed run's wall time is that of all its parts.

    Attributes:
        history: the mean weights over the run.
    """

    def __init__(self, checked: CheckedConfig) -> None:
        self.history = WeightHistory()
        self._checked = checked
        self._epochs: dict[int, _Epoch] = {}
        self._outcomes = dict.fromkeys(Outcome, 0)
        self._max_error_m = 0.0
        self._beliefs = _Beliefs()
        self._started = time.perf_counter()
        self._simulated_s = 0.0

    def wants_activity(self, decision: int) -> bool:
        """Return whether the next decision, the epoch's `decision`-th, is one whose mean weights are kept."""
        return self.history.is_due or decision == self._checked.config.decisions

    def add(self, record: DecisionRecord, time_s: float) -> None:
        """Count one decision, after which the run's time is `time_s`; an activity that is not wanted is not looked at.

        So no figure depends on whether somebody else wants to see every decision's.
        """
        if record.activity is not None and not self.wants_activity(record.decision):
            record = record._replace(activity=None)
        epoch = self._epochs.setdefault(record.epoch, _Epoch(record.epoch))
        epoch.decisions += 1
        epoch.hits += bool(record.hit)
        gained = self._gained(record)
        epoch.nearer += gained > 0
        epoch.beyond += 1 - gained
        if record.activity is not None:
            epoch.mean_weights = record.activity.mean_weights.tolist() or None
        self._outcomes[record.move.outcome] += 1
        if math.isfinite(record.move.position_error_m):  # a robot that fell, a failed move, is nowhere
            self._max_error_m = max(self._max_error_m, abs(record.move.position_error_m))
        if record.localised is not None:
            self._beliefs.add(record.localised)
        self.history.add(record)
        self._simulated_s = time_s

    @property
    def decisions(self) -> int:
        """Decisions counted so far."""
        return sum(self._outcomes.values())

    def epoch(self, epoch: int) -> EpochSummary:
        """Return the figures so far of an epoch that has at least one decision."""
        count = self._epochs[epoch]
        means = None if count.mean_weights is None else tuple(count.mean_weights)
        ceiling = self._checked.ceiling_hits_per_1000(epoch)
        return epoch_summary(
            epoch, count.decisions, count.hits, ceiling, means, nearer=count.nearer, beyond=count.beyond
        )

    def state(self) -> dict[str, Any]:
        """Return everything that `restore` needs to continue from here."""
        return {
            "epochs": [asdict(epoch) for epoch in self._epochs.values()],
            "outcomes": dict(self._outcomes),
            "max_error_m": self._max_error_m,
            "beliefs": asdict(self._beliefs),
            "history": self.history.state(),
            "simulated_s": self._simulated_s,
            "wall_s": self._wall_s(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a `state`."""
        self._epochs = {epoch["epoch"]: _Epoch(**epoch) for epoch in state["epochs"]}
        self._outcomes = {outcome: state["outcomes"][outcome] for outcome in Outcome}
        self._max_error_m = state["max_error_m"]
        self._beliefs = _Beliefs(**state["beliefs"])
        self.history.restore(state["history"])
        self._simulated_s = state["simulated_s"]
        self._started = time.perf_counter() - state["wall_s"]

    def summary(self) -> Summary:
        """Return the figures so far."""
        config = self._checked.config
        return Summary(
            brain=config.brain,
            protocol=config.protocol,
            seed=config.seed,
            cells=config.grid.cells,
            target=config.grid.target,
            others=tuple((x, y) for x, y in self._checked.grids[0].others),
            crossed_epoch=config.task.crossed_epoch,
            ceiling_hits_per_1000=self._checked.ceiling_hits_per_1000(),
            chance_hits_per_1000=self._checked.chance_hits_per_1000(),
            epochs=tuple(map(self.epoch, self._epochs)),
            transitions=Transitions(
                commanded=self.decisions,
                completed=self._outcomes[Outcome.MOVED],
                blocked=self._outcomes[Outcome.BLOCKED],
                failed=self._outcomes[Outcome.FAILED],
            ),
            max_position_error_m=self._max_error_m,
            simulated_s=self._simulated_s,
            wall_s=self._wall_s(),
            localisation=self._beliefs.summary(),
        )

    def _gained(self, record: DecisionRecord) -> int:
        """Return by how many moves the target is nearer than before: on wheels 1, 0 or -1."""
        distances, before, after = self._checked.grid(record.epoch).distances, record.move.before, record.move.after
        return 0 if before == after else distances[before] - distances[after]  # it may have believed to be in a wall

    def _wall_s(self) -> float:
        return time.perf_counter() - self._started
