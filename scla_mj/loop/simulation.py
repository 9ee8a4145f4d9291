"""One decision in arrow order: sense, think, decide, command, step physics, learn, record."""

from __future__ import annotations

from typing import Any

from scla_mj.brain.base import Brain
from scla_mj.checked import CheckedConfig
from scla_mj.errors import SclaError
from scla_mj.loop.task import Task
from scla_mj.restoring import restore_whole
from scla_mj.signals import DecisionRecord
from scla_mj.world.world import World


def begin_decision(task: Task, config: CheckedConfig, decisions: int) -> tuple[int, int]:
    """Let the targets move and the wheels cross if a new epoch begins; the brain is not informed.

    Returns:
        The epoch, and the decision that follows `decisions` earlier ones within it, both from 1.
    """
    epoch, decision = divmod(decisions, config.config.decisions)
    epoch, decision = epoch + 1, decision + 1
    if decision == 1 and config.jumps_in(epoch):
        task.move_target(config.grid(epoch))
    if decision == 1 and epoch == config.config.task.crossed_epoch:
        task.crossed = True
    return epoch, decision


class Simulation:
    """A task joined with a brain: each `step()` is one decision, driven to its end.

    Attributes:
        config: the checked configuration.
        task: the robot in its arena.
        brain: what decides.
        decisions: how many were made so far.
        record: the latest decision, None before the first.
    """

    def __init__(self, config: CheckedConfig, task: Task, brain: Brain) -> None:
        self.config, self.task, self.brain = config, task, brain
        self.decisions = 0
        self.record: DecisionRecord | None = None
        self._decisions_per_epoch = config.config.decisions

    @property
    def time_s(self) -> float:
        """The run's time so far."""
        return self.task.time_s

    @property
    def world(self) -> World:
        """The MuJoCo arena with its robot: `world.model`, `world.data`, `world.pose()`."""
        return self.task.world

    @property
    def network(self) -> Any:
        """The brain's spiking network.

        Raises:
            SclaError: the brain has none.
        """
        return self._of_the_brain("network", "--brain scla or network")

    @property
    def automata(self) -> Any:
        """The brain's learning automata, one per cell.

        Raises:
            SclaError: the brain has none.
        """
        return self._of_the_brain("automata", "--brain scla or automaton")

    def step(self, *, observe: bool = True) -> DecisionRecord:
        """Let the robot make one decision and drive it; after a run's last epoch it simply continues with the next.

        Without `observe` the record has neither the brain's activity nor the move's trajectory: copies take time.
        """
        epoch, decision = begin_decision(self.task, self.config, self.decisions)
        percept = self.task.percept
        chosen = self.brain.decide(percept)
        came = self.task.act(chosen.action, observe=observe)
        feedback, move = came.feedback, came.move
        self.brain.elapse(move.duration_s)
        self.brain.learn(feedback)
        activity = self.brain.activity() if observe else None
        self.decisions += 1
        self.record = DecisionRecord(
            epoch, decision, came.started_s, percept, chosen, came.driven, move, feedback.hit, activity,
            came.localised,
        )  # fmt: skip
        return self.record

    def state(self) -> dict[str, Any]:
        """Return all that changes between decisions; "brain" is None for a brain that cannot be resumed."""
        return {"decisions": self.decisions, "task": self.task.state(), "brain": self.brain.state()}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a `state` of a simulation of the same configuration, bit for bit.

        Raises:
            SclaError: it is not such a state; nothing is changed then.
        """
        ours = type(self.brain).__module__.startswith(Brain.__module__.rpartition(".")[0])
        free = ("rows",) if ours else ("rows", "brain")  # a user's brain may hold now this, now that
        restore_whole(state, self.state(), self._put_back, name="the simulation's state", free=free)

    def _put_back(self, state: dict[str, Any]) -> None:
        self.decisions, self.record = state["decisions"], None
        grid = self.config.grid(max(0, self.decisions - 1) // self._decisions_per_epoch + 1)
        if grid is not self.task.grid:
            self.task.move_target(grid)
        self.task.restore(state["task"])
        self.brain.restore(state["brain"])

    def _of_the_brain(self, part: str, others: str) -> Any:
        found = getattr(self.brain, part, None)
        if found is None:
            raise SclaError(f"--brain {self.config.config.brain} has no {part}: choose {others}")
        return found
