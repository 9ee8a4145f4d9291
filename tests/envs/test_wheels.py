"""Wheels-v0: Gymnasium's contract, and the physics of a rollout."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from scla_mj.config import RunConfig
from scla_mj.engine.build import build_task
from scla_mj.envs.wheels import WheelsEnv
from scla_mj.errors import SclaError
from scla_mj.grid import Action
from scla_mj.signals import TRAJECTORY_COLUMNS

LEFT = TRAJECTORY_COLUMNS.index("command_left_rad_s")


@pytest.mark.parametrize("options", [{}, {"rays": 8, "frame_skip": 5, "localisation": "sensors", "disturb": ["all"]}])
def test_gymnasiums_checker_finds_nothing(options):
    check_env(gym.make("scla_mj.envs:scla_mj/Wheels-v0", **options).unwrapped, skip_render_check=True)


def test_the_commands_of_a_driven_move_end_in_its_state_to_the_bit():
    driven, commanded = (build_task(RunConfig(seed=3)) for _ in range(2))
    for action in (Action.UP, Action.LEFT, Action.LEFT, Action.LEFT, Action.LEFT):  # into a wall, too
        move = driven.act(action, respawn=False).move
        touched = [commanded.command(*row[LEFT : LEFT + 2]) for row in move.trajectory]
        assert driven.world.state()["physics"].tobytes() == commanded.world.state()["physics"].tobytes()
        assert driven.time_s == commanded.time_s and any(touched) == (move.outcome == "blocked")


def drive_to(env, seed):
    """Turn to the target and drive, by what is observed alone; return the last step and the return."""
    seen, _ = env.reset(seed=seed)
    total = 0.0
    for _ in range(2000):
        turn = np.clip(2.0 * np.arctan2(seen[7], seen[6]), -0.15, 0.15)
        drive = 0.25 if abs(turn) < 0.1 else 0.0
        came = env.step(np.array([drive - turn, drive + turn], np.float32))
        seen, total = came[0], total + came[1]
        if came[2] or came[3]:
            return came, total
    raise AssertionError("it never arrived")


def test_the_observation_leads_to_the_target_and_the_return_is_the_way_there_and_the_hit():
    env = WheelsEnv(rays=4)
    start, _ = env.reset(seed=2)
    target_m = np.hypot(*start[6:8])
    assert np.hypot(start[0], start[1]) == pytest.approx(target_m)  # the target is the arena's centre
    (seen, _, terminated, truncated, info), total = drive_to(env, seed=2)
    assert (terminated, truncated, info["hit"], info["fallen"]) == (True, False, 1, 0)
    assert total == pytest.approx(1.0 + (target_m - np.hypot(*seen[6:8])) / 0.3, abs=1e-5)
    assert seen[10] + seen[12] == pytest.approx(1.5, abs=0.02) or abs(seen[2] * seen[3]) > 1e-2  # wall to wall


def test_a_robot_that_is_thrown_over_has_fallen():
    env = WheelsEnv(max_speed_m_s=0.8)
    env.reset(seed=0)
    for step in range(400):
        side = 1.0 if step // 25 % 2 else -1.0
        seen, reward, terminated, _, info = env.step(np.array([side, side], np.float32))
        assert env.observation_space.contains(seen)
        if info["fallen"]:
            assert terminated and reward == -1.0
            env.reset()
            assert env.task.world.can_drive()
            return
        if terminated:
            env.reset()
    pytest.fail("it cannot be thrown over")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"frame_skip": 0}, "frame_skip is 0: it must be a whole number, 1 to 1000"),
        ({"rays": 3.5}, "rays is 3.5: it must be a whole number, 0 to 360"),
        ({"action_noise": 0.1}, "action_noise is no setting of this environment"),
    ],
)
def test_what_cannot_be_is_refused(options, sentence):
    with pytest.raises(SclaError, match=sentence):
        WheelsEnv(**options)


@pytest.mark.parametrize("action", [[0.0], [0.0, 1.5], [float("nan"), 0.0]])
def test_what_is_not_two_speeds_is_refused(action):
    env = WheelsEnv()
    env.reset(seed=0)
    with pytest.raises(SclaError, match="it must be two numbers from -1 to 1"):
        env.step(np.array(action))
