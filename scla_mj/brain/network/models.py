"""Neuron models of described networks, each with its parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True)
class Izhikevich:
    """Equations 1 and 2 with their four parameters; it begins at v = c, u = b c."""

    a: float
    b: float
    c: float
    d: float


@dataclass(frozen=True)
class LIF:
    """Leaky integrate-and-fire: tau v' = rest - v + resistance I; v >= threshold: v <- reset, and it is held there.

    Solved exactly from step to step. A spike of weight w adds a current of w for 1 ms, which raises v by some
    w resistance / tau: with `resistance` = `tau_ms` a weight is in mV.
    """

    tau_ms: float = 20.0
    rest_mv: float = -70.0
    reset_mv: float = -70.0
    threshold_mv: float = -50.0
    resistance: float = 1.0
    refractory_ms: float = 2.0


IZHIKEVICH_TYPES: Final = {
    "regular spiking": Izhikevich(0.02, 0.2, -65.0, 8.0),
    "intrinsically bursting": Izhikevich(0.02, 0.2, -55.0, 4.0),
    "chattering": Izhikevich(0.02, 0.2, -50.0, 2.0),
    "fast spiking": Izhikevich(0.1, 0.2, -65.0, 2.0),
    "low-threshold spiking": Izhikevich(0.02, 0.25, -65.0, 2.0),
    "thalamo-cortical": Izhikevich(0.02, 0.25, -65.0, 0.05),
    "resonator": Izhikevich(0.1, 0.26, -65.0, 2.0),
}
"""Izhikevich 2003, Figure 2."""
