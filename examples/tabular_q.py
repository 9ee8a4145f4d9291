"""Tabular Q-learning through the Gymnasium environment: greedy, from optimistic values.

pip install "scla-mj[gym]" && python examples/tabular_q.py
"""

import gymnasium as gym
import numpy as np

from scla_mj.envs import HitRecorder


def learn(env, decisions, seed, rate=1.0, discount=0.9, first_value=1.0):
    """Learn for so many decisions; return the values (states, actions)."""
    rng = np.random.default_rng(seed)  # of ties
    values = np.full((env.observation_space.n, env.action_space.n), first_value)
    state, _ = env.reset(seed=seed)
    for _ in range(decisions):
        action = rng.choice(np.flatnonzero(values[state] == values[state].max()))
        after, reward, terminated, truncated, _ = env.step(action)
        future = 0.0 if terminated else discount * values[after].max()
        values[state, action] += rate * (reward + future - values[state, action])
        state = env.reset()[0] if terminated or truncated else after
    return values


if __name__ == "__main__":
    robot = gym.make("scla_mj.envs:scla_mj/GridMove-v0", observation="index", max_episode_steps=-1)
    recorder = HitRecorder(robot)
    learn(recorder, 3000, seed=0)
    print("hits in every 1000 decisions:", recorder.per_1000())
