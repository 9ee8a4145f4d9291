"""A brain of ours as the agent of any environment with four moves and a discrete cell."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from scla_mj.checked import check
from scla_mj.config import RunConfig
from scla_mj.engine.build import watched_brain
from scla_mj.errors import SclaError
from scla_mj.grid import ACTIONS, Action, Cell
from scla_mj.loop.twin import CROSSED_S, MOVE_S
from scla_mj.signals import Decision, Feedback, Outcome, Percept

CellOf = Callable[[Any], tuple[int, int]]
SensedOf = Callable[[Any], Action | None]
Hit = Callable[[float, bool], bool]


def _is_rewarded(reward: float, terminated: bool) -> bool:
    return terminated and reward > 0.0


class BrainAgent:
    """A brain that acts in an environment it knows nothing of: `act(observation)`, then `learn(...)` what came of it.

    The environment has four moves on a grid. The brain gets the same feedback as in a rollout: its cell, what it
    executed, whether it was blocked, whether it hit, and a goal in a neighbouring cell. What ends an episode without
    a hit, or leads neither to the same cell nor to the next one (a hole, a cliff), counts as a bump: the move was bad,
    and the brain is where it was. A move lasts as long as one of our robot, so that spikes, traces and dopamine decay
    as they do there, unless the info has `duration_s` and `crossed_s`.

    Args:
        config: the brain with its settings and its seed; `cells` must be those of the environment.
        cell_of: the column and the row of an observation, from 1, x to the right and y upwards.
        moves: the environment's actions for up, down, left, right.
        sensed_of: the direction in which an observation has a goal in a neighbouring cell; without it that of `goal`.
        is_hit: whether a reward, and `terminated`, are a hit; by default a positive reward that ends the episode.
        goal: a cell that is known to be the goal; without it the cell of the last hit.

    Attributes:
        brain: the brain.

    Raises:
        SclaError: the configuration cannot be run; or a cell is not one of the grid (when it is observed).
    """

    def __init__(
        self,
        config: RunConfig,
        *,
        cell_of: CellOf,
        moves: tuple[int, int, int, int] = (0, 1, 2, 3),
        sensed_of: SensedOf | None = None,
        is_hit: Hit = _is_rewarded,
        goal: tuple[int, int] | None = None,
    ) -> None:
        if len(moves) != len(ACTIONS):
            raise SclaError(f"moves is {moves}: it must be the environment's four actions for up, down, left, right")
        checked = check(config)
        self.brain = watched_brain(checked)
        self._cells, self._period_s = checked.config.grid.cells, checked.clock.control_period_s
        self._cell_of, self._moves, self._is_hit = cell_of, moves, is_hit
        self._sensed_of = sensed_of or self._to_goal
        self._goal = None if goal is None else Cell(*goal)
        self._made: tuple[Percept, Decision] | None = None

    @classmethod
    def of_grid_move(cls, config: RunConfig) -> BrainAgent:
        """Return the agent of a `GridMoveEnv` that observes "sensing": it decides as in a rollout, to the bit."""
        return cls(
            config,
            cell_of=lambda seen: (seen[0] + 1, seen[1] + 1),
            sensed_of=lambda seen: ACTIONS[seen[2]] if seen[2] < len(ACTIONS) else None,
        )

    def act(self, observation: Any) -> int:
        """Return the environment's action that the brain decides on."""
        percept = self._percept(observation)
        decision = self.brain.decide(percept)
        self._made = percept, decision
        return self._moves[decision.action]

    def learn(
        self, observation: Any, reward: float, terminated: bool, truncated: bool, info: dict[str, Any]
    ) -> Feedback:
        """Let the brain learn from what `env.step` returned for its last action; return the feedback.

        Raises:
            SclaError: it has not acted since.
        """
        if self._made is None:
            raise SclaError("the brain has not acted yet: call act(observation) before learn(...)")
        (before, decision), self._made = self._made, None
        action = decision.action
        hit, cell = bool(self._is_hit(reward, terminated)), self._cell(observation)
        if hit:
            self._goal = cell
        outcome, executed = self._outcome(before.cell, cell, action, info, bad=terminated and not hit)
        after = before if outcome is Outcome.BLOCKED else self._percept(observation)
        duration_s = info.get("duration_s", _whole(MOVE_S, self._period_s))
        crossed_s = info.get("crossed_s", _whole(CROSSED_S, self._period_s)) if outcome is Outcome.MOVED else None
        feedback = Feedback(before, action, executed, outcome, after, hit, crossed_s)
        self.brain.elapse(duration_s)
        self.brain.learn(feedback)
        return feedback

    def _outcome(
        self, before: Cell, after: Cell, action: Action, info: dict[str, Any], *, bad: bool
    ) -> tuple[Outcome, Action]:
        """Return how a move ended, and in which direction it went: as the info says, or as the cells show."""
        if "outcome" in info:
            return tuple(Outcome)[info["outcome"]], ACTIONS[info["executed"]]
        taken = next((direction for direction in ACTIONS if before.after(direction) == after), None)
        if taken is None or bad:
            return Outcome.BLOCKED, action
        return Outcome.MOVED, taken

    def _percept(self, observation: Any) -> Percept:
        return Percept(self._cell(observation), self._sensed_of(observation))

    def _to_goal(self, observation: Any) -> Action | None:
        cell = self._cell(observation)
        return next((side for side in ACTIONS if cell.after(side) == self._goal), None)

    def _cell(self, observation: Any) -> Cell:
        x, y = self._cell_of(observation)
        if not (1 <= x <= self._cells[0] and 1 <= y <= self._cells[1]):
            raise SclaError(f"cell_of returned ({x}, {y}): the brain's --cells are {self._cells[0]} {self._cells[1]}")
        return Cell(int(x), int(y))


def play(env: Any, agent: BrainAgent, steps: int, *, seed: int | None = None) -> list[float]:
    """Let an agent act so many times in a Gymnasium environment; return the return of every finished episode."""
    returns, total = list[float](), 0.0
    observation, _ = env.reset(seed=seed)
    for _ in range(steps):
        observation, reward, terminated, truncated, info = env.step(agent.act(observation))
        agent.learn(observation, float(reward), terminated, truncated, info)
        total += float(reward)
        if terminated or truncated:
            returns.append(total)
            total, (observation, _) = 0.0, env.reset()
    return returns


def _whole(seconds: float, period_s: float) -> float:
    """Return a time as a whole number of control periods."""
    return round(seconds / period_s) * period_s
