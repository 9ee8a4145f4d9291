"""scla_mj: Spiking-based Cellular Learning Automata, embodied in MuJoCo."""

__version__ = "0.1.0"
