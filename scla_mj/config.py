"""Every setting of a run, each default stated once with its source or its reason.

`model section N` is the table "What we build where the paper is silent" and its neighbours in docs/model.md. Lengths of time
carry their unit in the name; a number without a unit is a pure number.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import tyro.conf

from scla_mj.clock import Clock, resolve_clock
from scla_mj.errors import SclaError
from scla_mj.grid import Cell, Grid, StartProtocol

Telemetry = Literal["off", "light", "full"]
Scheme = Literal["reward-penalty", "reward-inaction", "reward-epsilon-penalty", "opposite-pair"]
Precision = Literal["float32", "float64"]


@dataclass(frozen=True)
class GridConfig:
    """The floor."""

    cells: tuple[int, int] = (5, 5)
    """Columns and rows of the floor (paper: 5 x 5)."""
    target: tuple[int, int] = (3, 3)
    """The target's column and row, from 1 (paper: 3 3)."""
    cell_size_m: float = 0.30
    """Edge of a cell: about twice the robot's length, so that it turns without touching a wall."""


@dataclass(frozen=True)
class ClockConfig:
    """The one clock. Every period must be an integer multiple of the base step."""

    base_step_ms: float = 1.0
    """What every other period is counted in."""
    neural_step_ms: float = 1.0
    """One step of every neuron (Izhikevich 2003 integrates with 1 ms, v in two halves)."""
    physics_step_ms: float = 10.0
    """One MuJoCo step; with the discrete integrator within 0.05 degrees a move of a 0.5 ms step (tested)."""
    control_period_ms: float = 10.0
    """One period of the wheel-speed controller."""
    thinking_window_ms: float = 50.0
    """How long the motor populations are counted before a decision (paper: "a limited time"; model section 4: some 50 ms)."""


@dataclass(frozen=True)
class NetworkConfig:
    """The 1000 neurons: noise, drive and the fixed wiring (feasibility study, model section 5)."""

    precision: Precision = "float32"
    """Number format of the kernel: float32 for runs, float64 for cross-checks."""
    weight_low: float = 0.8
    """Lower end of the uniform initial weights."""
    weight_high: float = 1.2
    """Upper end of the uniform initial weights."""
    weight_max: float = 4.0
    """Weights are clipped to 0..weight_max (Izhikevich 2007: 0..4 mV)."""
    sensory_drive: float = 8.0
    """Current into every neuron of the sensed direction's population while the robot thinks."""
    advice_drive: float = 8.0
    """Current into every neuron of the motor population that the automaton advises while the robot thinks."""
    sensory_noise: float = 3.0
    """Standard deviation of the uniform noise current, sensory populations."""
    motor_noise: float = 5.0
    """Standard deviation of the uniform noise current, motor populations."""
    inhibitory_noise: float = 3.0
    """Standard deviation of the uniform noise current, inhibitory populations."""
    motor_to_inhibitory: float = 1.5
    """Weight from every motor neuron to every neuron of its own inhibitory population."""
    inhibitory_to_motor: float = -0.6
    """Weight from every inhibitory neuron to every neuron of the three other motor populations; 0 switches it off."""


@dataclass(frozen=True)
class PlasticityConfig:
    """STDP, eligibility and dopamine (equations 3 and 4 as Izhikevich 2007 has them)."""

    stdp_potentiation: float = 0.1
    """A+: eligibility added when a postsynaptic spike follows a presynaptic one (Izhikevich 2007)."""
    stdp_depression: float = 0.12
    """A-: eligibility taken when a presynaptic spike follows a postsynaptic one; above A+ so that chance pairs weaken."""
    stdp_tau_ms: float = 20.0
    """Time constant of both STDP traces (Izhikevich 2007)."""
    eligibility_tau_ms: float = 1000.0
    """tau_c of equation 3: bridges the second between a spike and its reward (Izhikevich 2007)."""
    dopamine_tau_ms: float = 200.0
    """Decay of the extracellular dopamine concentration (Izhikevich 2007)."""
    dopamine_release: float = 0.5
    """Concentration that one reward adds to a connection's dopamine, signed per connection (Izhikevich 2007: 0.5 uM)."""
    learning_rate_per_ms: float = 0.05
    """Rate of ds/dt = rate c d, applied every step (a gain the public codes of 2007 differ on by ten)."""


@dataclass(frozen=True)
class AutomatonConfig:
    """The learning automaton of every cell, and where the network's signal to it comes from (model section 4)."""

    scheme: Scheme = "reward-penalty"
    """How a signal changes the action probabilities (Narendra and Thathachar 1989; opposite-pair: the paper's own text)."""
    reward_rate: float = 0.5
    """a: reward p_i += a (1 - p_i)."""
    penalty_rate: float = 0.2
    """b: penalty p_i *= 1 - b, the rest shared by the others."""
    epsilon: float = 0.1
    """reward-epsilon-penalty uses epsilon times the penalty rate."""
    local_rule: bool = True
    """Signal from Table 1's F: a move into a better neighbour is good, into a worse one bad."""
    discount: float = 0.9
    """A cell's state is the best of its neighbours' states times this; the target's is 1."""
    distal_reward: bool = True
    """Signal from dopamine on arrival, to every cell left on the way, weighted by its trace."""
    trace_tau_moves: float = 1.5
    """Decay of that trace, in moves."""
    bump_penalty: bool = True
    """The environment's penalty: a blocked move is bad."""


@dataclass(frozen=True)
class ControllerConfig:
    """Decision in, wheel speeds out: hold the heading, drive in reverse where that saves a turn, re-aim."""

    max_speed_m_s: float = 0.5
    """Top speed of a straight drive."""
    max_acceleration_m_s2: float = 2.0
    """Below the grip and below what would lift the caster."""
    max_turn_rate_rad_s: float = 5.0
    """Top turn rate in place."""
    max_turn_acceleration_rad_s2: float = 30.0
    """Turn acceleration in place."""
    position_tolerance_m: float = 0.002
    """A drive ends this close to the cell's centre, along the way."""
    heading_tolerance_rad: float = 0.005
    """A turn ends this close to its heading."""
    reaim_fraction: float = 0.08
    """A move that ends further off than this fraction of a cell aims again..."""
    reaim_limit: int = 3
    """...at most this many times."""
    timeout_s: float = 10.0
    """A move that has not ended by then is reported as failed."""


@dataclass(frozen=True)
class RunConfig:
    """One run, whole."""

    protocol: StartProtocol = "any-start"
    """Where a hit re-spawns the robot: any other cell, or a neighbour of the target (docs/model.md, protocols)."""
    epochs: int = 10
    """Epochs to run (paper: 30)."""
    decisions: int = 1000
    """Decisions in an epoch (paper: 1000 time steps)."""
    seed: int = 0
    """Seed of every random stream."""
    telemetry: Telemetry = "light"
    """What recording.rrd keeps: nothing, the thinking windows, or every spike."""
    grid: Annotated[GridConfig, tyro.conf.arg(name="")] = field(default_factory=GridConfig)
    clock: ClockConfig = field(default_factory=ClockConfig)
    network: NetworkConfig = field(default_factory=NetworkConfig)
    plasticity: PlasticityConfig = field(default_factory=PlasticityConfig)
    automaton: AutomatonConfig = field(default_factory=AutomatonConfig)
    controller: ControllerConfig = field(default_factory=ControllerConfig)

    def build_grid(self) -> Grid:
        """Return the checked grid."""
        grid = self.grid
        return Grid(grid.cells, Cell(*grid.target), grid.cell_size_m)

    def build_clock(self) -> Clock:
        """Return the checked clock."""
        return resolve_clock(self.clock)

    def check(self) -> None:
        """Refuse, in one sentence, whatever cannot be run.

        Raises:
            SclaError: a value is out of its range; the sentence names the option, the value and the range.
        """
        self.build_grid()
        self.build_clock()
        _check_numbers(self)


def _check_numbers(config: RunConfig) -> None:
    values = flatten(config)
    for option, value in values.items():
        if isinstance(value, float) and not math.isfinite(value):
            raise SclaError(f"--{option} is {value}: it must be a finite number")
    for option, (low, high) in _RANGES.items():
        value = values[option]
        if not low <= value <= high:
            bound = f"{low:g} or more" if high == math.inf else f"{low:g} to {high:g}"
            raise SclaError(f"--{option} is {value}: it must be {bound}")
    if config.network.weight_low > config.network.weight_high:
        raise SclaError("--network.weight-low is above --network.weight-high: swap them")
    if config.network.weight_high > config.network.weight_max:
        raise SclaError("--network.weight-high is above --network.weight-max: initial weights must lie within the clip")


_TINY = 1e-6
_RANGES: dict[str, tuple[float, float]] = {
    "epochs": (1, math.inf),
    "decisions": (1, math.inf),
    "seed": (0, math.inf),
    "cell-size-m": (0.25, 10.0),
    "clock.neural-step-ms": (_TINY, 1.0),
    "clock.physics-step-ms": (_TINY, 20.0),
    "clock.control-period-ms": (_TINY, 100.0),
    "clock.thinking-window-ms": (_TINY, 10_000.0),
    "network.weight-low": (0.0, math.inf),
    "network.sensory-noise": (0.0, math.inf),
    "network.motor-noise": (0.0, math.inf),
    "network.inhibitory-noise": (0.0, math.inf),
    "plasticity.stdp-tau-ms": (_TINY, math.inf),
    "plasticity.eligibility-tau-ms": (_TINY, math.inf),
    "plasticity.dopamine-tau-ms": (_TINY, math.inf),
    "plasticity.learning-rate-per-ms": (0.0, math.inf),
    "automaton.reward-rate": (0.0, 1.0),
    "automaton.penalty-rate": (0.0, 1.0),
    "automaton.epsilon": (0.0, 1.0),
    "automaton.discount": (0.0, 1.0),
    "automaton.trace-tau-moves": (_TINY, math.inf),
    "controller.max-speed-m-s": (0.01, 0.6),
    "controller.max-acceleration-m-s2": (0.01, 2.5),
    "controller.max-turn-rate-rad-s": (0.1, 7.0),
    "controller.max-turn-acceleration-rad-s2": (0.1, 60.0),
    "controller.position-tolerance-m": (_TINY, 0.05),
    "controller.heading-tolerance-rad": (_TINY, 0.2),
    "controller.reaim-fraction": (0.005, 0.5),
    "controller.reaim-limit": (0, 100),
    "controller.timeout-s": (0.1, 600.0),
}


def flatten(config: RunConfig) -> dict[str, Any]:
    """Return every setting by its option's name, as the command line spells it."""
    flat: dict[str, Any] = {}
    for section in dataclasses.fields(config):
        value = getattr(config, section.name)
        if not dataclasses.is_dataclass(value):
            flat[section.name] = value
            continue
        prefix = "" if section.name == "grid" else f"{section.name}."
        for item in dataclasses.fields(value):
            flat[(prefix + item.name).replace("_", "-")] = getattr(value, item.name)
    return flat
