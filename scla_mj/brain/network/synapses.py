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
from scla_mj.brain.network.parameters import Parameters, PlasticityConstants
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
from scla_mj.brain.network.state import NetworkState, Stretch
from scla_mj.compiled import leaf_njit
from scla_mj.grid import Action

SIDES: Final = len(Action)
CONNECTIONS: Final = 2
"""Projections out of a sensory population, and into a motor population."""
SENSOR_OF: Final = np.array([int(p.sensor) for p in PROJECTIONS])
MOTOR_OF: Final = np.array([int(p.motor) for p in PROJECTIONS])
OUT_OF_SENSOR: Final = np.array([[k for k, p in enumerate(PROJECTIONS) if p.sensor == side] for side in Action])
INTO_MOTOR: Final = np.array([[k for k, p in enumerate(PROJECTIONS) if p.motor == side] for side in Action])


@leaf_njit(inline="always")
def open_stretch(state: NetworkState, stretch: Stretch, parameters: Parameters) -> None:
    """Begin a stretch: no motor neuron has fired in it, and every sensory neuron's trace reaches as far as it does."""
    p = parameters.plasticity
    real = state.weight.dtype.type
    size = state.weight.shape[1]
    for side in range(SIDES):
        _keep_in_range(state, parameters, side)
        scale = p.potentiation / real(state.decayed[side])
        for neuron in range(side * size, (side + 1) * size):
            stretch.reach[neuron] = scale * state.trace[neuron]
            stretch.since[neuron] = 0
            stretch.post[neuron] = p.zero
            stretch.last_spike[neuron] = stretch.next_spike[0, neuron] = 0
    for k in range(state.gathered.shape[0]):
        stretch.opening[k] = state.gathered[k]
        stretch.course[k, 0] = 0.0
        fill(stretch.post_gathered[k], p.zero)


@leaf_njit(inline="always")
def _keep_in_range(state: NetworkState, parameters: Parameters, side: int) -> None:
    """Settle a sensor before E is too small: beside it G would lose the digits that new spikes still need."""
    rates = parameters.rates
    dosed = False
    for connection in range(CONNECTIONS):
        dosed |= state.dopamine[OUT_OF_SENSOR[side, connection]] != 0.0
    if state.decayed[side] < (rates.least_decayed_dosed if dosed else rates.least_decayed):
        settle(state, parameters.plasticity, side)


@leaf_njit(inline="always")
def close_stretch(state: NetworkState, stretch: Stretch, parameters: Parameters, step: int) -> None:
    """End a stretch of `step` steps: give every sensory neuron with a trace what it missed; drop traces that faded."""
    p = parameters.plasticity
    size = state.weight.shape[1]
    for neuron in range(SIDES * size):
        if state.trace[neuron] > p.zero:
            side = neuron // size
            for connection in range(CONNECTIONS):
                catch_up(state, stretch, parameters, OUT_OF_SENSOR[side, connection], neuron, step)
    for neuron in range(state.trace.shape[0]):
        if state.trace[neuron] < p.trace_floor:
            state.trace[neuron] = p.zero


@leaf_njit(inline="always")
def sensory_spike(
    state: NetworkState, stretch: Stretch, parameters: Parameters, side: int, row: int, step: int
) -> None:
    """Deliver a sensory neuron's weights, depress their eligibility by the postsynaptic traces, raise its trace."""
    p, real = parameters.plasticity, state.weight.dtype.type
    size = state.weight.shape[1]
    neuron, first = side * size + row, row // BLOCK * BLOCK
    decayed = real(state.decayed[side])
    depression, raised = p.depression / decayed, p.potentiation / (parameters.fading[step] * decayed)
    reach = stretch.reach[neuron] + raised
    for connection in range(CONNECTIONS):
        k = OUT_OF_SENSOR[side, connection]
        motor = MOTOR_OF[k] * size + first
        post = stretch.post[motor : motor + BLOCK]
        motor += SIDES * size
        weight, scaled = state.weight[k, row], state.scaled[k, row]
        trace = state.trace[motor : motor + BLOCK]
        if _is_still(state, stretch, k, row):
            deliver(state.synaptic[motor : motor + BLOCK], weight)
            depress(scaled, depression, trace, raised, post)
            continue
        catch_up(state, stretch, parameters, k, neuron, step)
        deliver(state.synaptic[motor : motor + BLOCK], weight)
        depress(scaled, depression, trace, reach, post)
        since = real(state.gathered[k] - stretch.opening[k])
        hold_back(weight, reach, since, post, stretch.post_gathered[k, first : first + BLOCK])
    stretch.reach[neuron] = reach
    stretch.since[neuron] = step
    state.trace[neuron] += 1


@leaf_njit(inline="always")
def motor_spike(state: NetworkState, stretch: Stretch, parameters: Parameters, side: int, row: int, step: int) -> None:
    """Add a motor neuron's spike to what sensory neurons will take from it, and raise its trace."""
    real = state.weight.dtype.type
    size = state.weight.shape[1]
    fading = parameters.fading[step]
    motor = side * size + row
    stretch.post[motor] += fading
    stretch.next_spike[stretch.last_spike[motor], motor] = step
    stretch.next_spike[step, motor] = 0
    stretch.last_spike[motor] = step
    for connection in range(CONNECTIONS):
        k = INTO_MOTOR[side, connection]
        stretch.post_gathered[k, row] += fading * real(state.gathered[k] - stretch.opening[k])
    state.trace[SIDES * size + motor] += 1


@leaf_njit(inline="always")
def _is_still(state: NetworkState, stretch: Stretch, k: int, row: int) -> bool:
    """Tell whether a neuron's weights have stood since it was last looked at, and in this whole stretch."""
    gathered = state.gathered[k]
    return bool(gathered == state.gathered_at[k, row] and gathered == stretch.opening[k])


@leaf_njit(inline="always")
def catch_up(state: NetworkState, stretch: Stretch, parameters: Parameters, k: int, neuron: int, step: int) -> None:
    """Make what is stored of a sensory neuron's synapses in a projection the Z and w of now, as if its reach were 0."""
    p, real = parameters.plasticity, state.weight.dtype.type
    size = state.weight.shape[1]
    row = neuron % size
    first = row // BLOCK * BLOCK
    reach = stretch.reach[neuron]
    motor = MOTOR_OF[k] * size + first
    post = stretch.post[motor : motor + BLOCK]
    weight, scaled = state.weight[k, row], state.scaled[k, row]
    if _is_still(state, stretch, k, row):
        potentiate(scaled, reach, post)
        return
    post_gathered = stretch.post_gathered[k, first : first + BLOCK]
    moved = real(state.gathered[k] - state.gathered_at[k, row])
    since = real(state.gathered[k] - stretch.opening[k])
    doubtful = might_stick(weight, scaled, post, post_gathered, reach, moved, since, p, stretch.doubts)
    if doubtful:
        _replay_doubts(state, stretch, parameters, k, neuron, step)
    bring_on(weight, scaled, post, post_gathered, reach, moved, since, p)
    if doubtful:
        _put_replayed(weight, scaled, stretch.doubts, stretch.replayed)
    state.gathered_at[k, row] = state.gathered[k]


@leaf_njit()
def _replay_doubts(
    state: NetworkState, stretch: Stretch, parameters: Parameters, k: int, neuron: int, step: int
) -> None:
    """Catch each doubtful synapse of a row up motor spike by motor spike, clipped after each, into `replayed`."""
    size = state.weight.shape[1]
    row = neuron % size
    motor = MOTOR_OF[k] * size + row // BLOCK * BLOCK
    reach, since = float(stretch.reach[neuron]), stretch.since[neuron]
    began, weight_max = state.gathered_at[k, row] - stretch.opening[k], float(parameters.plasticity.weight_max)
    for j in range(BLOCK):
        if not stretch.doubts[j]:
            continue
        z, w, gathered = float(state.scaled[k, row, j]), float(state.weight[k, row, j]), began
        at = stretch.next_spike[0, motor + j]
        while at:
            gain, then = reach * float(parameters.fading[at]), stretch.course[k, at]
            if at < since:  # what was stored is less than it was by this
                w += gain * (gathered - then)
            else:
                w = min(max(w + z * (then - gathered), 0.0), weight_max)
                gathered = then
            z += gain
            at = stretch.next_spike[at, motor + j]
        stretch.replayed[0, j] = min(max(w + z * (stretch.course[k, step] - gathered), 0.0), weight_max)
        stretch.replayed[1, j] = z


@leaf_njit()
def _put_replayed(weight: Any, scaled: Any, doubts: Any, replayed: Any) -> None:
    for j in range(BLOCK):
        if doubts[j]:
            weight[j], scaled[j] = replayed[0, j], replayed[1, j]


@leaf_njit()
def settle(state: NetworkState, p: PlasticityConstants, side: int) -> None:
    """Between two stretches, make `scaled` a sensor's eligibility c, and `weight` its weights: E is 1 and G is 0."""
    real = state.weight.dtype.type
    for connection in range(CONNECTIONS):
        k = OUT_OF_SENSOR[side, connection]
        for row in range(state.weight.shape[1]):
            moved = real(state.gathered[k] - state.gathered_at[k, row])
            settle_row(state.weight[k, row], state.scaled[k, row], moved, real(state.decayed[side]), p)
            state.gathered_at[k, row] = 0.0
        state.gathered[k] = 0.0
    state.decayed[side] = 1.0
