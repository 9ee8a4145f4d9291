"""Every setting of a run: its default, its range, and its source or reason, each stated once.

Where the paper is silent, docs/model.md says what is built and why. Lengths of time carry their unit in the name; a
number without a unit is a pure number. Ranges are checked by `scla_mj.checked`, for Python callers and the command line
alike.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Annotated, Any, Final, Literal

import tyro.conf
from annotated_types import Interval

from scla_mj.disturbances import DisturbanceConfig
from scla_mj.grid import StartProtocol
from scla_mj.randomness import MOST_SEED
from scla_mj.validation import Section

Telemetry = Literal["off", "light", "full"]
Scheme = Literal["reward-penalty", "reward-inaction", "reward-epsilon-penalty", "opposite-pair"]
Precision = Literal["float32", "float64"]
Modulation = Literal["signed", "scalar"]
Credit = Literal["executed", "decided"]
NeuronType = Literal[
    "regular-spiking", "intrinsically-bursting", "chattering", "fast-spiking", "low-threshold-spiking",
    "thalamo-cortical", "resonator",
]  # fmt: skip
Localisation = Literal["truth", "odometry", "sensors"]

TINY: Final = 1e-6
MOST_COUNT: Final = 10**9
"""Centuries of simulated time."""
Count = Annotated[int, Interval(ge=1, le=MOST_COUNT)]
Fraction = Annotated[float, Interval(ge=0.0, le=1.0)]
Weight = Annotated[float, Interval(ge=0.0, le=100.0)]
Current = Annotated[float, Interval(ge=-100.0, le=100.0)]  # 15 already drives a neuron to 30 Hz
Deviation = Annotated[float, Interval(ge=0.0, le=100.0)]
TimeConstant = Annotated[float, Interval(ge=0.05, le=3.6e6)]  # the shortest neural step, to an hour

CHECKPOINT_PERIOD_S: Final = 10.0
"""Wall time between two checkpoints: writing one costs some 0.02 s, a kill so much work at most. No setting of a run,
as no bit of it depends on this."""


@dataclass(frozen=True)
class GridConfig(Section):
    """The arena."""

    cells: tuple[int, int] = (5, 5)
    """Columns and rows of the arena (paper: 5 x 5)."""
    target: tuple[int, int] = (3, 3)
    """The target's column and row, from 1 (paper: 3 3)."""
    closed_cells: tuple[tuple[int, int], ...] = ()
    """Cells that are walls inside the arena, as column row column row ..."""
    cell_size_m: Annotated[float, Interval(ge=0.27, le=3.0)] = 0.30
    """Edge of a cell: about twice the robot's length, so that it turns without touching a wall; turning in place sweeps
    a circle of 0.133 m about the axle."""
    floor: str = ""
    """Text file with a map in place of the first three: closed cells, targets that move, starts, grip
    (docs/floor.md)."""
    floor_text: Annotated[str, tyro.conf.Suppress] = ""
    """The content of that file, which a run keeps, after a line with its name."""


@dataclass(frozen=True)
class TaskConfig(Section):
    """What makes the task harder than the paper's."""

    action_noise: Annotated[float, Interval(ge=0.0, le=0.75)] = 0.0
    """Probability that the executed direction is one of the three others (the paper's non-deterministic
    environment); at 3/4 a decision says nothing about the direction any more."""
    jump_epoch: Annotated[int, Interval(ge=0, le=MOST_COUNT)] = 0
    """From this epoch on the target is elsewhere; 0 for never. The brain is not informed."""
    jump_target: tuple[int, int] = (1, 5)
    """Where the target jumps to."""
    crossed_epoch: Annotated[int, Interval(ge=0, le=MOST_COUNT)] = 0
    """From this epoch on the wheels are crossed: left drives right, up drives down, and the reverse; 0 for never. The
    brain is not informed."""


@dataclass(frozen=True)
class ClockConfig(Section):
    """The one clock. Every period must be an integer multiple of the base step."""

    base_step_ms: Annotated[float, Interval(ge=TINY, le=1.0)] = 1.0
    """What every other period is counted in; no longer than the longest neural step."""
    neural_step_ms: Annotated[float, Interval(ge=0.05, le=1.0)] = 1.0
    """One step of every neuron (Izhikevich 2003 integrates with 1 ms, v in two halves); below 0.05 ms float32 gains
    nothing."""
    physics_step_ms: Annotated[float, Interval(ge=0.1, le=20.0)] = 10.0
    """One MuJoCo step; with the discrete integrator within 0.05 degrees a move of a 0.5 ms step (tested)."""
    control_period_ms: Annotated[float, Interval(ge=1.0, le=100.0)] = 10.0
    """One period of the wheel-speed controller; the longest move, one row per period, still fits into 60 MB."""
    thinking_window_ms: Annotated[float, Interval(ge=1.0, le=10_000.0)] = 50.0
    """How long the motor populations are counted before a decision (paper: "a limited time")."""


@dataclass(frozen=True)
class NetworkConfig(Section):
    """The 1000 neurons: noise, drive and the fixed wiring (docs/model.md, wiring)."""

    precision: Precision = "float32"
    """Number format of the kernel: float32 for runs, float64 for cross-checks."""
    weight_low: Weight = 0.8
    """Lower end of the uniform initial weights."""
    weight_high: Weight = 1.2
    """Upper end of the uniform initial weights."""
    weight_max: Weight = 4.0
    """Weights are clipped to 0..weight_max (Izhikevich 2007: 0..4 mV)."""
    sensory_drive: Current = 8.0
    """Current into every neuron of the sensed direction's population while the robot thinks."""
    advice_drive: Current = 8.0
    """Current into every neuron of the motor population that the automaton advises while the robot thinks."""
    sensory_noise: Deviation = 3.0
    """Standard deviation of the uniform noise current, sensory populations."""
    motor_noise: Deviation = 5.0
    """Standard deviation of the uniform noise current, motor populations."""
    inhibitory_noise: Deviation = 3.0
    """Standard deviation of the uniform noise current, inhibitory populations."""
    motor_to_inhibitory: Current = 1.5
    """Weight from every motor neuron to every neuron of its own inhibitory population."""
    inhibitory_to_motor: Current = -0.6
    """Weight from every inhibitory neuron to every neuron of the three other motor populations; 0 switches it off."""
    neurons: Annotated[int, Interval(ge=1000, le=100_000)] = 1000
    """Neurons in all, a multiple of 1000: the populations grow in their proportions, the synapses of a neuron stay as
    many."""
    sensory_type: NeuronType = "regular-spiking"
    """Parameters of the sensory neurons, by their name in Izhikevich 2003, Figure 2."""
    motor_type: NeuronType = "regular-spiking"
    """Those of the motor neurons."""
    inhibitory_type: NeuronType = "fast-spiking"
    """Those of the inhibitory neurons."""
    projections: tuple[str, ...] = ()
    """Projections beyond the paper's, such as SUtoML (plastic, like the eight, with a dopamine that rises after a hit
    and falls after a miss) or MUtoMD:-0.5 (fixed, all to all, with that weight)."""
    runs_while_driving: bool = True
    """One clock: neural time is physical time. Off, the network stands still while the wheels turn (an ablation:
    scla-printed, network)."""


@dataclass(frozen=True)
class PlasticityConfig(Section):
    """STDP, eligibility and dopamine (equations 3 and 4 as Izhikevich 2007 has them)."""

    stdp_potentiation: Annotated[float, Interval(ge=-10.0, le=10.0)] = 0.1
    """A+: eligibility added when a postsynaptic spike follows a presynaptic one (Izhikevich 2007)."""
    stdp_depression: Annotated[float, Interval(ge=-10.0, le=10.0)] = 0.12
    """A-: eligibility taken when a presynaptic spike follows a postsynaptic one; above A+ so that chance pairs
    weaken."""
    stdp_tau_ms: Annotated[float, Interval(ge=0.05, le=10_000.0)] = 20.0
    """Time constant of both STDP traces (Izhikevich 2007). This one and the next three: not below the neural step, as
    what has decayed within a step bridges nothing."""
    stdp_tau_minus_ms: Annotated[float, Interval(ge=0.0, le=10_000.0)] = 0.0
    """Time constant of the postsynaptic trace alone, by which a presynaptic spike depresses; 0 for that of both."""
    eligibility_tau_ms: TimeConstant = 1000.0
    """tau_c of equation 3: bridges the second between a spike and its reward (Izhikevich 2007)."""
    dopamine_tau_ms: TimeConstant = 200.0
    """Decay of the extracellular dopamine concentration (Izhikevich 2007)."""
    dopamine_release: Annotated[float, Interval(ge=-10.0, le=10.0)] = 0.5
    """Concentration that one reward adds to a connection's dopamine, signed per connection (scla-printed, network;
    Izhikevich 2007: 0.5 uM)."""
    dopamine_delay_s: Annotated[float, Interval(ge=0.0, le=60.0)] = 0.0
    """Time between a move's end and the dopamine for it (an ablation: scla-printed, network)."""
    modulation: Modulation = "signed"
    """signed: up for the agreeing connection, down for the opposite one; scalar: one value for all eight
    (scla-printed, network)."""
    learning_rate_per_ms: Annotated[float, Interval(ge=0.0, le=10.0)] = 0.05
    """Rate of ds/dt = rate c d, applied every step (a gain the public codes of 2007 differ on by ten)."""


@dataclass(frozen=True)
class AutomatonConfig(Section):
    """The learning automaton of every cell, and where the network's signal to it comes from (docs/model.md)."""

    scheme: Scheme = "reward-penalty"
    """How a signal changes the action probabilities (Narendra and Thathachar 1989; opposite-pair: the paper's own
    text)."""
    reward_rate: Fraction = 0.5
    """a: reward p_i += a (1 - p_i)."""
    penalty_rate: Fraction = 0.2
    """b: penalty p_i *= 1 - b, the rest shared by the others."""
    epsilon: Fraction = 0.1
    """reward-epsilon-penalty uses epsilon times the penalty rate."""
    local_rule: bool = True
    """Signal from Table 1's F: a move into a better neighbour is good, into a worse one bad (scla-printed,
    automata-*; scla's automata hear dopamine only)."""
    discount: Fraction = 0.9
    """A cell's state is the best of its neighbours' states times this; the target's is 1."""
    distal_reward: bool = True
    """Signal from dopamine on arrival, to every cell left on the way, weighted by its trace (scla-printed,
    automata-*)."""
    trace_tau_moves: Annotated[float, Interval(ge=TINY, le=10_000.0)] = 1.5  # ten epochs of the paper
    """Decay of that trace, in moves (scla-printed, automata-*)."""
    credit: Credit = "executed"
    """Which action a signal is for: the one the body reports to have executed, or the one that was decided
    (scla-printed, automata-*)."""
    bump_penalty: bool = True
    """The environment's penalty: a blocked move is bad (scla-printed, automata-*)."""


@dataclass(frozen=True)
class ControllerConfig(Section):
    """Decision in, wheel speeds out: hold the heading, drive in reverse where that saves a turn, re-aim."""

    max_speed_m_s: Annotated[float, Interval(ge=0.01, le=0.8)] = 0.8
    """Top speed of a straight drive: 24 rad/s of wheel, where the motors run up to 40 without load."""
    forward_acceleration_m_s2: Annotated[float, Interval(ge=0.01, le=2.5)] = 2.2
    """Pushing forwards (speeding up, or braking in reverse) lightens the wheels: the tyres would slip at 2.9."""
    backward_acceleration_m_s2: Annotated[float, Interval(ge=0.01, le=3.0)] = 2.6
    """Pushing backwards (braking, or speeding up in reverse) lightens the caster: the robot would tip at 3.2."""
    max_turn_rate_rad_s: Annotated[float, Interval(ge=0.1, le=8.0)] = 8.0
    """Top turn rate in place: what half of a quarter turn's acceleration leads to."""
    max_turn_acceleration_rad_s2: Annotated[float, Interval(ge=0.1, le=50.0)] = 40.0
    """Turn acceleration in place: uses half of the grip (the centre of mass lies 0.03 m behind the axle)."""
    position_tolerance_m: Annotated[float, Interval(ge=TINY, le=0.05)] = 0.002
    """A drive ends this close to the cell's centre, along the way."""
    heading_tolerance_rad: Annotated[float, Interval(ge=TINY, le=0.2)] = 0.02
    """A drive ends facing this close to its course (in practice within 0.001: the course is steered all the way)."""
    reaim_fraction: Annotated[float, Interval(ge=0.005, le=0.5)] = 0.08
    """A move that ends further off than this fraction of a cell aims again..."""
    reaim_limit: Annotated[int, Interval(ge=0, le=100)] = 3
    """...at most this many times."""
    timeout_s: Annotated[float, Interval(ge=0.1, le=600.0)] = 10.0
    """A move that has not ended by then is reported as failed."""


@dataclass(frozen=True)
class RunConfig(Section):
    """One run, whole."""

    protocol: StartProtocol = "any-start"
    """Where a hit re-spawns the robot: any other cell, or a neighbour of the target (docs/model.md, protocols)."""
    epochs: Count = 10
    """Epochs to run (paper: 30)."""
    decisions: Count = 1000
    """Decisions in an epoch (paper: 1000 time steps)."""
    seed: Annotated[int, Interval(ge=0, le=MOST_SEED)] = 0
    """Seed of every random stream."""
    brain: str = "scla"
    """scla (with one dopamine, scla-dopamine), scla-printed (as the paper prints it), network, automaton,
    automata-everywhere, automata-reflex, automata-coin, cell-states, q-learning, q-lambda, dyna-q, actor-critic,
    potjans, random, shortest-path; package.module:Class for your own, or PYTHON:SCRIPT.py for one in another Python."""
    telemetry: Telemetry = "light"
    """What recording.rrd keeps: nothing, the thinking windows, or every spike."""
    brain_settings: Annotated[dict[str, Any], tyro.conf.Suppress] = field(default_factory=dict)
    """Settings of the brain's own (its `Settings`), by name; on the command line --brain.NAME VALUE."""
    robot: str = "burger"
    """What is driven: burger, mouse (half as large), or the path of an MJCF file of your own (docs/robot.md)."""
    robot_sha256: Annotated[str, tyro.conf.Suppress] = ""
    """The digest of such a file, which a run keeps."""
    localisation: Localisation = "truth"
    """How the robot knows its position: from the simulator, by wheel encoders and gyro, or by these and range rays."""
    grid: Annotated[GridConfig, tyro.conf.arg(name="")] = field(default_factory=GridConfig)
    task: TaskConfig = field(default_factory=TaskConfig)
    clock: ClockConfig = field(default_factory=ClockConfig)
    network: NetworkConfig = field(default_factory=NetworkConfig)
    plasticity: PlasticityConfig = field(default_factory=PlasticityConfig)
    automaton: AutomatonConfig = field(default_factory=AutomatonConfig)
    controller: ControllerConfig = field(default_factory=ControllerConfig)
    disturbance: DisturbanceConfig = field(default_factory=DisturbanceConfig)


def flatten(config: RunConfig) -> dict[str, Any]:
    """Return every setting by its option's name, as the command line spells it."""
    flat: dict[str, Any] = {}
    for section in dataclasses.fields(config):
        value = getattr(config, section.name)
        if not dataclasses.is_dataclass(value):
            flat[option_of(section.name)] = value
            continue
        for item in dataclasses.fields(value):
            flat[option_of(section.name, item.name)] = getattr(value, item.name)
    return flat


def options_of(config: RunConfig) -> dict[str, Any]:
    """Return every setting by its option's name, with those of the brain's own that were given."""
    flat = flatten(config) | {f"brain.{option_of(name)}": value for name, value in config.brain_settings.items()}
    del flat["brain-settings"]
    return flat


def option_of(*path: str | int) -> str:
    """Return the option's name of a setting, such as "automaton.reward-rate", from the names that lead to it."""
    names = [str(part) for part in path if isinstance(part, str)]
    return ".".join(names[1:] if names[:1] == ["grid"] and len(names) > 1 else names).replace("_", "-")
