"""Stable-Baselines3's DQN and PPO learn to drive the robot, with settings that suit some thousand moves.

    pip install -e ".[sb3]" && python examples/stable_baselines.py

From nothing, with a torch that is small: docs/environments.md, "Stable-Baselines3".
"""

import gymnasium as gym
import torch
from stable_baselines3 import DQN, PPO

from scla_mj.envs import HitRecorder

ALGORITHMS = {"dqn": DQN, "ppo": PPO}
TUNED = {
    "dqn": {
        "learning_rate": 1e-3,
        "gamma": 0.9,
        "buffer_size": 10_000,
        "learning_starts": 100,
        "train_freq": 1,
        "target_update_interval": 100,
        "exploration_fraction": 0.02,
        "exploration_final_eps": 0.02,
    },
    "ppo": {"learning_rate": 1e-3, "gamma": 0.9, "n_steps": 64, "batch_size": 64, "n_epochs": 10, "ent_coef": 0.01},
}
"""Chosen by hand on seeds 0 to 2, for 10,000 decisions; the rest is the library's default, two layers of 64 units."""


def learn(env, decisions, seed, algorithm, **settings):
    """Let an algorithm learn for at least so many decisions (PPO: whole batches of them); return the model."""
    torch.set_num_threads(1)  # networks of this size gain nothing from more
    model = ALGORITHMS[algorithm]("MlpPolicy", env, seed=seed, device="cpu", **settings)
    return model.learn(decisions)


if __name__ == "__main__":
    for name, settings in TUNED.items():
        env = HitRecorder(gym.make("scla_mj.envs:scla_mj/GridMove-v0", max_episode_steps=-1))
        learn(env, 3000, 0, name, **settings)
        print(name, "hits in every 1000 decisions:", env.per_1000()[:3])
