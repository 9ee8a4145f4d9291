"""The plastic synapses, updated so lazily that none is touched until its sensory neuron fires or dopamine is released.

Between two spikes of its sensory neuron i a synapse's eligibility gains only what spikes of its motor neuron j add, and
its weight only what eligibility and dopamine make of that. Both are products of something of i and something of j, so
a spike of j adds one number to a running sum, and i catches up from that sum when it fires next.

With E = `decayed` = exp(-t / tau_c) since the sensor's last `settle`, and G = `gathered` = the sum of rate E d since
then, Z = c / E is constant between spikes, and the weight goes with it: dw = Z dG. Within a stretch of steps n = 1, 2,
... what is left of a presynaptic trace, over E, is f = `fading` = exp(-n (1 / tau_stdp - 1 / tau_c)). So a motor spike
adds a f to Z, where a = `reach` = A+ x / E is constant until i fires again, and with

    P = `post` = the sum of f over j's spikes in this stretch,    Q = `post_gathered` = the sum of f S over them,

where S = how far G has come in this stretch, a synapse that was last updated when G was G_i and S was S_i has

    Z = `scaled` + a P                                what is stored:   `scaled` = Z_i - a P_i
    w = `weight` + `scaled` (G - G_i) + a (S P - Q)                     `weight` = w_i - a (S_i P_i - Q_i)

Motor spikes only raise Z, and dopamine keeps its sign until the next release, which settles: so a weight turns back at
most once, and clipping it at the end equals clipping it in every step, unless it reached the other bound before it
turned. `bring_on` finds where that cannot be ruled out; `_replay_doubts` replays such synapses spike by spike.

E, G and S, a few numbers for 80,000 synapses, are always float64: a sum of a thousand products in float32 would lose
digits.
"""

from typing import Any, Final

import numpy as np

from scla_mj.anatomy import PROJECTIONS
from scla_mj.brain.network.rows import (
    BLOCK,
    bring_on,
    deliver,
    depress,
    fill,
    hold_back,
    is_sure,
    potentiate,
    settle_row,
)
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
def open_stretch(m: Any) -> None:
    """Begin a stretch: no motor neuron has fired in it yet, and every sensory neuron's `reach` follows its trace."""
    zero = m.trace.dtype.type(0)
    size = m.synapses.shape[1]
    for side in range(SIDES):
        _keep_in_range(m, side)
        scale = m.plasticity.potentiation / m.trace.dtype.type(m.decayed[side])
        for neuron in range(side * size, (side + 1) * size):
            m.reach[neuron] = scale * m.trace[neuron]
    fill(m.since, 0)
    fill(m.post, zero)
    fill(m.last_spike, 0)
    fill(m.next_spike[0], 0)
    for k in range(m.gathered.shape[0]):
        m.opening[k] = m.gathered[k]
        m.course[k, 0] = 0.0
        fill(m.post_gathered[k], zero)


@leaf_njit(inline="always")
def _keep_in_range(m: Any, side: int) -> None:
    """Settle a sensor before E is so small that what is added to G would lose digits."""
    dosed = False
    for connection in range(CONNECTIONS):
        dosed |= m.dopamine[OUT_OF_SENSOR[side, connection]] != 0.0
    if m.decayed[side] < (m.rates.least_decayed_dosed if dosed else m.rates.least_decayed):
        settle(m, side)


@leaf_njit()
def close_stretch(m: Any, step: int) -> None:
    """End a stretch of `step` steps: catch up every sensory neuron with a trace; negligible traces become zero."""
    zero, trace_lower_bound = m.trace.dtype.type(0), m.plasticity.trace_lower_bound
    size = m.synapses.shape[1]
    for neuron in range(SIDES * size):
        if m.trace[neuron] > zero:
            side = neuron // size
            for connection in range(CONNECTIONS):
                k = OUT_OF_SENSOR[side, connection]
                if _is_still(m, k, neuron % size):
                    motor = MOTOR_OF[k] * size + neuron % size // BLOCK * BLOCK
                    potentiate(m.synapses[k, neuron % size].scaled, m.reach[neuron], m.post[motor : motor + BLOCK])
                else:
                    catch_up(m, k, neuron, step)
    for neuron in range(m.trace.shape[0]):
        if m.trace[neuron] < trace_lower_bound:
            m.trace[neuron] = zero


@leaf_njit(inline="always")
def sensory_spike(m: Any, side: int, row: int, step: int) -> None:
    """Deliver a sensory neuron's weights, depress their eligibility by the postsynaptic traces, raise its trace."""
    real = m.trace.dtype.type
    size = m.synapses.shape[1]
    neuron, first = side * size + row, row // BLOCK * BLOCK
    decayed = real(m.decayed[side])
    depression, raised = m.plasticity.depression / decayed, m.plasticity.potentiation / (m.fading[step] * decayed)
    reach = m.reach[neuron] + raised
    for connection in range(CONNECTIONS):
        k = OUT_OF_SENSOR[side, connection]
        motor = MOTOR_OF[k] * size + first
        post = m.post[motor : motor + BLOCK]
        motor += SIDES * size
        synapses = m.synapses[k, row]
        trace = m.trace[motor : motor + BLOCK]
        if _is_still(m, k, row):
            deliver(m.synaptic[motor : motor + BLOCK], synapses.weight)
            depress(synapses.scaled, depression, trace, raised, post)
            continue
        catch_up(m, k, neuron, step)
        deliver(m.synaptic[motor : motor + BLOCK], synapses.weight)
        depress(synapses.scaled, depression, trace, reach, post)
        since = real(m.gathered[k] - m.opening[k])
        hold_back(synapses.weight, reach, since, post, m.post_gathered[k, first : first + BLOCK])
    m.reach[neuron] = reach
    m.since[neuron] = step
    m.trace[neuron] += 1


@leaf_njit(inline="always")
def motor_spike(m: Any, side: int, row: int, step: int) -> None:
    """Add a motor neuron's spike to the sums from which sensory neurons catch up, and raise its trace."""
    real = m.trace.dtype.type
    size = m.synapses.shape[1]
    left = m.fading[step]
    motor = side * size + row
    m.post[motor] += left
    m.next_spike[m.last_spike[motor], motor] = step
    m.next_spike[step, motor] = 0
    m.last_spike[motor] = step
    for connection in range(CONNECTIONS):
        k = INTO_MOTOR[side, connection]
        m.post_gathered[k, row] += left * real(m.gathered[k] - m.opening[k])
    m.trace[SIDES * size + motor] += 1


@leaf_njit(inline="always")
def _is_still(m: Any, k: int, row: int) -> bool:
    """Return whether a neuron's weights are unchanged since its last update and during this whole stretch."""
    return bool(m.gathered[k] == m.gathered_at[k, row] and m.gathered[k] == m.opening[k])


@leaf_njit(inline="always")
def catch_up(m: Any, k: int, neuron: int, step: int) -> None:
    """Bring the stored Z and w of a sensory neuron's synapses in a projection up to date, as if its reach were 0."""
    real = m.trace.dtype.type
    size = m.synapses.shape[1]
    row = neuron % size
    first = row // BLOCK * BLOCK
    reach, weight_max = m.reach[neuron], m.plasticity.weight_max
    motor = MOTOR_OF[k] * size + first
    post = m.post[motor : motor + BLOCK]
    post_gathered = m.post_gathered[k, first : first + BLOCK]
    moved = real(m.gathered[k] - m.gathered_at[k, row])
    since = real(m.gathered[k] - m.opening[k])
    bring_on(m.synapses[k, row], post, post_gathered, reach, moved, since, weight_max, m.table)
    if not is_sure(m.table.margin_bits, m.sign_bits):
        _replay_doubts(m, k, neuron, step)
    m.gathered_at[k, row] = m.gathered[k]


@leaf_njit()
def _replay_doubts(m: Any, k: int, neuron: int, step: int) -> None:
    """Recompute each doubtful synapse of a row motor spike by motor spike, clipping after each."""
    size = m.synapses.shape[1]
    row = neuron % size
    motor = MOTOR_OF[k] * size + row // BLOCK * BLOCK
    reach, since = float(m.reach[neuron]), m.since[neuron]
    began, weight_max = m.gathered_at[k, row] - m.opening[k], float(m.plasticity.weight_max)
    synapses = m.synapses[k, row]
    for j in range(BLOCK):
        if m.table.margin[j] >= 0.0:
            continue
        z, w, gathered = float(m.table.scaled[j]), float(m.table.weight[j]), began
        at = m.next_spike[0, motor + j]
        while at:
            gain, then = reach * float(m.fading[at]), m.course[k, at]
            if at < since:  # what is stored is smaller by this
                w += gain * (gathered - then)
            else:
                w = min(max(w + z * (then - gathered), 0.0), weight_max)
                gathered = then
            z += gain
            at = m.next_spike[at, motor + j]
        synapses.weight[j] = min(max(w + z * (m.course[k, step] - gathered), 0.0), weight_max)
        synapses.scaled[j] = z


@leaf_njit()
def settle(m: Any, side: int) -> None:
    """Between two stretches, bring a sensor's `scaled` to its eligibility c and `weight` to w, with E = 1 and G = 0."""
    real = m.trace.dtype.type
    weight_max, lower_bound = m.plasticity.weight_max, m.plasticity.lower_bound
    for connection in range(CONNECTIONS):
        k = OUT_OF_SENSOR[side, connection]
        for row in range(m.synapses.shape[1]):
            moved = real(m.gathered[k] - m.gathered_at[k, row])
            synapses = m.synapses[k, row]
            settle_row(synapses.weight, synapses.scaled, moved, real(m.decayed[side]), weight_max, lower_bound)
            m.gathered_at[k, row] = 0.0
        m.gathered[k] = 0.0
    m.decayed[side] = 1.0
