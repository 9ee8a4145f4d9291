"""What the paper prints, as data.

V. Pashaei Rad, V. Azimi Rad and S. Valizadeh Sotubadi, "Spiking based Cellular Learning Automata (SCLA) algorithm for
mobile robot motion formulation".
"""

from typing import Final

TABLE_5: Final = (799, 778, 772, 807, 750, 790, 756, 802, 809, 780, 764, 800, 810, 770, 800, 811, 772, 783, 790, 778)
"""Hits in each of the first 20 epochs of 1000 time steps (its Table 5)."""
SCLA_HITS: Final = 784.2
"""Mean hits per 1000 as its conclusions print it."""
AUTOMATON_HITS: Final = 115.0
"""The cellular learning automaton alone (its conclusions)."""
AUTOMATON_MOVES: Final = 9.0
"""Its moves per hit, "approximately" (its conclusions)."""
AUTOMATON_SPAN: Final = (11, 20)
"""The second half of the 20 epochs that it ran the automaton for, in which ours has settled."""
MOST_STEPS: Final = 2
""""At most 2 steps to reach to the target" (its conclusions)."""
EPOCHS: Final = 30
"""Epochs that it ran SCLA for."""
CELLS: Final = (5, 5)
TARGET: Final = (3, 3)
RESET_MV: Final = -65.0
"""c of Table 2."""
RECOVERY_RATE: Final = 0.02
"""a of Table 2."""
RECOVERY_SENSITIVITY: Final = 0.2
"""b of Table 2."""
