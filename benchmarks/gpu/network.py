"""Many of the paper's networks on one device, each advanced by steps of its own, to the CPU's bits."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from benchmarks.gpu import network_stretch as stretch
from benchmarks.gpu.network_arrays import STATE, constants_of, memory_of
from scla_mj.anatomy import PROJECTIONS
from scla_mj.brain.network.parameters import build_parameters
from scla_mj.checked import CheckedConfig


class WarpNetworks:
    """One network for each seed, as `Network(config.network, config.plasticity, seed=seed)`.

    Attributes:
        released: dopamine that is released before the next step, (B, 8).
        took_s: seconds in steps so far.
    """

    def __init__(self, checked: CheckedConfig, seeds: Sequence[int]) -> None:
        config = checked.config
        step_ms = checked.clock.neural_step_ms
        parameters = build_parameters(config.network, config.plasticity, neural_step_ms=step_ms)
        self._stretch = parameters.stretch_steps
        self._constants = constants_of(parameters)
        self._memory = memory_of(parameters, config.network, seeds)
        self.released = np.zeros((len(seeds), len(PROJECTIONS)))
        self.took_s = 0.0

    def advance(
        self, steps: NDArray[np.int64], driven: NDArray[np.int64], current: NDArray[np.float64]
    ) -> NDArray[np.int64]:
        """Run each network by its steps, (B,), with a current into one population's neurons, -1 for none.

        Returns:
            The spikes by population, (B, 12).
        """
        started_s, memory = time.perf_counter(), self._memory
        memory.left.assign(steps.astype(np.int32))
        memory.driven.assign(driven.astype(np.int32))
        memory.current.assign(current.astype(np.float32))
        if self.released.any():
            memory.released.assign(self.released)
            self.released[steps > 0] = 0.0
        memory.total.zero_()
        arguments = [memory, self._constants]
        if wp.get_device().is_cuda:
            threads = int(stretch.THREADS)
            wp.launch(stretch.advance, (len(steps), threads), arguments, block_dim=threads)
        else:
            for _ in range(-(-int(steps.max()) // self._stretch)):
                self._one_stretch(arguments)
        total: NDArray[np.int64] = memory.total.numpy().astype(np.int64)
        self.took_s += time.perf_counter() - started_s
        return total

    def state(self, brain: int) -> dict[str, NDArray[Any]]:
        """Return copies of what `NetworkArrays` has of one network."""
        return {name: getattr(self._memory, name)[brain].numpy() for name in STATE}

    def _one_stretch(self, arguments: list[Any]) -> None:
        """Run the next stretch of every network that still has steps, phase by phase."""

        def run(phase: int, step: int = 0) -> None:
            shape = len(self.released), stretch.MANY[phase]
            wp.launch(stretch.one_phase, shape, [*arguments, phase, step])

        for phase in (stretch.OPEN, stretch.SETTLE, stretch.READY):
            run(phase)
        for step in range(1, self._stretch + 1):
            run(stretch.NEURONS, step)
            run(stretch.ROUTE, step)
        for phase in (stretch.FINISH, stretch.CLOSE, stretch.TIDY):
            run(phase)
