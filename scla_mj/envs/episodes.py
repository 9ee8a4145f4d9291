"""What every environment of ours does: a task in episodes, by whole moves or by wheel speeds. It knows no library."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from scla_mj.checked import CheckedConfig
from scla_mj.control.motion import FRONT, REAR
from scla_mj.engine.build import build_task
from scla_mj.errors import SclaError
from scla_mj.grid import ACTIONS
from scla_mj.loop.simulation import begin_decision
from scla_mj.loop.task import Step
from scla_mj.sense.ranging import MAX_RANGE_M
from scla_mj.signals import Outcome
from scla_mj.world.rangefinder import ranges_m

OUTCOMES: Final = tuple(Outcome)
"""Outcomes by their number: 0 moved, 1 blocked, 2 failed."""
NOT_SENSED: Final = len(ACTIONS)
"""The number of the sensed direction where no target is in a neighbouring cell."""
MOVES: Final = 200
PERIODS: Final = 2000
"""Where an episode is truncated by default: 200 moves, or 2000 control periods."""
OF_DECISIONS: Final = ("action_noise", "jump_epoch", "jump_target", "crossed_epoch", "epochs", "decisions")
"""Settings that speak of decisions: for wheel speeds there are none."""
POSE, SPEEDS, TARGET, BUMPERS, RAYS = slice(0, 4), slice(4, 6), slice(6, 8), slice(8, 10), slice(10, None)
"""The parts of what a driver of wheels observes."""


class Episodes:
    """One task, from a seed on.

    Attributes:
        checked, task: its configuration, and the robot in its arena.
    """

    def __init__(self, checked: CheckedConfig, *, body: bool = True, lean: bool = True) -> None:
        self.checked = checked
        self.task = build_task(checked, body=body, lean=lean)

    def start(self, seed: int | None = None) -> None:
        """Start the next episode; with a seed, the first one of that run, at time 0.

        Raises:
            SclaError: `seed` is not one that a run can have.
        """
        if seed is None:
            self.task.respawn()
            return
        self.task.crossed = self.checked.has_crossed(1)
        if self.task.grid is not self.checked.grid(1):
            self.task.move_target(self.checked.grid(1))
        self.task.reseed(seed)


class MoveEpisodes(Episodes):
    """Episodes of whole moves, which end with a hit or a fall."""

    def __init__(self, checked: CheckedConfig, *, body: bool = True, lean: bool = True) -> None:
        super().__init__(checked, body=body, lean=lean)
        self._decisions, self._ended = 0, False

    @property
    def seen(self) -> tuple[int, int, int]:
        """Column and row of the cell, from 0, and the sensed direction or `NOT_SENSED`."""
        cell, sensed = self.task.percept.cell, self.task.percept.sensed
        return cell.x - 1, cell.y - 1, NOT_SENSED if sensed is None else int(sensed)

    def start(self, seed: int | None = None) -> None:
        """Start the next episode, as `Episodes.start`."""
        super().start(seed)
        if seed is not None:
            self._decisions = 0
        elif self._ended:  # what a new epoch brings comes after the hit that ended the old one
            begin_decision(self.task, self.checked, self._decisions)
        self._ended = False

    def act(self, action: int, *, observe: bool = False) -> Step:
        """Carry out one move; the robot stays where it ends, until the next `start`.

        Raises:
            SclaError: the physics has gone wrong.
        """
        came = self.task.act(ACTIONS[action], observe=observe, respawn=False)
        self._ended = came.feedback.hit or came.move.fallen
        self._decisions += 1
        if not self._ended:
            begin_decision(self.task, self.checked, self._decisions)
        return came


class WheelEpisodes(Episodes):
    """Episodes of wheel speeds, which end with the axle's midpoint in the target's cell, or with a fall.

    Attributes:
        low, high: bounds of what is observed, (10 + rays,), float32.
        period_s: how long a command is held.

    Raises:
        SclaError: `frame_skip` or `rays` is out of its range.
    """

    def __init__(self, checked: CheckedConfig, *, frame_skip: int = 1, rays: int = 0, lean: bool = True) -> None:
        for name, value, least, most in (("frame_skip", frame_skip, 1, 1000), ("rays", rays, 0, 360)):
            if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
                raise SclaError(f"{name} is {value!r}: it must be a whole number, {least} to {most}")
        super().__init__(checked, lean=lean)
        world, grid = self.task.world, self.task.grid
        self._controls, self.period_s = frame_skip, frame_skip * checked.clock.control_period_s
        self._angles = np.linspace(0.0, math.tau, rays, endpoint=False, dtype=np.float64)
        self._top_rad_s = checked.config.controller.max_speed_m_s / world.dimensions.wheel_radius_m
        self._dof, self._distance_m, self._touched = world.at.root_dof, 0.0, 0
        half_m = [cells * grid.cell_size_m / 2 for cells in grid.cells]
        across_m = 2.0 * math.hypot(*half_m)
        self.high = np.array([*half_m, 1, 1, 10, 100, across_m, across_m, 1, 1, *[MAX_RANGE_M] * rays], np.float32)
        self.low = -self.high
        self.low[BUMPERS.start :] = 0.0

    def start(self, seed: int | None = None) -> None:
        """Start the next episode, as `Episodes.start`."""
        super().start(seed)
        self._distance_m, self._touched = self._to_target_m(), 0

    def command(self, speeds: NDArray[np.float64] | Sequence[float]) -> tuple[float, bool, bool]:
        """Hold the speeds of the left and the right wheel, -1 to 1 of the top speed; return reward, hit and fallen.

        Raises:
            SclaError: they are not two numbers from -1 to 1; or the physics has gone wrong.
        """
        try:
            asked = np.asarray(speeds, np.float64)
        except (TypeError, ValueError):
            asked = np.empty(0)
        if asked.shape != (2,) or not (np.abs(asked) <= 1.0).all():
            raise SclaError(f"the action is {speeds!r}: it must be two numbers from -1 to 1")
        left_rad_s, right_rad_s = (asked * self._top_rad_s).tolist()
        self._touched = self.task.command(left_rad_s, right_rad_s, self._controls)
        pose, grid, before_m = self.task.world.pose(), self.task.grid, self._distance_m
        fallen = not self.task.world.can_drive()
        hit = not fallen and grid.cell_at(pose.x_m, pose.y_m) in grid.targets
        if not fallen:
            self._distance_m = self._to_target_m()
        return (before_m - self._distance_m) / grid.cell_size_m + hit - fallen, hit, fallen

    @property
    def seen(self) -> NDArray[np.float32]:
        """What is observed, within its bounds."""
        world = self.task.world
        x_m, y_m, heading_rad = self.task.place()
        cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
        to_x_m, to_y_m = min(self._to_targets_m(x_m, y_m), key=lambda way: math.hypot(*way))
        velocity = world.data.qvel[self._dof : self._dof + 6].tolist()
        true_heading_rad = world.pose().heading_rad
        speed_m_s = velocity[0] * math.cos(true_heading_rad) + velocity[1] * math.sin(true_heading_rad)
        seen = [
            x_m, y_m, cosine, sine, speed_m_s, velocity[5],
            cosine * to_x_m + sine * to_y_m, cosine * to_y_m - sine * to_x_m,
            float(bool(self._touched & FRONT)), float(bool(self._touched & REAR)),
        ]  # fmt: skip
        if len(self._angles):
            seen += ranges_m(world, self._angles, reach_m=MAX_RANGE_M).tolist()
        observed = np.nan_to_num(np.array(seen, np.float32), posinf=MAX_RANGE_M)
        clipped: NDArray[np.float32] = np.clip(observed, self.low, self.high)
        return clipped

    def _to_target_m(self) -> float:
        pose = self.task.world.pose()
        return min(math.hypot(*way) for way in self._to_targets_m(pose.x_m, pose.y_m))

    def _to_targets_m(self, x_m: float, y_m: float) -> list[tuple[float, float]]:
        centres = map(self.task.grid.centre_m, self.task.grid.targets)
        return [(target_x_m - x_m, target_y_m - y_m) for target_x_m, target_y_m in centres]
