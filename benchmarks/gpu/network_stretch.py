"""What a stretch of steps begins and ends with, and the kernels: all phases of a brain in one, or one of all brains."""

from __future__ import annotations

from typing import Final

import warp as wp

from benchmarks.gpu.network_arrays import Constants, Memory
from benchmarks.gpu.network_kernels import (
    CONNECTIONS,
    EXCITATORY,
    GROUPS,
    INTO,
    OUT,
    PER_STEP,
    SENSORY,
    SIDES,
    N,
    after_sensory_spike,
    caught_up,
    is_still,
    neurons,
    route,
    sensor_of,
)
from scla_mj.anatomy import NEURON_COUNT, PROJECTIONS
from scla_mj.brain.network.parameters import STRETCH_STEPS

THREADS: Final = wp.constant(256)
BLOCKS: Final = 2
"""Of a brain, on a GPU, which has room for at least two brains in each processor then."""
PLASTIC: Final = wp.constant(len(PROJECTIONS))
ALL: Final = wp.constant(NEURON_COUNT)
REACHED: Final = wp.constant(NEURON_COUNT - int(SENSORY))
"""Motor and inhibitory neurons."""
STEPS: Final = wp.constant(STRETCH_STEPS + 1)
OPEN, SETTLE, READY, NEURONS, ROUTE, FINISH, CLOSE, TIDY = range(8)
"""The phases, in their order; the fourth and fifth are those of each step."""
MANY: Final = (PLASTIC, SENSORY, SENSORY, ALL, REACHED, SENSORY, SENSORY, EXCITATORY)
"""Their threads."""

# The CPU's compiler fuses no product with a sum either; a fused one has other last bits.
wp.set_module_options({"fuse_fp": False, "enable_backward": False})


@wp.func(inline=True)
def open_stretch(m: Memory, c: Constants, b: int, k: int, step: int) -> None:
    """Per projection: release dopamine, say which sensors are to be settled, and run what no spike changes ahead."""
    steps = wp.min(c.stretch_steps, m.left[b])
    if k == 0:
        m.length[b] = steps
    if steps == 0:
        return
    side = sensor_of(k)
    settles = wp.bool(False)
    dosed = wp.bool(False)
    for connection in range(CONNECTIONS):
        out = OUT[side, connection]
        settles = settles or m.released[b, out] != wp.float64(0.0)
        dosed = dosed or m.dopamine[b, out] + m.released[b, out] != wp.float64(0.0)
    settles = settles or m.decayed[b, side] < wp.where(dosed, c.least_decayed_dosed, c.least_decayed)
    decayed = wp.where(settles, wp.float64(1.0), m.decayed[b, side])
    gathered = wp.where(settles, wp.float64(0.0), m.gathered[b, k])
    dopamine = m.dopamine[b, k] + m.released[b, k]
    m.gathers[b, 0, k] = gathered
    if k == OUT[side, 0]:
        m.settles[b, side] = wp.int32(settles)
        m.decays[b, 0, side] = decayed
    for step in range(1, steps + 1):
        decayed = decayed * c.eligibility_decay
        if dopamine != wp.float64(0.0):
            dopamine = dopamine * c.dopamine_decay
            if wp.abs(dopamine) < wp.float64(c.lower_bound):
                dopamine = wp.float64(0.0)
            gathered = gathered + c.learning_rate * dopamine * decayed
        m.gathers[b, step, k] = gathered
        if k == OUT[side, 0]:
            m.decays[b, step, side] = decayed
    m.dopamine_after[b, k] = dopamine


@wp.func(inline=True)
def settle(m: Memory, c: Constants, b: int, motor: int, step: int) -> None:
    """Per motor neuron: settle its synapses from sensors that are to be settled, and empty its sums."""
    if step == 0:
        return
    side = motor // N
    j = motor % N
    for connection in range(CONNECTIONS):
        k = INTO[side, connection]
        sensor = sensor_of(k)
        m.post_gathered[b, k, j] = 0.0
        if m.settles[b, sensor] != 0:
            decayed = wp.float32(m.decayed[b, sensor])
            for row in range(N):
                moved = wp.float32(m.gathered[b, k] - m.gathered_at[b, k, row])
                scaled = m.scaled[b, k, row, j]
                if moved != 0.0:
                    m.weight[b, k, row, j] = wp.min(wp.max(m.weight[b, k, row, j] + scaled * moved, 0.0), c.weight_max)
                eligibility = scaled * decayed
                m.scaled[b, k, row, j] = wp.where(wp.abs(eligibility) >= c.lower_bound, eligibility, 0.0)
    for word in range(motor, STEPS * PER_STEP, SENSORY):
        m.spikes[b, word] = wp.uint32(0)
    for group in range(motor, STEPS * GROUPS, SENSORY):
        m.counted[b, group] = 0
    m.post[b, motor] = 0.0
    m.last_spike[b, motor] = 0
    m.next_spike[b, 0, motor] = wp.uint8(0)


@wp.func(inline=True)
def ready(m: Memory, c: Constants, b: int, neuron: int, step: int) -> None:
    """Per sensory neuron: what its trace amounts to in this stretch."""
    if step == 0:
        return
    side = neuron // N
    if m.settles[b, side] != 0:
        for connection in range(CONNECTIONS):
            m.gathered_at[b, OUT[side, connection], neuron % N] = wp.float64(0.0)
    scale = c.potentiation / wp.float32(m.decays[b, 0, side])
    m.reach[b, neuron] = scale * m.trace[b, neuron]
    m.since[b, neuron] = 0


@wp.func(inline=True)
def finish(m: Memory, c: Constants, b: int, neuron: int, step: int) -> None:
    """Per sensory neuron: what a spike in the stretch's last step changes."""
    if step > 0 and m.fired[b, neuron] != wp.uint8(0):
        after_sensory_spike(m, c, b, neuron, step)


@wp.func(inline=True)
def close_stretch(m: Memory, c: Constants, b: int, motor: int, step: int) -> None:
    """Per motor neuron: bring its synapses from neurons with a trace up to date."""
    if step == 0:
        return
    j = motor % N
    for connection in range(CONNECTIONS):
        k = INTO[motor // N, connection]
        first = sensor_of(k) * N
        for row in range(N):
            if m.trace[b, first + row] > 0.0:
                if is_still(m, b, k, row, step):
                    m.scaled[b, k, row, j] = m.scaled[b, k, row, j] + m.reach[b, first + row] * m.post[b, motor]
                else:
                    w, z = caught_up(m, c, b, k, row, motor, step)
                    m.weight[b, k, row, j] = w
                    m.scaled[b, k, row, j] = z


@wp.func(inline=True)
def tidy(m: Memory, c: Constants, b: int, i: int, step: int) -> None:
    """Per sensory and motor neuron: drop a negligible trace; and hand what the stretch came to over to the next."""
    if step == 0:
        return
    if i < SENSORY and m.trace[b, i] > 0.0:
        for connection in range(CONNECTIONS):
            k = OUT[i // N, connection]
            m.gathered_at[b, k, i % N] = m.gathers[b, step, k]
    if m.trace[b, i] < c.trace_lower_bound:
        m.trace[b, i] = 0.0
    if i < SIDES:
        m.decayed[b, i] = m.decays[b, step, i]
    if i < CONNECTIONS * SIDES:
        m.gathered[b, i] = m.gathers[b, step, i]
        m.dopamine[b, i] = m.dopamine_after[b, i]
        m.released[b, i] = wp.float64(0.0)
    if i < m.total.shape[1]:
        for n in range(1, step + 1):
            m.total[b, i] = m.total[b, i] + m.counted[b, n * GROUPS + i]
    if i == 0:
        m.left[b] = m.left[b] - step


@wp.func_native("""
#if defined(__CUDA_ARCH__)
__syncthreads();
#endif
""")
def _wait() -> None: ...


@wp.kernel(launch_bounds=(THREADS, BLOCKS))
def advance(m: Memory, c: Constants) -> None:
    """On a GPU: all steps of every network, with `THREADS` threads for each."""
    b, t = wp.tid()
    while m.left[b] > 0:
        if t < PLASTIC:
            open_stretch(m, c, b, t, 0)
        _wait()
        length = m.length[b]
        for i in range(t, SENSORY, THREADS):
            settle(m, c, b, i, length)
        _wait()
        for i in range(t, SENSORY, THREADS):
            ready(m, c, b, i, length)
        _wait()
        for step in range(1, length + 1):
            for i in range(t, ALL, THREADS):
                neurons(m, c, b, i, step)
            _wait()
            for i in range(t, REACHED, THREADS):
                route(m, c, b, i, step)
            _wait()
        for i in range(t, SENSORY, THREADS):
            finish(m, c, b, i, length)
        _wait()
        for i in range(t, SENSORY, THREADS):
            close_stretch(m, c, b, i, length)
        _wait()
        for i in range(t, EXCITATORY, THREADS):
            tidy(m, c, b, i, length)
        _wait()


@wp.kernel
def one_phase(m: Memory, c: Constants, phase: int, step: int) -> None:
    """A phase of every network, for a step of the stretch."""
    b, i = wp.tid()
    length = m.length[b]
    if phase == OPEN:
        open_stretch(m, c, b, i, 0)
    elif phase == SETTLE:
        settle(m, c, b, i, length)
    elif phase == READY:
        ready(m, c, b, i, length)
    elif phase == NEURONS and step <= length:
        neurons(m, c, b, i, step)
    elif phase == ROUTE and step <= length:
        route(m, c, b, i, step)
    elif phase == FINISH:
        finish(m, c, b, i, length)
    elif phase == CLOSE:
        close_stretch(m, c, b, i, length)
    elif phase == TIDY:
        tidy(m, c, b, i, length)
