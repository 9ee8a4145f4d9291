"""Brains to compare SCLA with: the random walk, a shortest path, and SCLA's own parts alone; learners in tabular.py."""

from __future__ import annotations

from typing import Any

from scla_mj.brain.automata import LearningAutomata
from scla_mj.brain.base import Brain
from scla_mj.brain.reinforcement import CellStates, Reinforcement
from scla_mj.checked import CheckedConfig
from scla_mj.errors import SclaError
from scla_mj.grid import ACTIONS, Action, Cell, around
from scla_mj.randomness import Consumer, generator
from scla_mj.signals import Decision, Feedback, Outcome, Percept, Snapshot


class RandomBrain(Brain):
    """The random walk: the lower end of the scale."""

    reads = ()

    def __init__(self, checked: CheckedConfig) -> None:
        self._rng = generator(checked.config.seed, Consumer.BRAIN)

    def decide(self, percept: Percept) -> Decision:
        """Choose each action with probability 1/4."""
        return Decision(Action(int(self._rng.integers(len(Action)))))

    def learn(self, feedback: Feedback) -> None:
        """Learn nothing."""

    def state(self) -> dict[str, Any]:
        """Return the generator's state."""
        return {"rng": self._rng.bit_generator.state}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`."""
        self._rng.bit_generator.state = state["rng"]


class ShortestPathBrain(Brain):
    """Knows the map and follows a shortest path: the ceiling, driven by the robot.

    Raises:
        SclaError: the target jumps or the wheels are crossed, which this brain cannot know.
    """

    reads = ()

    def __init__(self, checked: CheckedConfig) -> None:
        task = checked.config.task
        if checked.jumps:
            raise SclaError(
                "--brain shortest-path knows first targets only: leave out --task.jump-epoch, or the floor's schedule"
            )
        if task.crossed_epoch:
            raise SclaError("--brain shortest-path knows its wheels: leave out --task.crossed-epoch")
        self._grid = checked.grid()

    def decide(self, percept: Percept) -> Decision:
        """Move to the neighbour closest to the target; of equals, the first in the order up, down, left, right.

        A robot that believes to be in a closed cell among closed cells moves up.
        """
        distances, nowhere = self._grid.distances, (Action.UP, percept.cell)
        neighbours = self._grid.neighbours(percept.cell)
        return Decision(min(neighbours, key=lambda neighbour: distances[neighbour[1]], default=nowhere)[0])

    def learn(self, feedback: Feedback) -> None:
        """Learn nothing."""

    def state(self) -> dict[str, Any]:
        """Return an empty state: nothing changes during a run."""
        return {}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`, which is empty."""


class AutomatonBrain(Brain):
    """The paper's baseline: cellular learning automata without a network.

    The only reward is for the move into the target, and only the target's four neighbours can make it. Its limit is
    therefore exact: perfect next to the target, random elsewhere, 115.38 hits per 1000 decisions from any start on the
    paper's grid (the paper reports 115).
    """

    reads = ("automaton.scheme", "automaton.reward-rate")

    def __init__(self, checked: CheckedConfig) -> None:
        config = checked.config
        self.automata = LearningAutomata(
            config.grid.cells, config.automaton, rng=generator(config.seed, Consumer.BRAIN)
        )

    def decide(self, percept: Percept) -> Decision:
        """Draw from the cell's action probabilities."""
        action = self.automata.draw(percept.cell)
        return Decision(action, advised=action)

    def learn(self, feedback: Feedback) -> None:
        """Reward the move that reached the target."""
        if feedback.hit:
            self.automata.reward(feedback.before.cell, feedback.action)

    def snapshot(self) -> Snapshot:
        """Return a copy of the action probabilities."""
        return Snapshot(probabilities=self.automata.probabilities)

    def state(self) -> dict[str, Any]:
        """Return the state of the automata."""
        return {"automata": self.automata.state()}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`."""
        self.automata.restore(state["automata"])


class AutomataBrain(Brain):
    """SCLA without its network: the automata decide everywhere, with the very signals of scla-printed.

    Attributes:
        automata: the learning automata; their action probabilities can be read and set.
    """

    reads = ("automaton.",)

    def __init__(self, checked: CheckedConfig) -> None:
        config = checked.config
        self.automata = LearningAutomata(
            config.grid.cells, config.automaton, rng=generator(config.seed, Consumer.BRAIN)
        )
        self._reinforcement = Reinforcement(self.automata, config.automaton)
        self._cells = config.grid.cells
        self._coin = generator(config.seed, Consumer.TIES)

    def decide(self, percept: Percept) -> Decision:
        """Draw from the cell's action probabilities, unless a target is sensed and `beside` has an answer."""
        beside = None if percept.sensed is None else self.beside(percept.sensed)
        if beside is not None:
            return Decision(beside)
        action = self.automata.draw(percept.cell)
        return Decision(action, advised=action)

    def beside(self, sensed: Action) -> Action | None:
        """Return the move where a target is sensed, None to ask the automaton: what SCLA's network is there for."""
        return None

    def learn(self, feedback: Feedback) -> None:
        """Pass the reinforcement signal on to the automata."""
        feedback, chosen = self._reinforcement.credited(feedback)
        self._reinforcement.signal(feedback, punish=chosen)

    def snapshot(self) -> Snapshot:
        """Return copies of the action probabilities and the cells' states."""
        values = self._reinforcement.states.values(self._cells)
        return Snapshot(None, self.automata.probabilities, values)

    def state(self) -> dict[str, Any]:
        """Return the state of the automata, of what their signals come from, and of the coin's generator."""
        return {
            "automata": self.automata.state(),
            "reinforcement": self._reinforcement.state(),
            "coin": self._coin.bit_generator.state,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`."""
        self.automata.restore(state["automata"])
        self._reinforcement.restore(state["reinforcement"])
        self._coin.bit_generator.state = state["coin"]


class ReflexAutomataBrain(AutomataBrain):
    """SCLA with a perfect reflex in place of its network: the most that a network can be worth."""

    def beside(self, sensed: Action) -> Action:
        """Move to the target."""
        return sensed


class CoinAutomataBrain(AutomataBrain):
    """SCLA with a coin in place of its network: what a network earns that has learned nothing."""

    def beside(self, sensed: Action) -> Action:
        """Toss a coin between the two motors that the sensed direction is wired to: its own and the opposite one."""
        return sensed if self._coin.random() < 0.5 else sensed.opposite


class CellStatesBrain(Brain):
    """SCLA's cell states, followed greedily, without automata and network: value iteration in real time.

    The local rule is a Bellman backup on the known map (Barto, Bradtke and Singh 1995, real-time dynamic programming):
    this brain moves to the neighbour with the best state, and remembers where a wall is.
    """

    reads = ("automaton.discount",)

    def __init__(self, checked: CheckedConfig) -> None:
        config = checked.config
        self.states = CellStates(discount=config.automaton.discount)
        self._walls: set[tuple[Cell, Action]] = set()
        self._cells = config.grid.cells
        self._rng = generator(config.seed, Consumer.BRAIN)

    def decide(self, percept: Percept) -> Decision:
        """Move to a sensed target, else to the best neighbour that is no known wall, ties broken at random."""
        if percept.sensed is not None:
            return Decision(percept.sensed)
        cell, neighbours = percept.cell, around(percept.cell)
        values = [-1.0 if (cell, a) in self._walls else self.states[neighbours[a]] for a in ACTIONS]
        best = [action for action, value in zip(ACTIONS, values, strict=True) if value == max(values)]
        return Decision(best[int(self._rng.integers(len(best)))])

    def learn(self, feedback: Feedback) -> None:
        """Update the states of both cells, and remember a wall."""
        self.states.judge(feedback)
        if feedback.outcome is Outcome.BLOCKED:
            self._walls.add((feedback.before.cell, feedback.executed))

    def snapshot(self) -> Snapshot:
        """Return the cells' states."""
        return Snapshot(values=self.states.values(self._cells))

    def state(self) -> dict[str, Any]:
        """Return the states, the known walls as rows x, y, action, and the generator's state."""
        walls = [[cell.x, cell.y, int(action)] for cell, action in sorted(self._walls)]
        return {"states": self.states.state(), "walls": walls, "rng": self._rng.bit_generator.state}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a `state`."""
        self.states.restore(state["states"])
        self._walls = {(Cell(x, y), Action(action)) for x, y, action in state["walls"]}
        self._rng.bit_generator.state = state["rng"]
