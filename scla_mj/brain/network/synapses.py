"""The plastic synapses, kept so lazily that nothing touches one until its sensory neuron fires or dopamine is released.

Between two spikes of its sensory neuron i a synapse's eligibility gains only what spikes of its motor neuron j add, and
its weight only what eligibility and dopamine make of that. Both are products of something of i and something of j, so
a spike of j is one number added to a running sum, and i takes what it missed from that sum when it fires next.

With E = `decayed` = exp(-t / tau_c) since the sensor's last `settle`, and G = `gathered` = the sum of rate E d since
then, Z = c / E is constant between spikes, and the weight goes with it: dw = Z dG. Within a stretch of steps n = 1, 2,
... what is left of a presynaptic trace, over E, is f = `fading` = exp(-n (1 / tau_stdp - 1 / tau_c)). So a motor spike
adds a f to Z, where a = `reach` = A+ x / E is constant until i fires again, and with

    P = `post` = the sum of f over j's spikes in this stretch,    Q = `post_gathered` = the sum of f S over them,

where S = how far G has come in this stretch, a synapse that was last looked at when G was G_i and S was S_i has

    Z = `scaled` + a P                                what is stored:   `scaled` = Z_i - a P_i
    w = `weight` + `scaled` (G - G_i) + a (S P - Q)                     `weight` = w_i - a (S_i P_i - Q_i)

Motor spikes only ever raise Z, and dopamine keeps its sign until it is released anew, which settles: so a weight's way
turns back once at most, and to clip it at the end is to clip it all the way, unless it would have met the other bound
before it turned. `might_stick` finds where that cannot be ruled out; `_replay_doubts` walks such synapses through
the stretch spike by spike.

E, G and S, a few numbers for 80,000 synapses, are float64 always: a sum of a thousand products in float32 would lose
digits.
"""

from typing import Any, Final

import numpy as np

from scla_mj.anatomy import PROJECTIONS
from scla_mj.brain.network.parameters import PlasticityConstants, Rates
from scla_mj.brain.network.rows import (
    BLOCK,
    bring_on,
    deliver,
    depress,
    fill,
    hold_back,
    might_stick,
    potentiate,
    settle_row,
)
from scla_mj.brain.network.state import Synapses
from scla_mj.compiled import leaf_njit
from scla_mj.grid import Action

SIDES: Final = len(Action)
CONNECTIONS: Final = 2
"""Projections out of a sensory population, and into a motor population."""
SENSOR_OF: Final = np.array([int(p.sensor) for p in PROJECTIONS])
MOTOR_OF: Final = np.array([int(p.motor) for p in PROJECTIONS])
OUT_OF_SENSOR: Final = np.array([[k for k, p in enumerate(PROJECTIONS) if p.sensor == side] for side in Action])
INTO_MOTOR: Final = np.array([[k for k, p in enumerate(PROJECTIONS) if p.motor == side] for side in Action])


@leaf_njit()
def open_stretch(s: Synapses, p: PlasticityConstants, rates: Rates) -> None:
    """Begin a stretch: no motor neuron has fired in it, and every sensory neuron's trace reaches as far as it does."""
    real = s.weight.dtype.type
    size = s.weight.shape[1]
    for side in range(SIDES):
        _keep_in_range(s, p, rates, side)
        scale = p.potentiation / real(s.decayed[side])
        for neuron in range(side * size, (side + 1) * size):
            s.reach[neuron] = scale * s.trace[neuron]
            s.since[neuron] = 0
            s.post[neuron] = p.zero
            s.last_spike[neuron] = s.next_spike[0, neuron] = 0
    for k in range(s.gathered.shape[0]):
        s.opening[k] = s.gathered[k]
        s.course[k, 0] = 0.0
        fill(s.post_gathered[k], p.zero)


@leaf_njit(inline="always")
def _keep_in_range(s: Synapses, p: PlasticityConstants, rates: Rates, side: int) -> None:
    """Settle a sensor before E is too small: beside it G would lose the digits that new spikes still need."""
    dosed = False
    for connection in range(CONNECTIONS):
        dosed |= s.dopamine[OUT_OF_SENSOR[side, connection]] != 0.0
    if s.decayed[side] < (rates.least_decayed_dosed if dosed else rates.least_decayed):
        settle(s.weight, s.scaled, s.decayed, s.gathered, s.gathered_at, p, side)


@leaf_njit()
def close_stretch(s: Synapses, p: PlasticityConstants, fading: Any, step: int) -> None:
    """End a stretch of `step` steps: give every sensory neuron with a trace what it missed; drop traces that faded."""
    size = s.weight.shape[1]
    for neuron in range(SIDES * size):
        if s.trace[neuron] > p.zero:
            side = neuron // size
            for connection in range(CONNECTIONS):
                k = OUT_OF_SENSOR[side, connection]
                if _is_still(s.gathered[k], s.gathered_at[k, neuron % size], s.opening[k]):
                    motor = MOTOR_OF[k] * size + neuron % size // BLOCK * BLOCK
                    potentiate(s.scaled[k, neuron % size], s.reach[neuron], s.post[motor : motor + BLOCK])
                else:
                    catch_up(s, p, fading, k, neuron, step)
    for neuron in range(s.trace.shape[0]):
        if s.trace[neuron] < p.trace_floor:
            s.trace[neuron] = p.zero


@leaf_njit(inline="always")
def sensory_spike(
    s: Synapses, synaptic: Any, p: PlasticityConstants, fading: Any, side: int, row: int, step: int
) -> None:
    """Deliver a sensory neuron's weights, depress their eligibility by the postsynaptic traces, raise its trace."""
    real = s.weight.dtype.type
    size = s.weight.shape[1]
    neuron, first = side * size + row, row // BLOCK * BLOCK
    decayed = real(s.decayed[side])
    depression, raised = p.depression / decayed, p.potentiation / (fading[step] * decayed)
    reach = s.reach[neuron] + raised
    for connection in range(CONNECTIONS):
        k = OUT_OF_SENSOR[side, connection]
        motor = MOTOR_OF[k] * size + first
        post = s.post[motor : motor + BLOCK]
        motor += SIDES * size
        weight, scaled = s.weight[k, row], s.scaled[k, row]
        trace = s.trace[motor : motor + BLOCK]
        if _is_still(s.gathered[k], s.gathered_at[k, row], s.opening[k]):
            deliver(synaptic[motor : motor + BLOCK], weight)
            depress(scaled, depression, trace, raised, post)
            continue
        catch_up(s, p, fading, k, neuron, step)
        deliver(synaptic[motor : motor + BLOCK], weight)
        depress(scaled, depression, trace, reach, post)
        since = real(s.gathered[k] - s.opening[k])
        hold_back(weight, reach, since, post, s.post_gathered[k, first : first + BLOCK])
    s.reach[neuron] = reach
    s.since[neuron] = step
    s.trace[neuron] += 1


@leaf_njit(inline="always")
def motor_spike(s: Synapses, fading: Any, side: int, row: int, step: int) -> None:
    """Add a motor neuron's spike to what sensory neurons will take from it, and raise its trace."""
    real = s.weight.dtype.type
    size = s.weight.shape[1]
    left = fading[step]
    motor = side * size + row
    s.post[motor] += left
    s.next_spike[s.last_spike[motor], motor] = step
    s.next_spike[step, motor] = 0
    s.last_spike[motor] = step
    for connection in range(CONNECTIONS):
        k = INTO_MOTOR[side, connection]
        s.post_gathered[k, row] += left * real(s.gathered[k] - s.opening[k])
    s.trace[SIDES * size + motor] += 1


@leaf_njit(inline="always")
def _is_still(gathered: float, gathered_at: float, opening: float) -> bool:
    """Tell whether a neuron's weights have stood since it was last looked at, and in this whole stretch."""
    return gathered == gathered_at and gathered == opening


@leaf_njit(inline="always")
def catch_up(s: Synapses, p: PlasticityConstants, fading: Any, k: int, neuron: int, step: int) -> None:
    """Make what is stored of a sensory neuron's synapses in a projection the Z and w of now, as if its reach were 0."""
    real = s.weight.dtype.type
    size = s.weight.shape[1]
    row = neuron % size
    first = row // BLOCK * BLOCK
    reach = s.reach[neuron]
    motor = MOTOR_OF[k] * size + first
    post = s.post[motor : motor + BLOCK]
    weight, scaled = s.weight[k, row], s.scaled[k, row]
    post_gathered = s.post_gathered[k, first : first + BLOCK]
    moved = real(s.gathered[k] - s.gathered_at[k, row])
    since = real(s.gathered[k] - s.opening[k])
    doubtful = might_stick(weight, scaled, post, post_gathered, reach, moved, since, p, s.doubts)
    if doubtful:
        _replay_doubts(s, p, fading, k, neuron, step)
    bring_on(weight, scaled, post, post_gathered, reach, moved, since, p)
    if doubtful:
        _put_replayed(weight, scaled, s.doubts, s.replayed)
    s.gathered_at[k, row] = s.gathered[k]


@leaf_njit()
def _replay_doubts(s: Synapses, p: PlasticityConstants, fading: Any, k: int, neuron: int, step: int) -> None:
    """Catch each doubtful synapse of a row up motor spike by motor spike, clipped after each, into `replayed`."""
    size = s.weight.shape[1]
    row = neuron % size
    motor = MOTOR_OF[k] * size + row // BLOCK * BLOCK
    reach, since = float(s.reach[neuron]), s.since[neuron]
    began, weight_max = s.gathered_at[k, row] - s.opening[k], float(p.weight_max)
    for j in range(BLOCK):
        if not s.doubts[j]:
            continue
        z, w, gathered = float(s.scaled[k, row, j]), float(s.weight[k, row, j]), began
        at = s.next_spike[0, motor + j]
        while at:
            gain, then = reach * float(fading[at]), s.course[k, at]
            if at < since:  # what was stored is less than it was by this
                w += gain * (gathered - then)
            else:
                w = min(max(w + z * (then - gathered), 0.0), weight_max)
                gathered = then
            z += gain
            at = s.next_spike[at, motor + j]
        s.replayed[0, j] = min(max(w + z * (s.course[k, step] - gathered), 0.0), weight_max)
        s.replayed[1, j] = z


@leaf_njit()
def _put_replayed(weight: Any, scaled: Any, doubts: Any, replayed: Any) -> None:
    for j in range(BLOCK):
        if doubts[j]:
            weight[j], scaled[j] = replayed[0, j], replayed[1, j]


@leaf_njit()
def settle(
    weight: Any, scaled: Any, decayed: Any, gathered: Any, gathered_at: Any, p: PlasticityConstants, side: int
) -> None:
    """Between two stretches, make `scaled` a sensor's eligibility c, and `weight` its weights: E is 1 and G is 0."""
    real = weight.dtype.type
    for connection in range(CONNECTIONS):
        k = OUT_OF_SENSOR[side, connection]
        for row in range(weight.shape[1]):
            moved = real(gathered[k] - gathered_at[k, row])
            settle_row(weight[k, row], scaled[k, row], moved, real(decayed[side]), p)
            gathered_at[k, row] = 0.0
        gathered[k] = 0.0
    decayed[side] = 1.0
