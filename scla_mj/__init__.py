"""scla_mj: Spiking-based Cellular Learning Automata, embodied in MuJoCo.

The names below are the Python interface (docs/python.md); each is imported when it is first used.
"""

import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
