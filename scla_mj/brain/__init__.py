"""Think and decide: the spiking network, the learning automata, and SCLA, which joins them."""

from scla_mj.brain.base import Brain

__all__ = ["Brain"]
