"""Brains of scla_mj, spiking and tabular, in a world that is not theirs: Gymnasium's FrozenLake.

    pip install "scla-mj[gym]" && python examples/frozen_lake.py

The lake has 4 x 4 fields, four of them holes; its actions are left, down, right, up. An agent needs two things: the
cell of an observation, and which actions go up, down, left and right.
"""

import gymnasium as gym

from scla_mj import GridConfig, RunConfig
from scla_mj.envs import BrainAgent, play

SIZE = 4


def cell_of(observation):
    """Return column and row from 1, y upwards; the lake counts its fields by rows from the upper left."""
    row, column = divmod(int(observation), SIZE)
    return column + 1, SIZE - row


def returns_of(brain, decisions, seed=0):
    """Return what a brain earns in every episode: 1 where it reached the goal."""
    lake = gym.make("FrozenLake-v1", is_slippery=False)
    config = RunConfig(brain=brain, seed=seed, grid=GridConfig(cells=(SIZE, SIZE), target=(SIZE, 1)))
    return play(lake, BrainAgent(config, cell_of=cell_of, moves=(3, 1, 0, 2)), decisions, seed=seed)


if __name__ == "__main__":
    for name in ("scla", "scla-printed", "q-learning", "random"):
        earned = returns_of(name, 1500)
        quarter = len(earned) // 4
        print(f"{name:12} {len(earned)} episodes; goals in the first and in the last quarter of them:",
              f"{sum(earned[:quarter]) / quarter:.0%}, {sum(earned[-quarter:]) / quarter:.0%}")  # fmt: skip
